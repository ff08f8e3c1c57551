"""Starts that scenes give in every form, and those that are searched."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from vgtsim.description import load_scene
from vgtsim.description.motion import StartPosture
from vgtsim.description.tank import Equipment
from vgtsim.errors import DescriptionError
from vgtsim.positioning import Keep, search_start
from vgtsim.site import Site, load_site

ROUNDING = 1e-9
ON_GOAL = 1e-8  # m


def with_start(scene, start):
    motion = scene.task.motion.model_copy(update={"start": start})
    return Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion})))


def crowded(scene, count=22, diameter=0.75):
    """The scene with a ring of seven pipes and one of the others, from floor to dome."""
    rings = [(7, 4.0, 0.0), (count - 7, 8.4, 0.2)]
    places = [(r, first + 2 * np.pi * i / n) for n, r, first in rings for i in range(n)]
    pipes = tuple(
        Equipment(name=f"alc_{k}", diameter=diameter, radius=r, azimuth=a, bottom=0.5)
        for k, (r, a) in enumerate(places)
    )
    return dataclasses.replace(scene, tank=scene.tank.model_copy(update={"equipment": pipes}))


def test_lengths_and_inputs_of_a_posture_start_in_it(reach_scene):
    site = Site(reach_scene)
    lengths = tuple(site.chain.lengths(site.start).tolist())
    by_lengths = with_start(reach_scene, StartPosture(lengths=lengths)).start
    assert np.abs(by_lengths - site.start).max() < ROUNDING
    by_inputs = with_start(reach_scene, StartPosture(inputs=tuple(site.start.tolist()))).start
    assert by_inputs.tobytes() == site.start.tobytes()


@pytest.mark.parametrize(("key", "count"), [("lengths", 14), ("inputs", 16)])
def test_another_number_of_figures_is_refused(reach_scene, key, count):
    with pytest.raises(DescriptionError, match=f"{count} figures; allowed: 15 figures, one for each") as caught:
        _ = with_start(reach_scene, StartPosture.model_validate({key: [0.9] * count})).start
    assert caught.value.key == f"motion.start.{key}"


def test_a_tool_pose_is_solved_clear_of_everything(reach_scene):
    goal = reach_scene.task.motion.goals[0]
    site = with_start(reach_scene, StartPosture(position=goal.position, direction=goal.direction))
    tool, direction = site.chain.tool(site.start)
    assert np.abs(tool - goal.position).max() < ON_GOAL
    assert np.abs(direction - goal.direction).max() < ON_GOAL
    assert site.surroundings.least(site.start)[0] >= site.clearance


def test_stowed_is_the_stowed_posture_off_the_ends_of_strokes(reach_scene):
    site = with_start(reach_scene, "stowed")
    lengths = site.chain.lengths(site.start)
    assert np.all(site.box.spare(lengths) > 0)
    assert np.abs(lengths - site.arm.stowed_length).max() < site.task.motion.stroke_margin


@pytest.mark.parametrize("name", ["type_ii_reach", "arm9_nullspace", "arm30_shape"])
def test_a_start_is_found_between_many_pipes(name):
    site = with_start(crowded(load_scene(name)), None)
    assert site.surroundings.least(site.start)[0] >= site.clearance
    assert np.all(site.box.spare(site.chain.lengths(site.start)) > 0)
    again = with_start(crowded(load_scene(name)), None)
    assert site.start.tobytes() == again.start.tobytes()


def test_where_nothing_is_clear_the_best_is_given(reach_scene):
    site = with_start(reach_scene, None)
    q, tried = search_start(site.box, Keep(site.surroundings, 3.0), np.zeros(3))
    assert tried > 1000
    assert site.surroundings.least(q)[0] < 3.0


def test_the_file_that_ik_saves_is_a_start(reach_scene, tmp_path):
    site = Site(reach_scene)
    (tmp_path / "ik.json").write_text(json.dumps({"q": site.start.tolist()}))
    file = tmp_path / "scene.toml"
    file.write_text('base = "type_ii_reach"\n[motion]\nstart = "ik.json"\n')
    assert load_site(file).start.tobytes() == site.start.tobytes()
    file.write_text('base = "type_ii_reach"\n[motion]\nstart = "ik.jsn"\n')
    with pytest.raises(DescriptionError, match=r"motion\.start.*'ik\.jsn'.*stowed"):
        load_site(file)
    (tmp_path / "ik.jsn").write_text("{}")
    with pytest.raises(DescriptionError, match=r"ik\.jsn.*no inputs"):
        load_site(file)
