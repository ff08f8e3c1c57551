"""Tours of arms of every kind: octahedra with static longerons, which keep their length on the whole way, and general ones."""

from __future__ import annotations

import numpy as np
import pytest
from scenes_of_kinds import STATIC, make_general_scene, make_static_scene

from vgtsim.planning import plan_tour
from vgtsim.planning.path import plan_path
from vgtsim.planning.timing import make_limits
from vgtsim.planning.trajectory import Corridor
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

KEPT = 1e-9  # m: rounding of static longerons
GOAL = 2e-9  # m: each row is met to 1e-9


@pytest.fixture(scope="module", params=[make_static_scene, make_general_scene])
def site(request):
    return Site(request.param())


@pytest.fixture(scope="module")
def tour(site):
    return plan_tour(site)


def test_every_member_but_the_actuators_keeps_its_length_on_the_whole_way():
    """From the nodes of the planned inputs themselves, densely between way-points; and their rate is their derivative."""
    site = Site(make_static_scene())
    truss, near = site.truss, site.subspace.project(site.start[None] + 0.05 * np.cos(np.arange(18.0)))[0]
    static = [i for i, member in enumerate(truss.members) if member.name[:2] in STATIC and member.role == "longeron"]
    assert len(static) == 5
    rigid = np.setdiff1d(np.arange(len(truss.members)), truss.actuated)
    curve = plan_path(Corridor(site.box, site.surroundings, site.clearance), site.start, near, "near").curve
    part = np.linspace(0.01, 0.99, 457)
    lengths = truss.lengths(site.chain.nodes(curve(part)))
    straight = truss.lengths(site.chain.nodes(site.chain.straight))
    assert np.abs(lengths - straight)[:, rigid].max() < KEPT
    assert np.ptp(lengths[:, truss.actuated], axis=0).max() > 0.02
    differences = (curve(part + 1e-4) - curve(part - 1e-4)) / 2e-4
    assert np.abs(curve(part, 1) - differences).max() < 1e-3 * np.abs(differences).max()


def test_lengths_lead_back_to_the_planned_postures(site, tour):
    for leg in tour.legs:
        q = site.chain.inputs_from_lengths(leg.lengths[[0, -1]])
        assert np.abs(q[-1] - leg.q).max() < KEPT
        assert site.subspace.find_errors(q).max() < KEPT
        assert np.ptp(leg.lengths, axis=0).max() > 0.01
        assert site.box.spare(leg.lengths).min() > 0


def test_goals_are_met_within_rates_and_accelerations(site, tour):
    limits = make_limits(site.chain, site.task.motion.rate_fraction, site.task.motion.acceleration)
    for leg, goal in zip(tour.legs, site.task.motion.goals, strict=True):
        position, direction = site.chain.tool(leg.q)
        assert np.linalg.norm(position - goal.position) < GOAL
        assert np.linalg.norm(np.cross(direction, goal.direction)) < GOAL
        assert leg.clearance >= site.clearance
        rate = np.abs(np.diff(leg.lengths, axis=0)) / tour.timestep / limits.rate
        hard = np.abs(np.diff(leg.lengths, n=2, axis=0)) / tour.timestep**2 / limits.acceleration
        assert max(rate.max(), hard.max()) <= 1.01
        assert max(rate.max(), hard.max()) > 0.9


@pytest.mark.slow
def test_the_tour_passes_every_check(site, tour):
    report = verify(site, run(site, tour))
    assert report.passed, [check for check in report.checks if not check.passed]
