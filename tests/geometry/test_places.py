"""Goals by named places, against distances that geometry measures in another way."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.description import Goal, load_tank
from vgtsim.errors import DescriptionError
from vgtsim.geometry import enclosure_distance, make_profile, place_goals, segment_distance, tool_frame
from vgtsim.geometry.bed import make_bed
from vgtsim.site import Site

ROUNDING = 1e-9  # m


def place(scene, *tables):
    goals = tuple(Goal.model_validate({"name": f"g{k}", **table}) for k, table in enumerate(tables))
    motion = scene.task.motion.model_copy(update={"goals": goals})
    task = scene.task.model_copy(update={"motion": motion})
    return place_goals(dataclasses.replace(scene, task=task)).task.motion.goals


@pytest.mark.parametrize("azimuth", [0.0, 100.0, 250.0])
def test_a_goal_at_the_wall_is_as_far_from_the_shell(reach_scene, azimuth):
    at = {"place": "wall", "azimuth": f"{azimuth} deg", "height": 3.0, "distance": "0.7 m", "elevation": "10 deg"}
    (goal,) = place(reach_scene, {"at": at})
    tank = reach_scene.tank
    gap, inward = enclosure_distance(tank, make_profile(tank.shell), goal.position)
    assert gap == pytest.approx(0.7, abs=ROUNDING)
    assert goal.position[2] == 3.0
    assert np.dot(goal.direction, -inward) == pytest.approx(np.cos(np.radians(10)))
    assert goal.direction[2] == pytest.approx(np.sin(np.radians(10)))


def test_a_goal_over_the_waste_has_its_height_and_radius(reach_scene):
    at = {"place": "waste", "azimuth": "200 deg", "radius": "8 m", "height": "0.6 m"}
    (goal,) = place(reach_scene, {"at": at})
    assert goal.position[2] - reach_scene.tank.waste.level == pytest.approx(0.6)
    assert np.hypot(*goal.position[:2]) == pytest.approx(8.0)
    assert np.degrees(np.arctan2(goal.direction[1], goal.direction[0])) == pytest.approx(-160.0)
    assert goal.direction[2] == pytest.approx(-0.5)


@pytest.mark.parametrize("azimuth", [None, "30 deg", "-120 deg"])
def test_a_goal_beside_equipment_looks_at_it_from_its_distance(reach_scene, azimuth):
    site = Site(reach_scene)
    at = {"place": "saltwell_screen", "height": 3.0, "distance": 0.5} | ({"azimuth": azimuth} if azimuth else {})
    (goal,) = place(reach_scene, {"at": at})
    around = site.surroundings.obstacles
    k = around.names.index("saltwell_screen")
    gap = segment_distance(goal.position, goal.position, *around.axes[k])[0] - around.radii[k]
    assert gap == pytest.approx(0.5, abs=ROUNDING)
    ahead = np.add(goal.position, np.multiply(goal.direction, 0.5 + around.radii[k]))
    assert segment_distance(ahead, ahead, *around.axes[k])[0] < ROUNDING
    if azimuth is None:  # between the mast and the screen
        assert np.hypot(*goal.position[:2]) < np.hypot(*around.axes[k, 0, :2])


def test_a_goal_after_another_goes_along_its_tool_frame(reach_scene):
    first = {"position": [-5.0, 3.0, 3.0], "direction": [-1.0, 0.0, 1.0]}
    goals = place(
        reach_scene,
        first,
        {"at": {"place": "g0", "offset": [0.0, 0.0, 0.4]}},
        {"at": {"place": "g0", "offset": [0.1, 0.2, 0.0]}},
    )
    assert np.subtract(goals[1].position, goals[0].position) == pytest.approx(np.multiply(goals[0].direction, 0.4))
    assert goals[1].direction == pytest.approx(goals[0].direction)
    step = np.subtract(goals[2].position, goals[0].position)
    assert step @ np.array(goals[0].direction) == pytest.approx(0.0)
    assert step[2] == pytest.approx(0.1 * np.sqrt(0.5))  # x of the tool is upward, y level


@pytest.mark.parametrize("direction", [(0, 0, -1), (0, 0, 1), (1, 0, 0), (0.6, 0.0, -0.8), (0.0, -0.8, 0.6)])
def test_the_tool_frame_is_right_handed_with_its_y_level(direction):
    frame = tool_frame(direction)
    assert frame.T @ frame == pytest.approx(np.eye(3))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[:, 2] == pytest.approx(direction)
    assert frame[2, 1] == pytest.approx(0.0)
    assert frame[2, 0] > -ROUNDING


def test_a_direction_beside_a_place_is_kept(reach_scene):
    at = {"place": "wall", "azimuth": 0.0, "height": 3.0, "distance": 0.7}
    (goal,) = place(reach_scene, {"at": at, "direction": [0.0, 2.0, 0.0]})
    assert goal.direction == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("at", "key", "words"),
    [
        ({"place": "saltwell_scren", "height": 3.0, "distance": 0.5}, "place", "did you mean 'saltwell_screen'"),
        (
            {"place": "wall", "height": 3.0, "distance": 0.5},
            "azimuth",
            "nothing; allowed: this key with place = 'wall'",
        ),
        ({"place": "waste", "azimuth": 0, "radius": 5, "height": 1, "distance": 1}, "distance", "azimuth, elevation"),
        ({"place": "g5", "offset": [0, 0, 1]}, "place", "known: observation_well"),
        ({"place": "wall", "azimuth": 0, "height": 30, "distance": 1}, "height", "0 to 9.07 m"),
    ],
)
def test_a_place_that_is_wrong_is_refused_by_key(reach_scene, at, key, words):
    with pytest.raises(DescriptionError, match=words) as caught:
        place(reach_scene, {"at": at})
    assert caught.value.key == f"motion.goals.0.at.{key}"


def test_a_goal_is_given_in_one_form():
    at = {"place": "wall", "azimuth": 0, "height": 3, "distance": 1}
    for table in ({"position": [0, 0, 1]}, {}, {"position": [0, 0, 1], "at": at}):
        with pytest.raises(ValueError, match="position"):
            Goal.model_validate({"name": "g", **table})


def test_a_goal_over_uneven_waste_has_its_height_over_the_surface_there(reach_scene):
    scene = dataclasses.replace(reach_scene, tank=load_tank("type_iv"))
    bed = make_bed(scene.tank)
    assert bed is not None
    tables = [{"place": "waste", "azimuth": f"{turn} deg", "radius": 6.0, "height": 0.8} for turn in (0, 40, 200)]
    goals = place(scene, *({"at": at} for at in tables))
    surface = [bed.height_at(*goal.position[:2]) for goal in goals]
    assert [goal.position[2] for goal in goals] == pytest.approx(np.add(surface, 0.8))
    assert max(surface) - min(surface) > 0.01
