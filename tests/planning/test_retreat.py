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
from vgtsim.errors import PathError
from vgtsim.planning import mission
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
    plan = mission._Plan(site, way.ends[1], 0.0, way)
    monkeypatch.setattr(
        mission, "plan_path", lambda *_: (_ for _ in ()).throw(PathError("the way out", 0.01, "a wall"))
    )
    plan.here = way.ends[1] + 0.01
    with pytest.raises(PathError, match="a wall"):
        plan.add(site.task.mission[-1])
