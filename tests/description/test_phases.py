"""A mission in phases: which arm each has, what it does, and where a part stands in the clamp."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pydantic import TypeAdapter

import vgtsim
from vgtsim.description import Clamp, begins_anew, cut_arm, dump_scene, list_phases, load_scene, parse_scene, pick_phase
from vgtsim.description.mission import MissionStep
from vgtsim.errors import DescriptionError

STEPS = TypeAdapter(tuple[MissionStep, ...])
INSERT, WITHDRAW, MOVE = {"do": "insert"}, {"do": "withdraw"}, {"do": "move", "goal": "mid"}
CLAMP = Clamp(name="jaws", above_flange=0.3, force=6e4)


def add(time):
    return {"do": "add_module", "time": time}


def scene_of(*entries, clamp=CLAMP):
    base = vgtsim.load("arm9_nullspace").scene
    task = base.task.model_copy(update={"mission": STEPS.validate_python(entries)})
    return replace(base, task=task, tank=base.tank.model_copy(update={"clamp": clamp}))


def tell(scene):
    return [
        (
            len(phase.manipulator.active),
            [step.do for step in phase.task.mission],
            phase.task.phase and phase.task.phase.stands,
        )
        for phase in list_phases(scene)
    ]


def test_an_arm_grows_works_and_is_taken_apart():
    scene = scene_of(add(20.0), add(30.0), add(40.0), MOVE, WITHDRAW)
    assert tell(scene) == [
        (1, ["add_module", "hold"], True),
        (2, ["add_module", "hold"], True),
        (3, ["add_module", "move", "withdraw"], False),
        (2, ["hold", "withdraw"], True),
        (1, ["hold", "withdraw"], True),
    ]
    phases = list_phases(scene)
    waits = [step.time for phase in phases for step in phase.task.mission if step.do == "hold"]
    assert waits == [30.0, 40.0, 40.0, 30.0]  # a part stands for the time of the module that is set on it, or taken off
    assert [begins_anew(phase) for phase in phases] == [True, False, False, False, False]
    assert [phase.task.phase.number for phase in phases] == [1, 2, 3, 4, 5]


def test_shorter_arms_go_in_first():
    scene = scene_of({"do": "insert", "modules": 1}, WITHDRAW, INSERT, MOVE, WITHDRAW, INSERT, WITHDRAW)
    assert tell(scene) == [
        (1, ["insert", "withdraw"], False),
        (3, ["insert", "move", "withdraw", "insert", "withdraw"], False),
    ]
    assert all(begins_anew(phase) for phase in list_phases(scene))


def test_a_shorter_arm_may_work_at_another_depth():
    deep = {"do": "insert", "modules": 2, "pivot_depth": 0.6}
    scene = scene_of(deep, WITHDRAW, deep | {"pivot_depth": 1.1}, WITHDRAW, INSERT, WITHDRAW)
    phases = list_phases(scene)
    mast = scene.task.mast
    assert [phase.task.mast.pivot_depth for phase in phases] == [0.6, 1.1, mast.pivot_depth]
    assert [phase.pivot_height for phase in phases] == [
        scene.tank.shell.crown - p.task.mast.pivot_depth for p in phases
    ]
    assert len(list_phases(scene_of(INSERT | {"pivot_depth": 0.6}))) == 1
    assert list_phases(scene_of(INSERT | {"pivot_depth": 0.6}))[0].task.mast.pivot_depth == 0.6
    with pytest.raises(DescriptionError, match=r"mast\.pivot_depth: found 20 m"):
        list_phases(scene_of(deep | {"pivot_depth": 20.0}))


def test_a_mission_of_one_arm_is_one_scene():
    scene = scene_of(INSERT, MOVE, WITHDRAW)
    assert list_phases(scene) == (scene,)
    assert list_phases(scene)[0] is scene


def test_a_phase_is_a_scene_of_its_own():
    phase = list_phases(scene_of(add(5.0), add(5.0), WITHDRAW))[0]
    assert list_phases(phase) == (phase,)
    assert parse_scene(dump_scene(phase)) == replace(phase)
    whole = scene_of(INSERT).manipulator
    assert phase.manipulator == cut_arm(whole, whole.modules.index(whole.active[-1]))
    assert phase.task.title.endswith(": phase 1 of 3, 1 module")


def test_phases_are_picked_by_number():
    scene = scene_of(add(5.0), add(5.0), WITHDRAW)
    for phase in list_phases(scene):
        assert pick_phase(scene, phase) == phase
    assert pick_phase(scene, scene) is scene
    with pytest.raises(DescriptionError, match="mission of 5 phases; allowed: one of 3, as in the log"):
        pick_phase(scene_of(add(5.0), add(5.0), add(5.0), WITHDRAW), list_phases(scene)[0])


def test_modules_are_added_in_a_clamp():
    with pytest.raises(DescriptionError, match=r"tank.clamp: found nothing; allowed: a table \[clamp\]"):
        scene_of(add(5.0), clamp=None)


def test_phases_know_all_patches_that_the_mission_cuts():
    scene = vgtsim.load("type_ii_heel").scene
    short, cut = STEPS.validate_python(({"do": "insert", "modules": 1},)), scene.task.mission[1:4]
    other = scene.task.patches[0].model_copy(update={"name": "left_alone"})
    mission = (*short, *cut, *STEPS.validate_python((WITHDRAW, INSERT, WITHDRAW)))
    task = scene.task.model_copy(update={"mission": mission, "patches": (*scene.task.patches, other)})
    phases = list_phases(replace(scene, task=task))
    assert [phase.task.phase.patches for phase in phases] == [("outer_heel",)] * 2
    first, last = (vgtsim.Site(phase).diggings for phase in phases)
    assert (first.places == last.places).all()
    assert (first.rows, first.columns) == (last.rows, last.columns)


def test_a_user_writes_no_phase(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text('base = "arm9_nullspace"\n[phase]\nnumber = 1\ncount = 2\nstands = false\n')
    with pytest.raises(DescriptionError, match="phase: found a table; allowed: no such table"):
        load_scene(file)
