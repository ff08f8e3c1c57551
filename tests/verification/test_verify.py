"""The verdict itself: a spoilt log never passes, whatever was spoilt."""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil

import numpy as np
import pytest
from playing import bend, change, play, shorten

from vgtsim import verification
from vgtsim.site import Site
from vgtsim.verification import CHECK_NAMES, MEASURES, verify
from vgtsim.verification.measures import Measure, measures_in

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def scene(reach_scene):
    """One module, asked for the pose it is moved to."""
    short = change(shorten(reach_scene, 1), log_rate=40.0)
    position, direction = Site(short).chain.tool(bend(short, [0.6], [0.8]))
    goal = short.task.motion.goals[0].model_copy(update={"position": tuple(position), "direction": tuple(direction)})
    motion = short.task.motion.model_copy(update={"goals": (goal,)})
    return dataclasses.replace(short, task=short.task.model_copy(update={"motion": motion}))


@pytest.fixture(scope="module")
def log(scene):
    return play(scene, bend(scene, [0.4], [0.4]), bend(scene, [0.6], [0.8]), 8.0)


def test_a_sound_run_passes(scene, log):
    report = verify(Site(scene), log)
    assert report.passed, [(check.name, check.quantity, check.measured) for check in report.checks if not check.passed]
    assert tuple(dict.fromkeys(check.name for check in report.checks)) == CHECK_NAMES


def spoil(log, name, value):
    return dataclasses.replace(log, **{name: value})


def half_nan(values):
    values = np.array(values)
    values[: len(values) // 2] = np.nan
    return values


@pytest.mark.parametrize("name", ["nodes", "ends", "member_force", "member_moment", "actuator_force", "tool_position"])
def test_what_is_not_a_number_fails_every_check(scene, log, name):
    report = verify(Site(scene), spoil(log, name, half_nan(getattr(log, name))))
    assert not any(check.passed for check in report.checks)
    assert {check.name for check in report.checks} == set(CHECK_NAMES)
    assert all(name in check.detail for check in report.checks)


@pytest.mark.parametrize(
    ("name", "change_of", "check"),
    [
        ("actuator_force", lambda x: -x, "axial_force"),
        ("mast_reaction", lambda x: 1.05 * x, "axial_force"),
        ("tool_position", lambda x: x + 1e-3, "kinematics_agreement"),
        ("tool_direction", lambda x: -x, "kinematics_agreement"),
        ("commanded", lambda x: x + 0.01, "tracking"),
        ("settled", lambda x: np.arange(len(x)) == len(x) - 1, "tracking"),
        ("member_force", lambda x: 1.02 * x, "axial_force"),
        ("warnings", lambda x: ("BADQACC: 7",), "contacts"),
        ("stopped", lambda x: "stopped early", "contacts"),
        ("ends", lambda x: x + 1e-5, "closure"),
    ],
)
def test_a_quantity_that_was_falsified_fails_its_check(scene, log, name, change_of, check):
    report = verify(Site(scene), spoil(log, name, change_of(getattr(log, name))))
    assert check in {row.name for row in report.checks if not row.passed}


def test_records_that_are_not_evenly_spaced_fail(scene, log):
    time = np.array(log.time)
    time[1::2] += 1e-4
    assert "evenly spaced" in verify(Site(scene), spoil(log, "time", time)).checks[0].detail


def test_every_measure_in_the_room_is_in_the_report_in_one_place():
    """A new check that the report does not know fails here: its file is missing in `report`, or it is imported twice."""
    names = [f"vgtsim.verification.{item.name}" for item in pkgutil.iter_modules(verification.__path__)]
    defined = [measure for name in names for measure in measures_in(importlib.import_module(name))]
    assert sorted(map(id, defined)) == sorted(map(id, MEASURES))


def test_every_function_that_checks_is_a_measure():
    assert all(isinstance(measure, Measure) for measure in MEASURES)


def test_every_measure_has_its_limit_in_the_scene_and_every_limit_its_measure(scene):
    limits = set(type(scene.task.limits).model_fields)
    assert {measure.limit for measure in MEASURES} == limits - {"safety_factor"}


def test_order_of_the_checks_is_that_of_the_design():
    assert CHECK_NAMES == (
        "record",
        "closure",
        "kinematics_agreement",
        "tracking",
        "axial_purity",
        "axial_force",
        "actuator_stroke",
        "actuator_speed",
        "actuator_force",
        "member_utilisation",
        "clearance",
        "contacts",
    )
