"""Tours and tool paths of an arm whose octahedra have static longerons: these keep their length everywhere on the way."""

from __future__ import annotations

import numpy as np
import pytest
from static_longerons import STATIC, make_static_scene

from vgtsim.planning import plan_tour
from vgtsim.planning.timing import make_limits
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

KEPT = 1e-9  # m: rounding of static longerons
GOAL = 2e-9  # m: each row is met to 1e-9


@pytest.fixture(scope="module")
def site():
    return Site(make_static_scene())


@pytest.fixture(scope="module")
def tour(site):
    return plan_tour(site)


def test_static_longerons_keep_their_length_on_the_whole_way(site, tour):
    """From the nodes, which follow from the commanded lengths by the forward solution; and these are the planned inputs."""
    truss = site.truss
    static = [i for i, member in enumerate(truss.members) if member.name[:2] in STATIC and member.role == "longeron"]
    assert len(static) == 5
    wanted = site.arm.modules[0].straight
    for leg in tour.legs:
        q = site.chain.inputs_from_lengths(leg.lengths)
        assert np.abs(truss.lengths(site.chain.nodes(q))[:, static] - wanted).max() < KEPT
        assert np.abs(q[-1] - leg.q).max() < KEPT
        assert np.ptp(leg.lengths, axis=0).max() > 0.02
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
