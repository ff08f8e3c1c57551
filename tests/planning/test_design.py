"""Demand of a scene: the tour with its inertia, postures beside it, and what passes the riser."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.catalogue import INCH, load_catalogue
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.planning import Leg, Tour
from vgtsim.planning.checks import RISER_SPARE, riser_fit
from vgtsim.planning.design import passing_sizes, sample_motion, sample_postures
from vgtsim.statics import motion_from_log

STEP = 0.005  # of the programme, s


@pytest.fixture(scope="module")
def program(hanging_arm):
    """One leg in which the first module bends and comes to rest, on a quintic."""
    part = np.linspace(0, 1, 401)
    way = 10 * part**3 - 15 * part**4 + 6 * part**5
    q = np.repeat(hanging_arm.straight[None], 401, axis=0)
    q[:, 0] += 0.15 * way
    q[:, 7] += 0.1 * way
    return Tour(q[0], (Leg("goal", 0, hanging_arm.lengths(q), q[-1], 1.0, "none"),), STEP)


def test_sampled_motion_is_that_of_a_log_of_every_step(hanging_arm, program, monkeypatch):
    monkeypatch.setattr("vgtsim.planning.design._SPACING", 0.05)
    nodes, motion = sample_motion(hanging_arm, program)
    lengths = program.legs[0].lengths
    every = hanging_arm.nodes(hanging_arm.inputs_from_lengths(lengths))
    log = motion_from_log(STEP * np.arange(len(lengths)), every)
    inner = slice(1, -1)  # at the ends the log's polynomials are one-sided
    assert nodes == pytest.approx(every[::10], abs=1e-12)
    speed, jerk = np.abs(log.velocity).max(), np.abs(log.acceleration).max()
    assert motion.velocity[inner] == pytest.approx(log.velocity[::10][inner], abs=1e-3 * speed)
    assert motion.acceleration[inner] == pytest.approx(log.acceleration[::10][inner], abs=1e-2 * jerk)
    assert np.abs(motion.velocity[[0, -1]]).max() < 1e-3 * speed


def test_postures_reach_out_all_round_inside_the_strokes(hanging_arm):
    nodes = sample_postures(hanging_arm)
    ends = hanging_arm.truss.ends[hanging_arm.truss.actuated]
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    low, high = hanging_arm.stroke
    assert np.all((length >= low - 1e-9) & (length <= high + 1e-9))
    tip = nodes[:, hanging_arm.truss.tip].mean(axis=1)
    far = tip[np.hypot(tip[:, 0], tip[:, 1]) > 11.0]
    around = np.sort(np.arctan2(far[:, 1], far[:, 0]))
    assert np.diff(around).max() < np.radians(16)
    assert np.array_equal(nodes, sample_postures(hanging_arm))


@pytest.mark.parametrize("name", ["mixed", "tetra4", "octahedron_general"])
def test_postures_of_arms_of_every_kind_are_inside_the_strokes(name):
    """By the nodes alone: actuators in their strokes, and every static longeron and tube as long as in the straight arm."""
    chain = Chain(load_manipulator(name), np.eye(4))
    nodes, truss = sample_postures(chain), chain.truss
    length, straight = truss.lengths(nodes), truss.lengths(chain.nodes(chain.straight))
    low, high = chain.stroke
    moving = length[:, truss.actuated]
    assert len(nodes) >= 1500
    assert np.all((moving >= low - 1e-9) & (moving <= high + 1e-9))
    assert np.all(np.ptp(moving, axis=0) > 0.9 * (high - low))
    rigid = np.setdiff1d(np.arange(len(truss.members)), truss.actuated)
    assert length[:, rigid] == pytest.approx(np.broadcast_to(straight[rigid], (len(nodes), len(rigid))), abs=1e-8)


def test_sizes_that_pass_the_riser_leave_its_spare_and_the_next_larger_does_not(hanging_arm, type_ii):
    catalogue, bore = load_catalogue(), type_ii.arm_riser.bore
    passing = passing_sizes(hanging_arm, catalogue, bore)
    widest = max(size.outer_diameter for size in passing.tubes)
    larger = min(size.outer_diameter for size in catalogue.tubes if size.outer_diameter > widest + 1e-9)
    for diameter, fits in ((widest, True), (larger, False)):
        arm = hanging_arm.manipulator
        tubes = {name: tube.model_copy(update={"outer_diameter": diameter}) for name, tube in arm.tubes.items()}
        chain = Chain(arm.model_copy(update={"tubes": tubes}), hanging_arm.mount)
        assert (riser_fit(chain, bore).spare >= RISER_SPARE) is fits
    # by hand: a longeron stands on the node circle of 18 in; 21 in of bore less 1.5 in of spare leaves 1.5 in
    assert widest == pytest.approx(3.0 * INCH)


def test_bore_that_nothing_passes_is_refused(hanging_arm):
    with pytest.raises(DescriptionError, match="none that leaves the stowed arm"):
        passing_sizes(hanging_arm, load_catalogue(), 0.9)


@pytest.mark.long
def test_shipped_arm_stands_every_posture_under_every_case(hanging_arm, reach_scene):
    """The postures beside the tour, by the envelope that the report uses; the tour itself is the reach scene's test."""
    from vgtsim.description.scene import LoadCase
    from vgtsim.statics import make_load_model, make_sections
    from vgtsim.statics.cases import find_envelope

    task = reach_scene.task
    chain = Chain(reach_scene.manipulator, hanging_arm.mount)
    model = make_load_model(chain, task.payload, task.simulation.gravity)
    section = make_sections(chain)
    cases = (LoadCase(name="run"), *task.loads)
    worst = find_envelope(model, section, sample_postures(chain), cases, task.limits.safety_factor)
    assert max(worst.strength.max(), worst.pressure.max()) < 1.0
    heavier = dataclasses.replace(model, payload=task.payload.model_copy(update={"mass": 1.6 * task.payload.mass}))
    more = find_envelope(heavier, section, sample_postures(chain), cases, task.limits.safety_factor)
    assert max(more.strength.max(), more.pressure.max()) > 1.0
