"""Missions: their stages, and orders of steps that cannot be carried out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter

import vgtsim
from vgtsim.description.mission import MissionStep, find_disorder
from vgtsim.errors import DescriptionError
from vgtsim.site import Site

STEPS = TypeAdapter(tuple[MissionStep, ...])
INSERT, WITHDRAW, HOLD = {"do": "insert"}, {"do": "withdraw"}, {"do": "hold", "time": "5 s"}
ADD = {"do": "add_module", "time": "30 s"}
LINE = {"shape": "line", "to": [7, 0, 2]}
FOLLOW = {"do": "follow", "path": {"name": "path", "start": [6, 0, 2], "direction": [1, 0, 0], "pieces": [LINE]}}
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
    scene = vgtsim.load("type_ii_mission").scene
    with pytest.raises(
        DescriptionError,
        match=r"type_ii_mission.toml: mission.0: found move while .* allowed: insert or add_module first",
    ):
        replace(scene, task=scene.task.model_copy(update={"mission": steps(MOVE)}))


def test_an_arm_on_a_mast_that_is_held_hangs_in_the_tank_from_the_beginning():
    whole = steps(MOVE, FOLLOW, RASTER, HOLD)
    assert find_disorder(whole, ["high"], 2, fed=False) is None
    wrong = (0, "move while the arm is above the riser", "insert or add_module first")
    assert find_disorder(whole, ["high"], 2, fed=True) == wrong
    assert find_disorder(steps(MOVE, WITHDRAW), ["high"], 2, fed=False) is not None


def test_a_path_is_two_stages_and_its_file_is_found_beside_the_scene():
    scene = vgtsim.load("type_ii_raster").scene
    way, path = scene.task.stages
    assert (way.name, way.position) == ("to waste_raster", (6.0, -1.5, 1.5))
    assert path.path is not None
    poses = vgtsim.load("type_ii_raster").stage_poses
    assert np.isfinite(poses).all()
    assert poses[0, :3].tolist() == list(path.path.start)


def test_a_scene_without_goals_and_paths_has_no_place_to_start_near():
    scene = vgtsim.load("type_ii_reach").scene
    motion = scene.task.motion.model_copy(update={"goals": (), "start": None})
    task = scene.task.model_copy(update={"motion": motion, "mission": steps(HOLD)})
    with pytest.raises(DescriptionError, match=r"motion.start: found nothing"):
        Site(replace(scene, task=task)).start  # noqa: B018
