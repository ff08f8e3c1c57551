"""A run as one page: which frames it holds, what it says, and how large it is; no browser is needed."""

from __future__ import annotations

import dataclasses
import json
import re
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("viser")

from vgtsim.cli import app
from vgtsim.log import save_log
from vgtsim.output.quantities import MINUS
from vgtsim.output.readings import read_instant
from vgtsim.proximity import Proximity
from vgtsim.verification import JudgedRun
from vgtsim.web import write_recording
from vgtsim.web.recording import choose_records

SMALL = 1_400_000  # bytes: the client, the tank, and some tens of frames
BARREL = 0.05  # m: plans take cylinders for as thick as their barrels everywhere, checks do not


@pytest.fixture(scope="module")
def page(site, log, report, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "replay.html"
    path.with_name("report.html").write_text("")
    return write_recording(site, log, report, path), path


def read_rows(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r"const run = (\{.*?\});\n", text)[1]), text


def test_frames_are_even_and_whole_at_both_ends(site, log):
    axial = log.axial(site.truss.ends)
    chosen = choose_records(log, axial, 60)
    assert chosen[0] == 0
    assert chosen[-1] == log.count - 1
    assert len(chosen) <= 61
    assert np.diff(chosen).min() >= (log.count - 1) // 59


def test_an_arm_at_rest_is_one_frame_until_something_is_said(site, log):
    axial = log.axial(site.truss.ends)
    still = {name: np.repeat(getattr(log, name)[:1], log.count, axis=0) for name in ("nodes", "goal", "settled")}
    rest, same = dataclasses.replace(log, **still), np.repeat(axial[:1], log.count, axis=0)
    assert choose_records(rest, same, log.count).tolist() == [0, log.count - 1]
    settled = still["settled"].copy()
    settled[100:] = ~settled[100:]
    told = dataclasses.replace(rest, settled=settled)
    assert choose_records(told, same, log.count).tolist() == [0, 100, log.count - 1]


def test_the_page_says_verdict_frames_and_readings(page, site, log, report):
    recording, path = page
    rows, text = read_rows(path)
    assert recording.size == path.stat().st_size
    assert f"{recording.frames} frames of {log.count} records" in text
    assert "Synthetic tour of four goals &amp; a &lt;sanity&gt; check" in text
    assert 'plots: <a href="report.html">report.html</a> in the folder of the run' in text
    assert f"<b>{'PASSED' if report.passed else 'FAILED'}</b>" in text
    assert len(rows["rows"]) == recording.frames
    axial, records = log.axial(site.truss.ends), np.searchsorted(log.time, np.array(rows["times"]) - 1e-3)
    for k, record in enumerate(records.tolist()):
        assert tuple(rows["rows"][k][:4]) == read_instant(JudgedRun(site, log, report), record, axial[record])


def test_the_same_run_gives_the_same_page(page, site, log, report, tmp_path):
    (tmp_path / "report.html").write_text("")
    write_recording(site, log, report, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == page[1].read_bytes()
    assert {file.name for file in tmp_path.iterdir()} == {"again.html", "report.html"}


@pytest.mark.long
def test_a_page_that_would_be_too_large_has_fewer_frames_and_says_so(page, site, log, report, tmp_path):
    recording = write_recording(site, log, report, tmp_path / "small.html", SMALL)
    assert recording.size <= SMALL
    assert 2 < recording.frames < page[0].frames
    text = (tmp_path / "small.html").read_text(encoding="utf-8")
    assert f"{recording.frames} frames of {log.count} records" in text
    assert "plots: report.html in the folder of the run" in text  # which is not beside this page
    with pytest.raises(ValueError, match=r"a page of 2 frames takes \d+ bytes; allowed: at most 1000"):
        write_recording(site, log, report, tmp_path / "none.html", 1000)
    assert not (tmp_path / "none.html").exists()


def test_the_nearest_thing_is_told_as_it_is(page, site, log):
    """Here by Proximity, which knows no mast: only that may be nearer."""
    rows, _ = read_rows(page[1])
    records = np.searchsorted(log.time, np.array(rows["times"]) - 1e-3)
    least = Proximity(site).apart(log.nodes[records], log.tool_position[records]).least
    told = [row[4].replace(MINUS, "-").split(" m, ") for row in rows["rows"]]
    by_mast = [thing.endswith("mast") for _, thing in told]
    assert 0 < sum(by_mast) < len(told) / 2
    for (gap, _), wanted, mast in zip(told, least.tolist(), by_mast, strict=True):
        assert float(gap) <= wanted + 5e-4 if mast else float(gap) == pytest.approx(wanted, abs=BARREL)


def test_while_the_mast_is_moved_distances_are_those_of_the_checks(site, log, report, tmp_path):
    """The surroundings of plans hold the mast where the scene says."""
    height = np.where(np.arange(log.count) < 5, 0.5, 0.0)
    nodes = log.nodes + height[:, None, None] * [0, 0, 1]
    tool = log.tool_position + height[:, None] * [0, 0, 1]
    moved = dataclasses.replace(log, nodes=nodes, tool_position=tool, feed=height).read(0, 10)
    moved = dataclasses.replace(moved, feed_commanded=height[:10], feed_force=np.zeros(10))
    write_recording(site, moved, report, tmp_path / "fed.html")
    rows, _ = read_rows(tmp_path / "fed.html")
    records = np.searchsorted(moved.time, np.array(rows["times"]) - 1e-3)
    least = Proximity(site).apart(moved.nodes, moved.tool_position).least
    lifted = [(row[4], least[record]) for row, record in zip(rows["rows"], records, strict=True) if height[record]]
    assert len(lifted) > 2
    for told, wanted in lifted:
        assert told.startswith(f"{wanted:.3f} m, ".replace("-", MINUS))
        assert " to " in told


@pytest.fixture(scope="module")
def folder(site, log, tmp_path_factory):
    place = tmp_path_factory.mktemp("run")
    save_log(place / "log", site.scene, log)
    return place


@pytest.mark.long
def test_the_verb_writes_the_page_of_a_run(folder):
    result = CliRunner().invoke(app, ["show", str(folder), "--web"])
    assert result.exit_code == 0, result.output
    size = (folder / "replay.html").stat().st_size
    assert re.search(rf"replay.html\n\d+ frames of \d+ records, {size / 1e6:.1f} MB\n", result.output)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("arm9", "--web"), "--web: found no log of a run; allowed: the folder that `vgtsim run` left"),
        (("RUN",), "found the folder of a run; allowed: a run with --web; or an arm, a tank or a scene"),
        (("RUN", "--web", "--inputs", "h1=1"), "--web: found a pose; allowed: the folder of a run alone"),
    ],
)
def test_what_cannot_be_shown_is_refused_by_name(arguments, said, folder):
    result = CliRunner().invoke(app, ["show", *(str(folder) if word == "RUN" else word for word in arguments)])
    assert said in str(result.exception)


def test_a_page_without_the_extra_says_what_to_install(folder, monkeypatch):
    for name in [name for name in sys.modules if name == "vgtsim.web" or name.startswith("vgtsim.web.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    result = CliRunner().invoke(app, ["show", str(folder), "--web"])
    assert "pip install 'vgtsim[live]'" in str(result.exception)
