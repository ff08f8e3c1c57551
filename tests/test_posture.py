"""The questions about an arm in one posture or in many."""

from __future__ import annotations

import numpy as np
import pytest

import vgtsim
from vgtsim.errors import DescriptionError, ReachError

STEP = 1e-6  # of an input, for central differences
DIFFERENCE = 1e-7  # error of central differences of that step on an arm of 10 m


@pytest.fixture(scope="module")
def arm():
    return vgtsim.load_arm("arm9")


@pytest.fixture(scope="module")
def bent(arm):
    return arm.straight + np.random.default_rng(3).uniform(-0.05, 0.05, (4, *arm.straight.shape))


def test_lengths_lead_back_to_the_posture(arm, bent):
    posture = vgtsim.forward_kinematics(arm, bent)
    again = vgtsim.forward_kinematics(arm, lengths=posture.lengths)
    assert again.q == pytest.approx(bent, abs=1e-9)
    assert again.tool == pytest.approx(posture.tool, abs=1e-8)
    assert posture.nodes.shape == (4, len(arm.truss.nodes), 3)
    assert posture.lengths.shape == (4, arm.layout.actuators)


def test_the_straight_posture_comes_without_inputs(arm):
    posture = vgtsim.forward_kinematics(arm)
    assert posture.q == pytest.approx(arm.straight)
    assert posture.direction == pytest.approx([0, 0, -1])


def test_the_jacobian_is_the_slope_of_the_tool(arm, bent):
    moved = [vgtsim.forward_kinematics(arm, bent[:, None] + side * STEP * np.eye(bent.shape[-1])) for side in (1, -1)]
    slope = (moved[0].tool - moved[1].tool) / (2 * STEP)
    assert np.swapaxes(vgtsim.jacobian(arm, bent)[:, :3], 1, 2) == pytest.approx(slope, abs=DIFFERENCE)


def test_a_goal_is_met_inside_the_strokes(arm):
    posture = vgtsim.solve_goal(arm, (4.5, 0, -8.4), (0.7, 0, -0.7))
    assert posture.tool == pytest.approx([4.5, 0, -8.4], abs=1e-6)
    assert posture.direction == pytest.approx(np.array([1, 0, -1]) / np.sqrt(2), abs=1e-6)
    low, high = arm.stroke
    assert np.all((posture.lengths > low) & (posture.lengths < high))


@pytest.mark.long
def test_what_cannot_be_is_named(arm):
    with pytest.raises(ReachError):
        vgtsim.solve_goal(arm, (40, 0, 0), (1, 0, 0))
    with pytest.raises(DescriptionError, match="mid_stroke"):
        vgtsim.solve_goal(arm, (4.5, 0, -8.4), (0.7, 0, -0.7), objective="mid_strok")


def test_the_mast_carries_the_weight(arm, bent):
    """And each kilogram of payload adds its weight to the reaction."""
    empty, loaded = (vgtsim.member_forces(arm, bent, payload=mass) for mass in (None, 100.0))
    assert loaded.reaction[:, 2] - empty.reaction[:, 2] == pytest.approx(100 * 9.80665)
    assert empty.bar.shape == (4, len(arm.truss.member_names))


def test_a_site_gives_its_arm_and_its_payload(reach_scene):
    site = vgtsim.Site(reach_scene)
    height = vgtsim.forward_kinematics(site).nodes[:3, 2]
    assert height == pytest.approx(reach_scene.pivot_height)
    heavy = vgtsim.member_forces(site, site.start).reaction[2]
    light = vgtsim.member_forces(site, site.start, payload=0.0).reaction[2]
    assert heavy - light == pytest.approx(reach_scene.task.payload.mass * reach_scene.task.simulation.gravity)
