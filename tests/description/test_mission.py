"""Missions: their stages, and orders of steps that cannot be carried out."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pydantic import TypeAdapter

import vgtsim
from vgtsim.description.mission import MissionStep, find_disorder
from vgtsim.errors import DescriptionError

STEPS = TypeAdapter(tuple[MissionStep, ...])
INSERT, WITHDRAW, HOLD = {"do": "insert"}, {"do": "withdraw"}, {"do": "hold", "time": "5 s"}
ADD = {"do": "add_module", "time": "30 s"}
MOVE, RASTER = {"do": "move", "goal": "high"}, {"do": "raster", "width": [1, 0, 0], "depth": [0, 1, 0], "rows": 3}


def steps(*entries):
    return STEPS.validate_python(entries)


def test_order_that_can_be_carried_out():
    whole = (INSERT, HOLD, MOVE, RASTER, RASTER, WITHDRAW, INSERT, WITHDRAW)
    assert find_disorder(steps(*whole), ["high"], 5) is None
    grown = ({"do": "insert", "modules": 2}, MOVE, WITHDRAW, ADD, ADD, ADD, MOVE, WITHDRAW, ADD, HOLD, WITHDRAW)
    assert find_disorder(steps(*grown), ["high"], 3) is None


@pytest.mark.parametrize(
    ("entries", "index", "found"),
    [
        ((MOVE,), 0, "move while the arm is above the riser"),
        ((INSERT, INSERT), 1, "insert while the arm is in the tank"),
        ((INSERT, WITHDRAW, HOLD), 2, "hold while the arm is above the riser"),
        ((INSERT, RASTER), 1, "raster from where the insertion ends"),
        ((INSERT, {"do": "move", "goal": "nowhere"}), 1, "move to 'nowhere'"),
        ((ADD, ADD, ADD), 2, "add_module to the whole arm, which has 2"),
        ((ADD, MOVE, ADD), 2, "add_module to an arm of 1 modules that is at work"),
        ((INSERT, ADD), 1, "add_module to an arm of 2 modules that is at work"),
        ((ADD, WITHDRAW, MOVE), 2, "move while the arm is above the riser"),
        ((ADD, INSERT), 1, "insert while the arm is in the tank"),
        (({"do": "insert", "modules": 3},), 0, "insert of 3 modules"),
    ],
)
def test_order_that_cannot(entries, index, found):
    wrong = find_disorder(steps(*entries), ["high"], 2)
    assert wrong is not None
    assert wrong[:2] == (index, found)


def test_stages_are_goals_or_steps():
    scene = vgtsim.load("type_ii_reach").scene
    goals = scene.task.motion.goals
    assert [(stage.name, stage.position) for stage in scene.task.stages] == [
        (goal.name, goal.position) for goal in goals
    ]
    task = scene.task.model_copy(update={"mission": steps(INSERT, {"do": "move", "goal": "low"}, WITHDRAW)})
    stages = replace(scene, task=task).task.stages
    assert [stage.name for stage in stages] == ["insert", "low", "withdraw"]
    assert stages[0].position is None
    assert stages[1].position == goals[1].position


def test_scene_names_the_step():
    scene = vgtsim.load("type_ii_reach").scene
    with pytest.raises(
        DescriptionError,
        match=r"type_ii_reach.toml: mission.0: found move while .* allowed: insert or add_module first",
    ):
        replace(scene, task=scene.task.model_copy(update={"mission": steps(MOVE)}))
