"""What a run leaves, and what it leaves when it cannot."""

import dataclasses
import errno
import json
import math
import os
import sys

import numpy as np
import pytest

from vgtsim.errors import DescriptionError
from vgtsim.log import open_log
from vgtsim.output.write import prepare_folder, write_outputs, write_pdf, write_report_json
from vgtsim.replacing import replacing
from vgtsim.verification.report import CHECK_NAMES

CHECK_FIELDS = {"name", "measured", "limit", "unit", "passed", "where", "when", "source"}
PERFORMANCE_FIELDS = {"simulated_s", "wall_s", "real_time_factor", "steps", "nv"}


@pytest.mark.long
def test_reports_and_log_are_written_and_nothing_else(site, log, report, no_plots, tmp_path):
    assert write_outputs(site, log, report, tmp_path / "a" / "b") is None
    assert sorted(file.name for file in (tmp_path / "a" / "b").iterdir()) == [
        "log",
        "report.html",
        "report.json",
    ]
    book = open_log(tmp_path / "a" / "b" / "log")
    np.testing.assert_array_equal(book.read(0, book.count).nodes, log.nodes)


def test_a_folder_that_cannot_be_made_is_named(site, log, report, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    folder = tmp_path / "file" / "out"
    for attempt in (lambda: prepare_folder(folder), lambda: write_outputs(site, log, report, folder)):
        with pytest.raises(DescriptionError) as caught:
            attempt()
        assert str(folder) in str(caught.value)


def test_a_failed_block_leaves_nothing(tmp_path):
    def fail_half_way():
        with replacing(tmp_path / "file.txt") as partial:
            partial.write_text("half", encoding="utf-8")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert list(tmp_path.iterdir()) == []


def test_a_partial_file_keeps_its_suffix(tmp_path):
    with replacing(tmp_path / "run.json") as partial:
        assert partial.suffix == ".json"
        assert partial.parent == tmp_path
        partial.write_bytes(b"")


@pytest.mark.skipif(os.name == "nt", reason="nothing is flushed there")
def test_content_is_on_the_disk_before_its_name(tmp_path, monkeypatch):
    """A loss of power cannot be tried; the order of what the system is told can."""
    told = []

    def tell(name, real, place):
        monkeypatch.setattr(os, name, lambda *args: (told.append((name, place(args[0]))), real(*args)))

    tell("fsync", os.fsync, lambda handle: "folder" if os.path.isdir(handle) else f"file of {os.fstat(handle).st_size}")
    tell("replace", os.replace, lambda path: path.suffix)
    with replacing(tmp_path / "file.txt") as partial:
        partial.write_text("whole", encoding="utf-8")
    assert told == [("fsync", "file of 5"), ("replace", ".txt"), ("fsync", "folder")]


def test_a_disk_that_takes_nothing_leaves_the_old_file(tmp_path, monkeypatch):
    file = tmp_path / "file.txt"
    file.write_text("old", encoding="utf-8")

    def refuse(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(OSError, match="No space left"), replacing(file) as partial:
        partial.write_text("new", encoding="utf-8")
    assert [path.read_text(encoding="utf-8") for path in tmp_path.iterdir()] == ["old"]


def test_reading_back_gives_the_report(report, tmp_path):
    write_report_json(report, tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8")) == report.to_dict()


def test_promised_fields_are_there(report, tmp_path):
    write_report_json(report, tmp_path / "report.json")
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert {"scene", "passed", "checks", "performance", "versions"} <= set(data)
    assert set(data["performance"]) == PERFORMANCE_FIELDS
    assert {row["name"] for row in data["checks"]} == set(CHECK_NAMES)
    assert all(set(row) >= CHECK_FIELDS for row in data["checks"])


def test_a_figure_that_is_not_finite_is_null_and_failed(report, tmp_path):
    broken = dataclasses.replace(report.checks[0], measured=math.nan, when=math.nan)
    failed = dataclasses.replace(report, checks=(broken, *report.checks[1:]))
    write_report_json(failed, tmp_path / "report.json")
    row = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["checks"][0]
    assert (row["measured"], row["when"], row["passed"]) == (None, None, False)


def test_a_failed_write_leaves_the_old_file_alone(report, tmp_path):
    path = tmp_path / "report.json"
    path.write_text("old", encoding="utf-8")
    impossible = dataclasses.replace(report, versions={"numpy": math.inf})  # JSON has no infinity
    with pytest.raises(ValueError):
        write_report_json(impossible, path)
    assert [(file.name, file.read_text(encoding="utf-8")) for file in tmp_path.iterdir()] == [("report.json", "old")]


@pytest.mark.long
def test_the_report_as_pdf(judged, tmp_path):
    pytest.importorskip("weasyprint", reason="vgtsim[pdf] is not installed")
    assert write_pdf(judged, tmp_path) is None
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")


def test_without_weasyprint_the_pdf_names_what_is_missing(judged, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    missing = write_pdf(judged, tmp_path)
    assert "pip install vgtsim[pdf]" in str(missing)
    assert not list(tmp_path.iterdir())
