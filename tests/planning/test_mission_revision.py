"""Something appears while the mast turns, the tool follows a path or cuts; for rows and moves see `test_appearances`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from digging import over_waste
from playing import change, shorten, slew

import vgtsim
from vgtsim.description.mission import MoveStep
from vgtsim.description.tank import Equipment
from vgtsim.log import Revision
from vgtsim.planning import plan_site, revise_as_run
from vgtsim.planning.replanning import revise_tour
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import verify
from vgtsim.verification.evidence import Evidence
from vgtsim.verification.record import check_revisions

pytestmark = pytest.mark.long
ANGLE = 0.9  # rad
ASIDE = {"radius": 10.5, "azimuth": 1.0, "top": 2.0}  # out of every way


plan_once = cache(plan_site)  # of a site that several tests interrupt


def interrupt(site, leg, part, **place):
    """The site with a pole that appears at a part of a leg of its mission, that mission, and the appearance."""
    tour = plan_once(site)
    row = int(part * len(tour.legs[leg].lengths))
    when = (sum(len(one.lengths) for one in tour.legs[:leg]) + row) * tour.timestep
    pole = Equipment(**{"name": "pole", "diameter": 0.1, "appears": when} | ASIDE | place)
    tank = site.tank.model_copy(update={"equipment": (*site.tank.equipment, pole)})
    return Site(replace(site.scene, tank=tank)), tour, Revision(when, leg, row)


@pytest.fixture(scope="module")
def turning(reach_scene):
    """Two modules that come to a goal by a turn of the mast alone."""
    scene = slew(change(shorten(reach_scene, 2), timestep=0.02, log_rate=50.0), rate=0.2, acceleration=0.1)
    site = Site(scene)
    (x, y, z), (u, v, w) = site.chain.tool(site.start)
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    here = {"name": "near", "position": (x, y, z), "direction": (u, v, w)}
    there = {
        "name": "aside",
        "position": (c * x - s * y, s * x + c * y, z),
        "direction": (c * u - s * v, s * u + c * v, w),
    }
    goals = tuple(scene.task.motion.goals[0].model_copy(update=pose) for pose in (here, there))
    motion = scene.task.motion.model_copy(update={"goals": goals, "settle_speed": 1e-8})
    steps = MoveStep(do="move", goal="near"), MoveStep(do="move", goal="aside", turn=ANGLE)
    return Site(replace(scene, task=scene.task.model_copy(update={"motion": motion, "mission": steps})))


def test_a_turn_stops_and_goes_on(turning):
    site, before, told = interrupt(turning, 1, 0.4)
    log = run(site, before)
    tour = revise_as_run(site, before, log.revisions)
    assert [(item.time, item.leg) for item in log.revisions] == [(told.time, told.leg)]
    assert [row for row in verify(site, log, tour).checks if not row.passed] == []
    stopped = np.flatnonzero((np.diff(log.turn_commanded) == 0) & (log.time[1:] > told.time))
    assert 0.1 < log.turn_commanded[stopped[0]] < ANGLE - 0.1  # it stands on its way
    assert log.turn[-1] == pytest.approx(ANGLE, abs=1e-7)


def test_a_turn_that_is_shut_is_not_made(turning):
    tool = turning.chain.tool(turning.start)[0]
    shut = {"radius": float(np.hypot(*tool[:2])), "azimuth": float(np.arctan2(tool[1], tool[0])) + 0.8, "top": 6.0}
    site, before, told = interrupt(turning, 1, 0.4, **shut)
    tour = revise_tour(site, before, told)
    assert "no way on" in tour.blocked
    assert "pole" in tour.blocked
    assert tour.legs[-1].turn[-1] < 0.8


@pytest.fixture(scope="module")
def raster():
    return vgtsim.load("type_ii_raster")


@pytest.mark.parametrize(("leg", "part"), [(0, 0.5), (1, 0.3)])
def test_a_followed_path_goes_on_where_it_was(raster, leg, part):
    site, before, told = interrupt(raster, leg, part)
    tour = revise_tour(site, before, told)
    rows = np.concatenate([one.lengths for one in tour.legs])
    assert not tour.blocked
    assert np.abs(np.diff(rows, n=2, axis=0)).max() <= site.task.motion.acceleration * tour.timestep**2
    np.testing.assert_array_equal(tour.legs[1].lengths[-1], before.legs[1].lengths[-1])
    now, then = (
        site.chain.tool(site.chain.inputs_from_lengths(one.legs[1].lengths[::20]))[0] for one in (tour, before)
    )
    apart = np.linalg.norm(now[:, None] - then, axis=2).min(axis=1)
    assert apart.max() < 0.5 * np.linalg.norm(np.diff(then, axis=0), axis=1).max() + 1e-6  # no tool is beside the path


def test_a_cut_goes_on_and_an_appearance_between_two_records_is_judged(reach_scene):
    """Records are 40 ms apart and steps 20: no record lies between this appearance and the new plan."""
    scene = over_waste(reach_scene, timestep=0.02)
    task = scene.task.model_copy(update={"mission": scene.task.mission[1:], "mast": hold(scene.task.mast)})
    site, before, told = interrupt(Site(replace(scene, task=task)), 1, 0.5)
    assert round(told.time / 0.02) % 2 == 1
    log = run(site, before)
    tour = revise_as_run(site, before, log.revisions)
    assert not tour.blocked
    assert check_revisions(Evidence(site, log, tour)).value == 0
    assert check_revisions(Evidence(site, replace(log, revisions=()), tour)).value == 1
    assert log.tool_share[log.time > told.time].min() == 0.0
    assert log.tool_share[log.time > told.time + 3.0].max() == 1.0  # it came up again
    assert log.removed[-1] > 1.5 * log.removed[np.searchsorted(log.time, told.time)]


def hold(mast):
    """A mast that stays at its working depth."""
    return mast.model_copy(update={"feed": None})
