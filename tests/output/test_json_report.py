"""The report for machines says what the report says."""

import dataclasses
import json
import math

import pytest

from vgtsim.output.json_report import write_report_json
from vgtsim.verification.report import CHECK_NAMES

CHECK_FIELDS = {"name", "measured", "limit", "unit", "passed", "where", "when", "source"}
PERFORMANCE_FIELDS = {"simulated_s", "wall_s", "real_time_factor", "steps", "nv"}


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
    impossible = dataclasses.replace(report, performance={"wall_s": math.inf})  # JSON has no infinity
    with pytest.raises(ValueError):
        write_report_json(impossible, path)
    assert [(file.name, file.read_text(encoding="utf-8")) for file in tmp_path.iterdir()] == [("report.json", "old")]
