"""Assembly on site: the part that stands does not move when the next module is set on it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydantic import TypeAdapter

import vgtsim
from vgtsim.description import Clamp, Feed, cut_arm, list_phases
from vgtsim.description.mission import MissionStep
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.entry import check_entry
from vgtsim.planning.insertion import follow_directrix
from vgtsim.planning.mission import plan_mission
from vgtsim.planning.phases import cut_way, plan_phases, plan_site

pytestmark = pytest.mark.long
HOIST = Feed(stroke=9.0, rate=0.3, acceleration=0.1, force=8e4)
ADD, WITHDRAW = {"do": "add_module", "time": 5.0}, {"do": "withdraw"}


def change(site, *, headroom=12.0, hoist=HOIST, mission=()):
    base = site.scene
    mast = base.task.mast.model_copy(update={"feed": hoist})
    steps = TypeAdapter(tuple[MissionStep, ...]).validate_python(mission)
    tank = base.tank.model_copy(update={"headroom": headroom, "clamp": Clamp(name="jaws", above_flange=0.3)})
    task = base.task.model_copy(update={"mast": mast, "mission": steps})
    return vgtsim.Site(replace(base, task=task, tank=tank))


@pytest.fixture(scope="module")
def site():
    return change(vgtsim.load("arm9_nullspace"), mission=(ADD, ADD, ADD, WITHDRAW))


@pytest.fixture(scope="module")
def way(site):
    return follow_directrix(site, make_directrix(5.9, [(8.0, 1 / 4.6)]), np.radians(-170.0))


@pytest.fixture(scope="module")
def parts(site):
    return [vgtsim.Site(scene) for scene in list_phases(site.scene)[:3]]


def nodes_at(part, way, place):
    """Nodes of a part of the arm somewhere on its own way, from its own chain."""
    return part.chain.nodes(way.spline(place)) + [0.0, 0.0, float(way.feed(place))]


def test_part_is_the_end_of_the_arm(site):
    arm = site.arm
    part = cut_arm(arm, 2)
    assert part.modules == arm.modules[2:]
    assert len(part.active) == len(arm.active) - 1
    whole = site.chain.nodes(site.chain.stowed)
    top = site.chain.frames(site.chain.stowed)[1][2, 2]
    alone = Chain(part, hanging_mount(top))
    np.testing.assert_allclose(alone.nodes(alone.stowed), whole[-len(alone.truss.nodes) :], atol=1e-12)


def test_lower_part_stands_still_at_every_hand_over(site, way, parts):
    ways = cut_way(site, way)
    for below, above in pairwise(zip(parts, ways, strict=True)):
        before, after = nodes_at(*below, 1.0), nodes_at(*above, 0.0)
        np.testing.assert_allclose(after[-len(before) :], before, atol=1e-9)
        assert len(after) > len(before)
        top = before[below[0].truss.base, 2]
        np.testing.assert_allclose(top, site.tank.clamp_height, atol=1e-9)


def test_ways_of_parts_are_the_way_of_the_whole_arm(site, way, parts):
    first, last = (float(way.feed(place)) for place in (0.0, 1.0))
    for part, own in zip(parts, cut_way(site, way), strict=True):
        for place in np.linspace(0.0, 1.0, 7):
            found = nodes_at(part, own, place)
            sunk = site.chain.nodes(site.chain.stowed)[-len(found), 2] - site.scene.pivot_height
            feed = float(own.feed(place)) - sunk
            if last <= feed <= first:
                q = way.spline((feed - first) / (last - first))
                whole = site.chain.nodes(q) + [0.0, 0.0, feed]
                np.testing.assert_allclose(found, whole[-len(found) :], atol=1e-7)  # of the splines between their knots
    assert float(own.feed(1.0)) == pytest.approx(0.0, abs=1e-9)


def test_phases_begin_where_the_one_before_ended(site, way, parts):
    ways = cut_way(site, way)
    tours = [plan_mission(part, own) for part, own in zip(parts, ways, strict=True)]
    for below, above in pairwise(tours):
        held = below.legs[-1]
        lengths = held.lengths[-1]
        np.testing.assert_allclose(above.legs[0].lengths[0][-len(lengths) :], lengths, atol=1e-12)
        assert np.ptp(held.feed) == 0
        assert np.ptp(held.lengths, axis=0).max() == 0
        assert len(held.lengths) == round(5.0 / below.timestep) + 1


def test_room_for_the_longest_module_with_the_mast_on_it(site, parts):
    depths = [part.scene.pivot_height - part.chain.tool(part.chain.stowed)[0][2] for part in parts]
    top = site.tank.clamp_height + max(np.diff([0.0, *depths]))
    least = top + site.mast.length - site.tank.grade
    with pytest.raises(DescriptionError, match=r"headroom: found 7 m, \d.\d+ m less than the longest module of arm9"):
        check_entry(change(site, headroom=7.0), grows=True)
    check_entry(change(site, headroom=least + 1e-6), grows=True)
    with pytest.raises(DescriptionError, match="headroom"):
        check_entry(change(site, headroom=least - 1e-6), grows=True)
    with pytest.raises(DescriptionError, match=r"mast.feed.stroke: found 8 m, 0.\d+ m less than the longest module"):
        check_entry(change(site, hoist=HOIST.model_copy(update={"stroke": 8.0})), grows=True)


def test_plans_of_phases_are_asked_for_as_such(site):
    with pytest.raises(DescriptionError, match="mission in 5 phases"):
        plan_site(site)
    with pytest.raises(DescriptionError, match="headroom"):
        plan_phases([vgtsim.Site(scene) for scene in list_phases(change(site, headroom=7.0, mission=(ADD,)).scene)])
