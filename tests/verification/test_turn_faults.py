"""A fault in a mast that turns, or in the log of its turn, is caught by the row that is there for it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, climb, shorten, slew
from turn_faults import TURN_LOG_FAULTS, TURN_MODEL_FAULTS

from vgtsim.kinematics import move_points
from vgtsim.mjcf import build_model
from vgtsim.planning import Leg, Tour
from vgtsim.plant import run
from vgtsim.site import Site, load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

WAY, ANGLE = 2.4, 0.2  # s and rad
POSES = (([0.5, 0.3], [0.4, 0.9]), ([0.53, 0.28], [0.43, 0.85]))  # bends and azimuths, rad


@pytest.fixture(scope="module")
def played():
    """Site, tour and log of two modules that go to one goal while the mast turns."""
    scene = slew(change(shorten(load_site("arm9_nullspace").scene, 2), log_rate=25.0))
    chain, motion = Site(scene).chain, scene.task.motion
    start, end = (bend(scene, *pose) for pose in POSES)
    position, direction = chain.tool(end)
    base = chain.mount[:3, 3]
    near, far = move_points(chain, np.array([position, position + direction]), turn=ANGLE)
    goal = motion.goals[0].model_copy(update={"position": tuple(near), "direction": tuple(far - near)})
    assert np.linalg.norm(near - base) == pytest.approx(np.linalg.norm(position - base))
    new = {"goals": (goal,), "hold": 0.4, "acceleration": 0.1, "settle_speed": 1e-8, "patience": 1.0}
    task = scene.task.model_copy(update={"motion": motion.model_copy(update=new)})
    site = Site(dataclasses.replace(scene, task=task))
    s = climb(1.0, WAY, site.timestep)
    lengths = chain.lengths(start + s[:, None] * (end - start))
    leg = Leg(name="goal", goal=0, lengths=lengths, q=end, clearance=1.0, place="nothing", turn=ANGLE * s)
    tour = Tour(start, (leg,), site.timestep)
    return site, tour, run(site, tour)


def judge(fault, site, log, tour):
    report = verify(site, log, tour)
    failed = {check.quantity: check.measured for check in report.checks if not check.passed}
    assert bool(fault.caught) is not bool(fault.reason)
    assert (fault.caught in failed) if fault.caught else report.passed, failed


def test_run_without_a_fault_passes(played):
    site, tour, log = played
    report = verify(site, log, tour)
    assert report.passed, [(check.quantity, check.measured) for check in report.checks if not check.passed]


@pytest.mark.parametrize("fault", TURN_LOG_FAULTS, ids=lambda fault: fault.what)
def test_fault_in_the_log(played, fault):
    site, tour, log = played
    judge(fault, site, fault.spoil(log), tour)


@pytest.mark.parametrize("fault", TURN_MODEL_FAULTS, ids=lambda fault: fault.what)
def test_fault_in_the_model(played, fault):
    site, tour, _ = played
    model = build_model(site)
    fault.spoil(model)
    judge(fault, site, run(site, tour, model), tour)
