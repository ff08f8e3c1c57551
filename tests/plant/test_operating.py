"""An operator's record played into the plant: the same log each time, verified like a tour, under every drive."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import change, shorten

from vgtsim.control import check_operation, rehearse
from vgtsim.description import Operator, OperatorCommand
from vgtsim.errors import CommandError, DescriptionError
from vgtsim.log import ARRAYS
from vgtsim.plant import operate
from vgtsim.site import Site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

STEP = 0.02  # s
COMMANDS = (
    OperatorCommand(time=0.1, twist=(0.03, 0.02, -0.04, 0, 0, 0)),
    OperatorCommand(time=1.0, twist=(-0.05, 0, 0.02, 0, 0.02, 0)),
    OperatorCommand(time=1.5, hold=True),
)
TRIMMED = 4e-3  # m: a tenth of a millimetre is left of each length, with levers of up to twenty


def make_site(reach_scene, commands=COMMANDS, **settings):
    scene = change(shorten(reach_scene, 2), **({"timestep": STEP, "log_rate": 1 / STEP} | settings))
    motion = scene.task.motion.model_copy(update={"goals": ()})
    task = scene.task.model_copy(update={"motion": motion, "operator": Operator()})
    return Site(dataclasses.replace(scene, task=task, commands=tuple(commands)))


@pytest.fixture(scope="module")
def site(reach_scene):
    return make_site(reach_scene)


@pytest.fixture(scope="module")
def log(site):
    return operate(site)


def test_the_log_passes_every_check(site, log):
    report = verify(site, log, rehearse(site, log))
    assert [(check.quantity, check.measured, check.limit) for check in report.checks if not check.passed] == []
    names = {(check.name, check.quantity) for check in report.checks}
    assert ("tracking", "tool position to the operator's target") in names
    assert ("record", "stages of the operation missing or out of place") in names
    assert not any("goal" in quantity for _, quantity in names)
    assert report.notes == ()


def test_the_same_record_gives_the_same_log_bit_for_bit(site, log):
    again = operate(Site(site.scene))
    for name in ARRAYS:
        assert getattr(again, name).tobytes() == getattr(log, name).tobytes(), name
    assert again.digests == log.digests


def test_the_log_has_the_targets(site, log):
    position, direction = site.chain.tool(site.start)
    assert np.allclose(log.target[0], [*position, *direction], atol=1e-12)
    assert np.linalg.norm(log.target[-1, :3] - position) > 0.01
    assert log.settled[-1]


@pytest.mark.parametrize(
    ("spoil", "check", "words"),
    [
        (lambda log: {"commanded": moved(log.commanded)}, "tracking", "commanded length to the plan"),
        (lambda log: {"target": moved(log.target, 0.01)}, "tracking", "tool position to the operator's target"),
        (lambda log: {"settled": np.zeros_like(log.settled)}, "record", "stages of the operation"),
        (lambda log: {"target": np.zeros((0, 6))}, "tracking", "tool position to the operator's target"),
    ],
)
def test_a_log_that_was_changed_fails(site, log, spoil, check, words):
    wrong = dataclasses.replace(log, **spoil(log))
    report = verify(site, wrong, rehearse(site, wrong))
    failed = [(item.name, item.quantity) for item in report.checks if not item.passed]
    assert any(name == check and words in quantity for name, quantity in failed), failed


def moved(rows, by=1e-5):
    found = rows.copy()
    found[len(rows) // 2] += by
    return found


def test_commands_of_another_record_are_told(site, log):
    other = dataclasses.replace(site.scene, commands=(COMMANDS[0], COMMANDS[2]))
    report = verify(Site(other), log, rehearse(Site(other), log))
    failed = {item.quantity for item in report.checks if not item.passed}
    assert "commanded length to the plan" in failed
    assert any(note.startswith("the programme is not that of the run") for note in report.notes)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"lengths": (1.0, 1.2)}, r"at 3 s: lengths: found shape \(2,\); allowed: shape \(6,\)"),
        ({"lengths": (9.0,) * 6}, "at 3 s: lengths: found m1/actuator/1 at 9.0000 m"),
        ({"goal": (0.0,) * 6, "method": "newton"}, "at 3 s: goal: found a direction of length 0"),
        ({"hold": True, "objective": ("speed",)}, "at 3 s: .*speed"),
    ],
)
def test_a_command_that_cannot_be_given_is_said_with_its_record_before_anything_runs(site, wrong, words):
    task = site.task.model_copy(update={"operator": Operator(record="hand.jsonl")})
    commands = (*COMMANDS, OperatorCommand(time=3.0, **wrong))
    with pytest.raises(DescriptionError, match="hand.jsonl: command " + words):
        check_operation(Site(dataclasses.replace(site.scene, task=task, commands=commands)))
    check_operation(Site(dataclasses.replace(site.scene, task=task)))


def test_a_refused_command_ends_the_run_with_its_reason(reach_scene):
    wrong = OperatorCommand(time=0.1, lengths=(1.0, 1.0))
    with pytest.raises(CommandError, match=r"lengths: found shape \(2,\); allowed: shape \(6,\)"):
        operate(make_site(reach_scene, (wrong,)))


SOFT = {"members": "elastic", "damping_ratio": 0.05, "timestep": 8e-3, "log_rate": 125.0}


@pytest.mark.parametrize(
    "settings",
    [
        {"drive": "servo", "timestep": 8e-3, "log_rate": 125.0},
        SOFT,
        SOFT | {"drive": "hydraulic", "member_mass": "lumped"},
        {"members": "sections"},
    ],
    ids=["servo", "springs", "hydraulic", "sections"],
)
def test_every_drive_brings_the_tool_to_the_target(reach_scene, settings):
    settle = reach_scene.task.motion.model_copy(update={"settle_speed": 1e-4, "patience": 3.0})
    scene = dataclasses.replace(reach_scene, task=reach_scene.task.model_copy(update={"motion": settle}))
    commands = (*COMMANDS[:2], OperatorCommand(time=5.0, hold=True))
    site = make_site(scene, (commands[0], COMMANDS[2], commands[2]), **settings)
    log = operate(site)
    assert log.stopped == ""
    assert len(log.contact_time) == 0
    q = site.chain.inputs_from_lengths(log.actual[-1], site.start)
    assert np.linalg.norm(site.chain.tool(q)[0] - log.target[-1, :3]) < TRIMMED
    plan = rehearse(site, log).legs[0].lengths
    assert np.abs(plan[: len(log.commanded)] - log.commanded).max() < 1e-9  # the measured lengths tell the trim
