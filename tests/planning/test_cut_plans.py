"""Steps that cut: refused with figures where they cannot, planned over what is left by those before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from digging import CLEAR, DEPTH, TOOL, over_waste

from vgtsim.description import CuttingTool, Patch
from vgtsim.description.mission import CutStep
from vgtsim.errors import DescriptionError
from vgtsim.planning.cutting import check_cuts, foresee_waste, plan_cut
from vgtsim.site import Site


@pytest.fixture(scope="module")
def scene(reach_scene):
    return over_waste(reach_scene)


def edit(scene, *, tank=(), patch=(), step=(), **task):
    """The scene with other figures of waste, patch and step that cuts, and other entries of the task."""
    place, last = scene.task.patches[0].model_copy(update=dict(patch)), scene.task.mission[-1]
    steps = *scene.task.mission[:-1], last.model_copy(update=dict(step))
    changed = {"patches": (place,), "mission": steps} | task
    waste = scene.tank.waste.model_copy(update=dict(tank))
    return dataclasses.replace(
        scene, task=scene.task.model_copy(update=changed), tank=scene.tank.model_copy(update={"waste": waste})
    )


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"tool": None}, "mission.2.do", r"cut without a tool.*\[tool\]"),
        ({"tank": {"level": 0.0}}, "tank.waste.level", "no waste"),
        ({"tank": {"grid": None}}, "tank.waste.grid", "nothing.*0.2 m"),
        ({"tank": {"grid": 0.25}}, "tank.waste.grid", "0.25 m.*0.2 m"),
        ({"step": {"patch": "hete"}}, "mission.2.patch", "'hete'.*did you mean 'here'"),
    ],
)
def test_scene_that_cannot_cut_is_refused(scene, changes, key, words):
    with pytest.raises(DescriptionError, match=words) as caught:
        edit(scene, **changes)
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"step": {"depth": 5.0}}, "mission.2.depth", r"5 m, deeper than the waste: 2\.\d+ m of it"),
        ({"step": {"depth": 0.3}}, "mission.2.depth", r"reaches 0.45 m.*at most 0\.\d+ m"),
        ({"patch": {"corner": (-11.3, 0.0)}}, "mission.2.patch", r"here, which comes to 11.\d+ m.*at most 11.2"),
        ({"tank": {"strength": 5e8}}, "mission.2.depth", "mm/s"),
    ],
)
def test_patch_that_cannot_be_cut_is_refused(scene, changes, key, words):
    site = Site(edit(scene, **changes))
    with pytest.raises(DescriptionError, match=words) as caught:
        check_cuts(site)
    assert caught.value.key == key


def test_layers_are_counted_one_after_the_other(scene):
    layers = round(float(scene.tank.waste.level) / DEPTH) + 2
    steps = (*scene.task.mission[:-1], *[scene.task.mission[-1]] * layers)
    deep = dataclasses.replace(scene, task=scene.task.model_copy(update={"mission": steps}))
    site = Site(deep)
    with pytest.raises(DescriptionError, match="deeper than the waste") as caught:
        check_cuts(site)
    under = np.linalg.norm(site.diggings.places - np.add(scene.task.patches[0].corner, 0.1), axis=1) < 0.2
    most = int((scene.tank.waste.level - site.diggings.floor[under].max()) / DEPTH)
    assert caught.value.key == f"mission.{2 + most}.depth"


def test_rows_are_as_high_and_as_fast_as_the_layer_asks_for(scene):
    site = Site(scene)
    plan = plan_cut(site, 2, scene.task.mission[-1], site.diggings.start)
    assert plan.height == pytest.approx(scene.tank.waste.level + CLEAR)
    assert plan.speed * 0.2 * DEPTH == pytest.approx(site.diggings.rate)  # rows 0.2 m apart
    lengths, share = plan.add_rests(np.ones((7, 3)), 0.02)
    assert len(lengths) == len(share) == 7 + 2 * round(TOOL.ramp / 0.02)
    assert share[0] == share[-1] == 0
    assert share.max() == 1
    assert np.abs(np.diff(share)).max() < 2 * 0.02 / TOOL.ramp


def test_steps_after_a_cut_know_what_it_leaves(scene):
    site = Site(scene)
    plan = plan_cut(site, 2, scene.task.mission[-1], site.diggings.start)
    (x, y), z = plan.patch.corner, plan.height
    points = np.stack([np.linspace(x, x + 0.2, 2000), np.full(2000, y), np.full(2000, z)], axis=-1)
    left = foresee_waste(site, points, np.ones(2000), 0.02, site.diggings.start)
    volume = float(site.diggings.removed(left))
    assert 0 < volume <= site.diggings.rate * 0.02 * 1999 * (1 + 1e-12)
    assert left.min() == pytest.approx(plan.bottom)
    chain, later = site.chain, site.lower_waste(left)
    assert later.chain is chain
    ball = np.array([[x + 0.1, y, z]])
    before, after = (s.surroundings.obstacles.bed.distance(ball)[0][0] for s in (site, later))
    assert (before, after) == pytest.approx((CLEAR, TOOL.reach), abs=1e-9)
    again = plan_cut(later, 2, scene.task.mission[-1], left)
    assert again.bottom == pytest.approx(plan.bottom)  # the rim that the first row left is the highest place


def test_rate_is_that_of_power_or_of_the_inlet(scene):
    waste = scene.tank.waste
    assert TOOL.push == pytest.approx(3.15e-4 * np.sqrt(2 * 1000 * 3.8e8))
    soft, hard, liquid = (waste.model_copy(update={"strength": value}) for value in (1e5, 1e7, None))
    assert TOOL.rate_in(soft) == TOOL.rate_in(liquid) == TOOL.removal
    assert TOOL.rate_in(hard) == pytest.approx(3.8e8 * 3.15e-4 / (100 * 1e7))
    head = TOOL.model_dump() | {"kind": "scarifier", "pressure": None, "flow": None, "power": 5e3, "reaction": 800.0}
    mill = CuttingTool(**head)
    assert mill.push == 800
    assert mill.rate_in(hard) == pytest.approx(5e3 / (100 * 1e7))


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"power": 1.0}, "no power: a jet has pressure and flow"), ({"flow": None}, "flow: a jet has pressure and flow")],
)
def test_tool_has_the_figures_of_its_kind(changes, words):
    with pytest.raises(ValueError, match=words):
        CuttingTool(**(TOOL.model_dump() | changes))


def test_patch_spans_an_area():
    with pytest.raises(ValueError, match="span an area"):
        Patch(name="line", corner=(0, 0), along=(1, 0), across=(2, 0))


def test_a_step_that_cuts_needs_a_goal_before(scene):
    steps = (scene.task.mission[0], CutStep(do="cut", patch="here", depth=DEPTH, rows=2))
    with pytest.raises(DescriptionError, match="cut from where the insertion ends"):
        dataclasses.replace(scene, task=scene.task.model_copy(update={"mission": steps}))


def test_a_cut_whose_direction_is_free_needs_no_goal_before(scene):
    steps = (scene.task.mission[0], CutStep(do="cut", patch="here", depth=DEPTH, rows=2, direction="free"))
    changed = dataclasses.replace(scene, task=scene.task.model_copy(update={"mission": steps}))
    assert changed.task.stages[-1].name == "cut"
