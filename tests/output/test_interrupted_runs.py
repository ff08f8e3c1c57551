"""Runs that are killed, or whose disk is full: what was logged is there, old results stand, and a resumed run ends the same.

`VGTSIM_KILLS=200` tries as many moments, by hand.
"""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import signal
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from playing import bend, change, shorten
from typer.testing import CliRunner

import vgtsim.planning
import vgtsim.site
from vgtsim import cli
from vgtsim.errors import DescriptionError
from vgtsim.log import LogWriter, chunks, open_log
from vgtsim.output import LOG, find_results, stage_results
from vgtsim.output.folders import UNFINISHED
from vgtsim.output.write import write_report_json
from vgtsim.planning import Leg, Tour
from vgtsim.plant import begin_log, record
from vgtsim.site import Site
from vgtsim.verification import verify

pytestmark = [pytest.mark.long, pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")]

KILLS = int(os.environ.get("VGTSIM_KILLS", "12"))
WAYS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, "full disk", "read-only folder")


@dataclass(frozen=True)
class Case:
    site: Site
    tour: Tour
    chunks: dict[str, bytes]
    report: dict
    seconds: float


def go(site: Site, tour: Tour, folder: Path, resume: bool = False) -> None:
    """What `vgtsim run` does, without page and film."""
    with stage_results(folder, resume=resume) as stage:
        writer = begin_log(site, tour, stage / LOG, resume=resume)
        if not writer.ended:
            record(site, tour, writer)
        write_report_json(verify(site, open_log(stage / LOG)), stage / "report.json")


def fail_from(chunk: int, way: object) -> None:
    """From a chunk on nothing can be written: by the system's own limit of a file's size, or no file can be put in place."""
    write, written = LogWriter.write, []

    def spoil(writer, piece):
        if len(written) == chunk and way == "full disk":
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        elif len(written) == chunk:
            chunks.replacing = refuse
        written.append(write(writer, piece))

    def refuse(path):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    if way == "full disk":
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    LogWriter.write = spoil


def fork(act) -> int:
    """Do it in a child, which ends with status 7 for an error of the system."""
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # until the child can end by it
    child = os.fork()
    if child:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
        return child
    status = 70
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
        act()
        status = 0
    except (OSError, DescriptionError):
        status = 7
    except KeyboardInterrupt:
        status = 130
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(status)


def read_chunks(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.glob("[0-9]*.parquet"))}


def read_report(folder: Path) -> dict:
    report = json.loads((folder / "report.json").read_text())
    for name in ("wall_s", "real_time_factor"):
        del report["performance"][name]
    return report


@pytest.fixture(scope="module")
def case(reach_scene, tmp_path_factory):
    scene = change(shorten(reach_scene, 1), timestep=0.005, log_rate=200.0)
    site, start, end = Site(scene), bend(scene, [0.3], [0.2]), bend(scene, [0.5], [0.5])
    s = np.linspace(0, 1, 401)[:, None]
    s = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
    tour = Tour(start, (Leg("goal", 0, site.chain.lengths(start + s * (end - start)), end, 1.0, "nothing"),), 0.005)
    go(site, tour, tmp_path_factory.mktemp("warm"))  # children inherit what it imports, and what the site keeps
    folder = tmp_path_factory.mktemp("whole")
    begin = time.monotonic()
    assert os.waitpid(fork(lambda: go(site, tour, folder)), 0)[1] == 0
    seconds = time.monotonic() - begin
    return Case(site, tour, read_chunks(folder / LOG), read_report(folder), seconds)


@pytest.mark.parametrize("number", range(KILLS))
def test_a_run_that_is_killed_loses_nothing(case, tmp_path, number):
    way, rng = WAYS[number % len(WAYS)], np.random.default_rng(number)
    old = number % 2 == 1
    if old:  # results of an earlier run, which had one chunk
        (tmp_path / LOG).mkdir()
        (tmp_path / LOG / "000000.parquet").write_bytes(b"old")
        (tmp_path / "report.json").write_text("old")

    def act():
        if isinstance(way, str):
            fail_from(int(rng.integers(len(case.chunks))), way)
        go(case.site, case.tour, tmp_path)

    child = fork(act)
    if not isinstance(way, str):
        time.sleep(rng.uniform(0, 1.05 * case.seconds))
        os.kill(child, way)
    status = os.waitpid(child, 0)[1]
    assert os.waitstatus_to_exitcode(status) in ((7,) if isinstance(way, str) else (0, -way, 130))
    place, stage = find_results(tmp_path), tmp_path / UNFINISHED
    stands = old and (tmp_path / LOG / "000000.parquet").read_bytes() == b"old"
    assert ((tmp_path / "report.json").exists() and (tmp_path / "report.json").read_text() == "old") == stands
    there = read_chunks((stage if stands else place) / LOG)
    assert list(there.items()) == list(case.chunks.items())[: len(there)]  # each one whole
    if there:
        book = open_log((stage if stands else place) / LOG)
        whole = (book.folder / "_end.json").exists()
        assert bool(book.stopped) == (not whole)
        if not whole:
            report = verify(case.site, book)
            assert not report.passed
            assert any("the run never ended" in check.detail for check in report.checks)
            assert report.to_dict()["performance"]["wall_s"] is None
    if stage.exists():
        assert os.waitpid(fork(lambda: go(case.site, case.tour, tmp_path, resume=True)), 0)[1] == 0
        assert read_chunks(tmp_path / LOG) == case.chunks
        assert read_report(tmp_path) == case.report
        assert not stage.exists()


def test_verbs_tell_what_an_interrupted_run_lacks_and_end_it(case, no_plots, tmp_path, monkeypatch):
    monkeypatch.setattr(vgtsim.site, "load_site", lambda _: case.site)
    monkeypatch.setattr(vgtsim.planning, "plan_phases", lambda _: [case.tour])
    write = LogWriter.write

    def interrupt(writer, piece):
        write(writer, piece)
        if len(read_chunks(writer.folder)) == 3:
            raise KeyboardInterrupt

    def invoke(*words):
        return CliRunner().invoke(cli.app, [*words], env={"COLUMNS": "200"})

    with monkeypatch.context() as patch:
        patch.setattr(LogWriter, "write", interrupt)
        assert invoke("run", "any", "--out", str(tmp_path)).exit_code == 130
    told = invoke("verify", str(tmp_path), "--no-plan")
    assert told.exit_code == 1
    assert "the log holds 300 records, to 1.495 s" in " ".join(told.output.split())
    assert "of unknown speed" in told.output
    assert "goals of the scene's file are others now" in told.output  # one module of the shipped scene's arm
    ended = invoke("run", "any", "--out", str(tmp_path), "--resume")
    assert ended.exit_code in (0, 1), ended.output
    assert sorted(os.listdir(tmp_path)) == ["log", "report.html", "report.json", "scene.mjb", "scene.xml"]
    assert read_chunks(tmp_path / LOG) == case.chunks
    assert invoke("run", "any", "--out", str(tmp_path), "--resume").exception.allowed.startswith("a folder with `unf")


def test_a_second_run_into_a_folder_is_refused(case, tmp_path):
    with stage_results(tmp_path) as stage:
        (stage / "report.json").write_text("{}")
        with (
            pytest.raises(DescriptionError, match="a run at work; allowed: one run at a time"),
            stage_results(tmp_path),
        ):
            pass
    assert [file.name for file in tmp_path.iterdir()] == ["report.json"]


def test_what_cannot_be_resumed_is_named(case, tmp_path):
    with pytest.raises(DescriptionError, match="no run that was interrupted"), stage_results(tmp_path, resume=True):
        pass
    LogWriter(tmp_path / "log", case.site.scene, {"numpy": "0"}, {})
    with pytest.raises(DescriptionError, match=r"_begin\.json: versions: found another versions"):
        begin_log(case.site, case.tour, tmp_path / "log", resume=True)


def test_a_chunk_of_another_run_is_not_gone_on_with(case, tmp_path):
    folder = tmp_path / UNFINISHED / LOG
    begin_log(case.site, case.tour, folder)
    for name, content in case.chunks.items():
        (folder / name).write_bytes(content)
    shutil.copy(folder / "000002.parquet", folder / "000001.parquet")
    with pytest.raises(DescriptionError, match=r"000001\.parquet: time: found other figures"):
        go(case.site, case.tour, tmp_path, resume=True)


def test_an_interrupted_move_is_ended(tmp_path):
    """The folder of a run between the moves of its results."""
    stage = tmp_path / UNFINISHED
    (stage / LOG).mkdir(parents=True)
    (stage / LOG / "new").touch()
    (stage / ".whole").write_text('["log", "report.json", "../../evil"]')
    (tmp_path / "report.json").write_text("new")  # moved before
    (tmp_path / "video.mp4").write_text("old")
    (tmp_path / LOG).mkdir()
    assert find_results(tmp_path) == tmp_path
    assert sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*")) == ["log", "log/new", "report.json"]
