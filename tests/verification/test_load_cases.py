"""Load cases of a scene, from its file to the rows of the report, against closed forms."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
from playing import bend, change, play, shorten

from vgtsim.description import load_scene
from vgtsim.errors import DescriptionError
from vgtsim.output.write import write_reports
from vgtsim.site import Site
from vgtsim.verification import Evidence, JudgedRun, verify
from vgtsim.verification.drives import check_case_drives, check_case_strength

SCENES = Path(__file__).parents[2] / "scenes"
CLOSED_FORM = 1e-8  # relative: the arm hangs straight to 1e-11 m
HEADER = '[[loads]]\nname = "{}"\ndead = 1e-9\npayload = 0\n'  # as good as weightless
PULL = 'force = ["0 N", "0 N", "{} kN"]\n'


def scene_with(tmp_path, cases):
    text = (SCENES / "type_ii_reach.toml").read_text()
    for name in ("../models/arm15/arm15.toml", "tanks/type_ii.toml"):
        text = text.replace(f'"{name}"', f'"{(SCENES / name).resolve()}"')
    text = re.sub(r"\[\[loads\]\]\n(?:[^\[\n][^\n]*\n|\n)*", "", text)  # the scene's own
    (tmp_path / "cases.toml").write_text(text + "\n" + cases)
    return load_scene(tmp_path / "cases.toml")


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    """One module and its prism hang straight; pulled by 50 kN, and by 100 kN down and 60 kN up in turn."""
    cases = "".join(HEADER.format(name) + PULL.format(pull) for name, pull in (("p", -50), ("twice", -100), ("up", 60)))
    scene = shorten(scene_with(tmp_path_factory.mktemp("cases"), cases), 1)
    q = bend(scene, [0.0], [0.0])
    return scene, play(scene, q, q, 0.1)


def case_rows(report):
    return {check.name: check for check in report.checks if check.quantity.endswith("load cases")}


def test_rows_are_the_hand_calculation(hanging):
    """Six longerons share a pull, the actuators hold the twelve apart: with h the half extension and a the lean of the
    mid nodes beyond the corners' edge, longerons carry P L / (6 h) and actuators -2 P a / (3 sqrt(3) h)."""
    scene, log = hanging
    arm = scene.manipulator
    module = arm.active[0]
    half, pull = module.straight / 2, 100e3
    lean = np.sqrt(module.longeron**2 - arm.face_side**2 / 4 - half**2)
    tube, cylinder = arm.tubes[module.longeron_tube], arm.cylinders[module.cylinder]
    steel = arm.materials[tube.material]
    drawn = tube.model_copy(update={"wall": steel.design_wall * tube.wall})
    strong = steel.yield_strength * drawn.area / scene.task.limits.safety_factor
    rows = case_rows(verify(Site(scene), log))
    strength, drive = rows["member_utilisation"], rows["actuator_force"]
    assert strength.measured == pytest.approx(pull * module.longeron / (6 * half) / strong, rel=CLOSED_FORM)
    push = cylinder.pressure * np.pi / 4 * cylinder.bore**2
    assert drive.measured == pytest.approx(2 * pull * lean / (3 * np.sqrt(3) * half) / push, rel=CLOSED_FORM)
    assert strength.where.startswith("m1/longeron/")
    assert drive.where.startswith("m1/actuator/")
    for row in (strength, drive):
        assert row.detail.startswith("case twice, margin ")
        assert float(row.detail.split("margin ")[1]) == pytest.approx(1 / row.measured - 1, rel=5e-3)


def test_rows_are_judged_by_the_scene_s_limits(hanging):
    scene, log = hanging
    rows = case_rows(verify(Site(scene), log))
    assert all(row.passed for row in rows.values())
    limits = scene.task.limits.model_copy(update={"member_utilisation": 0.99 * rows["member_utilisation"].measured})
    strict = dataclasses.replace(scene, task=scene.task.model_copy(update={"limits": limits}))
    rows = case_rows(verify(Site(strict), log))
    assert not rows["member_utilisation"].passed
    assert rows["actuator_force"].passed


@pytest.mark.long
def test_rows_are_in_the_written_reports(hanging, tmp_path):
    scene, log = hanging
    report = verify(Site(scene), log)
    write_reports(JudgedRun(Site(scene), log, report), tmp_path)
    data = json.loads((tmp_path / "report.json").read_text())
    written = [row for row in data["checks"] if row["quantity"].endswith("load cases")]
    assert {row["name"] for row in written} == {"member_utilisation", "actuator_force"}
    assert "case twice, margin" in (tmp_path / "report.html").read_text()


def test_plain_case_repeats_the_run(hanging, tmp_path):
    """Dead load and payload as they are: what the resting arm carries, by the log and by the case."""
    _, log = hanging
    plain = shorten(scene_with(tmp_path, '[[loads]]\nname = "run"\n'), 1)
    report = verify(Site(plain), log)
    run = {check.quantity: check.measured for check in report.checks}
    for row in case_rows(report).values():
        assert row.measured == pytest.approx(run[row.quantity.removesuffix(", load cases")], rel=1e-4)


def test_case_without_any_load_has_no_end_of_margin(hanging, tmp_path):
    _, log = hanging
    case = '[[loads]]\nname = "nothing"\npayload = 0\n'
    empty = change(shorten(scene_with(tmp_path, case), 1), gravity=0.0)
    run = Evidence(Site(empty), log)
    strength, drive = check_case_strength(run), check_case_drives(run)
    assert strength.value == drive.value == 0.0
    assert "margin inf" in drive.detail


def test_cases_of_one_name_are_refused(tmp_path):
    with pytest.raises(DescriptionError, match=r"load case names must differ.*'p', 'p'"):
        scene_with(tmp_path, 2 * (HEADER.format("p") + PULL.format(-1)))


def test_scene_without_cases_has_no_rows_for_them(hanging, tmp_path):
    _, log = hanging
    assert not case_rows(verify(Site(shorten(scene_with(tmp_path, ""), 1)), log))
