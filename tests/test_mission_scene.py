"""A whole mission: the arm comes through the riser, works and leaves, in one run that passes every check."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import vgtsim
from vgtsim.description.mission import FollowStep
from vgtsim.planning.entry import Entry
from vgtsim.planning.timing import make_limits
from vgtsim.site import Site
from vgtsim.verification import Evidence, hoist, tracking

INSERTION_S = 90.0  # s, at rated speeds of cylinders and hoist


@pytest.mark.slow
def test_the_arm_comes_in_works_and_leaves():
    site = vgtsim.load("type_ii_mission")
    plan = vgtsim.plan(site)
    way_in, way_out = plan.legs[0], plan.legs[-1]
    assert way_in.feed is not None
    assert way_out.feed is not None
    assert [leg.name for leg in plan.legs] == [stage.name for stage in site.task.stages]
    assert len(way_in.lengths) * plan.timestep < INSERTION_S
    tool = site.chain.tool(site.chain.stowed)[0] + [0.0, 0.0, way_in.feed[0]]
    flange = site.tank.grade + site.tank.arm_riser.above_grade
    assert tool[2] > flange  # it begins above ground
    assert way_out.feed[-1] == pytest.approx(way_in.feed[0], abs=1e-9)
    assert way_in.feed[-1] == way_out.feed[0] == 0
    log = vgtsim.run(site, plan)
    report = vgtsim.verify(site, log, plan)
    assert [check.quantity for check in report.checks if not check.passed] == []
    bore = next(check for check in report.checks if check.quantity == "least distance from the riser")
    inside = np.flatnonzero(log.height > 0.0)[::50]
    q = site.chain.inputs_from_lengths(log.actual[inside])
    assert bore.measured <= Entry(site).gaps(q, log.height[inside]).bore.min() + 1e-9
    assert find_leader_row(report).measured == pytest.approx(1.0, abs=1e-3)
    assert way_in.leader is not None
    turned = replace(
        way_in.leader, level=np.array([[0.9994, -0.0349, 0], [0.0349, 0.9994, 0], [0, 0, 1]]) @ way_in.leader.level
    )
    other = replace(plan, legs=(replace(way_in, leader=turned), *plan.legs[1:]))  # in a plane 2 degrees aside
    assert hoist.check_leader(Evidence(site, log, other)).value > site.task.limits.leader


def find_leader_row(report):
    return next(check for check in report.checks if check.quantity.startswith("axis from the leader"))


@pytest.mark.slow
def test_the_tool_follows_a_path_with_its_hose():
    site = vgtsim.load("type_ii_raster")
    plan = vgtsim.plan(site)
    assert [leg.name for leg in plan.legs] == ["to waste_raster", "waste_raster"]
    log = vgtsim.run(site, plan)
    report = vgtsim.verify(site, log, plan)
    assert [check.quantity for check in report.checks if not check.passed] == []
    # another path, 2 mm deeper, is not the one that the tool followed
    step = site.task.mission[0]
    assert isinstance(step, FollowStep)
    x, y, z = step.path.start
    deeper = step.path.model_copy(update={"start": (x, y, z - 0.002)})
    task = site.task.model_copy(update={"mission": (step.model_copy(update={"path": deeper}),)})
    other = Site(replace(site.scene, task=task))
    distance, _ = tracking.check_path
    assert distance.find(Evidence(site, log)).value < task.limits.tracking_position
    assert distance.find(Evidence(other, log)).value > task.limits.tracking_position


@pytest.mark.slow
def test_a_heel_is_cut():
    site = vgtsim.load("type_ii_heel")
    plan = vgtsim.plan(site)
    most = make_limits(site.chain, site.task.motion.rate_fraction, site.task.motion.acceleration).jerk
    for leg in plan.legs:
        jerk = np.abs(np.diff(leg.lengths, n=3, axis=0)) / plan.timestep**3
        assert np.max(jerk / most) < 1.02  # differences over a step against a fine grid
    log = vgtsim.run(site, plan)
    report = vgtsim.verify(site, log, plan)
    assert [check.quantity for check in report.checks if not check.passed] == []
    ground, (x, y) = site.diggings, np.mean(site.task.patches[0].corners, axis=0)
    layer = ground.start - log.bed[-1]
    under = np.linalg.norm(ground.places - [x, y], axis=1) < ground.bed.spacing
    assert layer[under] == pytest.approx(site.task.mission[-2].depth, abs=1e-3)  # the middle is cut to the bottom
    assert log.removed[-1] <= ground.rate * (log.tool_share > 0).sum() / site.task.simulation.log_rate
