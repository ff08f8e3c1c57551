"""A withdrawal for which no way back is found: the arm goes back as it came."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import hoist
from scipy.spatial.distance import cdist

import vgtsim
from vgtsim.description import cut_arm
from vgtsim.description.mission import InsertStep, MoveStep, WithdrawStep
from vgtsim.description.tank import Equipment
from vgtsim.errors import PathError
from vgtsim.log import Revision
from vgtsim.planning import mission, revise_tour
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.insertion import follow_directrix
from vgtsim.planning.timing import make_limits
from vgtsim.site import Site

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def case():
    """Two modules of the nine-actuator arm that come in, go to a goal and on to another, and leave; and their way in."""
    base = vgtsim.load("arm9_nullspace").scene
    base = dataclasses.replace(base, manipulator=cut_arm(base.manipulator, 2), task=_rest(base.task))
    base = hoist(base, acceleration=0.5)
    site = Site(base)
    way = follow_directrix(site, make_directrix(5.9, [(6.0, 1 / 6.0)]), np.radians(-10.0))
    mould, goals = base.task.motion.goals[0], []
    for name, aside in (("one", 0.05), ("two", 0.1)):
        q = way.ends[1].copy()
        q[1::3] += aside  # both modules lean aside
        position, direction = (item.tolist() for item in site.chain.tool(q))
        update = {"name": name, "position": tuple(position), "direction": tuple(direction), "at": None}
        goals.append(mould.model_copy(update=update))
    steps = (
        InsertStep(do="insert"),
        *(MoveStep(do="move", goal=goal.name) for goal in goals),
        WithdrawStep(do="withdraw"),
    )
    motion = base.task.motion.model_copy(update={"goals": tuple(goals), "acceleration": 0.2})
    task = base.task.model_copy(update={"motion": motion, "mission": steps})
    return Site(dataclasses.replace(base, task=task)), way


def _rest(task):
    return task.model_copy(update={"motion": task.motion.model_copy(update={"start": None}), "contacts": ()})


def test_it_goes_back_as_it_came(case, monkeypatch):
    site, way = case
    find = mission.plan_path

    def fail(corridor, first, last, leg, carousel):
        if leg == "the way out":
            raise PathError(leg, 0.01, "a wall")
        return find(corridor, first, last, leg, carousel)

    monkeypatch.setattr(mission, "plan_path", fail)
    tour = mission.plan_mission(site, way)
    _, one, two, back = tour.legs
    assert back.feed is not None
    came = np.concatenate([one.lengths, two.lengths])
    home = int(np.argmax(back.feed > 0)) - 1  # the last instant before the mast is lifted
    step = np.abs(np.diff(came, axis=0)).sum(axis=1).max()
    assert cdist(back.lengths[:home], came).min(axis=1).max() < step
    assert back.lengths[home] == pytest.approx(one.lengths[0], abs=1e-9)
    assert np.ptp(back.lengths[:home], axis=0).max() > 0.01
    limits = site.task.motion
    assert (
        np.abs(np.diff(back.lengths[:home], axis=0)).max() / tour.timestep
        < 1.002 * make_limits(site.chain, limits.rate_fraction, 1.0).rate.max()
    )


def test_it_is_refused_where_the_arm_did_not_come_from_the_way_in(case, monkeypatch):
    site, way = case
    plan = mission.MissionPlan(site=site, here=way.ends[1], height=0.0, way=way)
    monkeypatch.setattr(
        mission, "plan_path", lambda *_: (_ for _ in ()).throw(PathError("the way out", 0.01, "a wall"))
    )
    plan.here = way.ends[1] + 0.01
    with pytest.raises(PathError, match="a wall"):
        plan.add(site.task.mission[-1])


@pytest.fixture(scope="module")
def tour(case):
    return mission.plan_mission(*case)


def _add_pole(site, **place):
    pole = Equipment(**{"name": "pole", "diameter": 0.1, "appears": 1.0} | place)
    tank = site.tank.model_copy(update={"equipment": (*site.tank.equipment, pole)})
    return Site(dataclasses.replace(site.scene, tank=tank))


def _halfway(leg):
    """Row at which the mast is halfway on the way through the riser."""
    return int(np.argmin(np.abs(leg.feed - (leg.feed[0] + leg.feed[-1]) / 2)))


@pytest.mark.parametrize("index", [0, -1])
def test_a_way_through_the_riser_that_is_clear_goes_on(case, tour, index):
    site = _add_pole(case[0], radius=8.0, azimuth=np.radians(170.0), top=0.5)
    index, leg = range(len(tour.legs))[index], tour.legs[index]
    row = _halfway(leg)
    revised = revise_tour(site, tour, Revision(1.0, index, row))
    again = revised.legs[index]
    assert (revised.blocked, len(revised.legs)) == ("", len(tour.legs))
    np.testing.assert_allclose(again.feed[:row], leg.feed[:row], atol=1e-12)
    np.testing.assert_allclose(again.lengths[-1], leg.lengths[-1], atol=1e-9)
    assert again.feed[-1] == pytest.approx(leg.feed[-1], abs=1e-9)
    drive = site.task.mast.feed
    assert np.abs(np.diff(again.feed, n=2)).max() / tour.timestep**2 <= 1.01 * drive.acceleration
    assert np.abs(np.diff(again.feed)).max() <= 1.001 * np.abs(np.diff(leg.feed)).max()
    scattered = [np.column_stack([item.lengths, item.feed]) for item in (again, leg)]
    assert cdist(*scattered).min(axis=1).max() < np.abs(np.diff(scattered[1], axis=0)).sum(axis=1).max()
    assert again.leader is leg.leader


def test_an_arm_in_the_riser_goes_back_and_comes_in_another_way(case, tour, monkeypatch):
    base, _ = case
    x, y, _ = base.chain.tool(case[1].ends[1])[0]
    site = _add_pole(base, radius=float(np.hypot(x, y)), azimuth=float(np.arctan2(y, x)) % (2 * np.pi), top=7.0)
    steps = base.task.mission[:1]
    site = Site(dataclasses.replace(site.scene, task=site.task.model_copy(update={"mission": steps})))
    tour = dataclasses.replace(tour, legs=tour.legs[:1])
    leg, revision = tour.legs[0], Revision(1.0, 0, _halfway(tour.legs[0]))
    other = follow_directrix(site, make_directrix(5.9, [(6.0, 1 / 6.0)]), np.radians(170.0))
    monkeypatch.setattr(mission, "plan_insertion", lambda site: other)
    revised = revise_tour(site, tour, revision)
    again = revised.legs[0]
    assert revised.blocked == ""
    top = int(np.argmax(again.feed[revision.row :])) + revision.row
    assert again.feed[top] == pytest.approx(leg.feed[0], abs=1e-9)
    np.testing.assert_allclose(again.q, other.ends[1], atol=1e-12)
    assert again.feed[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(np.diff(again.lengths, axis=0)).max() <= 1.01 * max(np.abs(np.diff(leg.lengths, axis=0)).max(), 0.01)
    blocked = PathError("the end of the insertion", 0.02, "pole")
    monkeypatch.setattr(mission, "plan_insertion", lambda site: (_ for _ in ()).throw(blocked))
    ended = revise_tour(site, tour, revision)
    assert "pole" in ended.blocked
    assert ended.legs[0].feed[-1] == pytest.approx(ended.legs[0].feed[-2], abs=1e-12)  # it stands in the riser
