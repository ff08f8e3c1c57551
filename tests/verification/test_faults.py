"""A fault in the model, the run or the log is caught by the row that is there for it, or lies below the limits."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from fault_page import PAGE, PARTS, write_page
from faults import LOG_FAULTS, MODEL_FAULTS, RUN_FAULTS
from playing import bend, change, hoist, shorten
from spoiling import each, failed, judge, run_spoilt_model, run_spoilt_plant

from vgtsim.description.conveyance import Conveyance
from vgtsim.planning import Leg, Tour
from vgtsim.plant import run
from vgtsim.site import Site, load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

HOLD, WAY = 0.4, 2.4  # s
HOSE = Conveyance(diameter=0.13, bore=0.1, mass=4.0, contents=1300.0, bend_radius=0.5, bending_stiffness=2000.0)
LIFT = 0.05  # m: up on the way to the first goal, down on the way to the second


@pytest.fixture(scope="module")
def program(site):
    """From rest to rest twice, each on a smooth step of the seventh order in the inputs."""
    step, legs = site.timestep, []
    stations = [bend(site.scene, *pose) for pose in POSES]
    s = np.linspace(0, 1, round(WAY / step) + 1)[:, None]
    s = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
    for goal, (first, last) in enumerate(pairwise(stations)):
        lengths, feed = site.chain.lengths(first + s * (last - first)), LIFT * (goal + s[:, 0] * (1 - 2 * goal))
        name = f"goal_{goal}"
        legs.append(Leg(name=name, goal=goal, lengths=lengths, q=last, clearance=1.0, place="nothing", feed=feed))
    return Tour(stations[0], tuple(legs), step)


POSES = (([0.5, 0.3], [0.4, 0.9]), ([0.53, 0.28], [0.43, 0.85]), ([0.5, 0.31], [0.5, 0.9]))  # bends and azimuths, rad


@pytest.fixture(scope="module")
def site():
    """Two modules of the nine-actuator arm with 1000 lb and a hose of 4 in, asked for the two poses that it is moved to."""
    scene = hoist(change(shorten(load_site("arm9_nullspace").scene, 2), log_rate=25.0))
    chain, motion, goals = Site(scene).chain, scene.task.motion, []
    for index, pose in enumerate(POSES[1:]):
        position, direction = chain.tool(bend(scene, *pose))
        position = position + [0.0, 0.0, LIFT * (1 - index)]
        new = {"name": f"goal_{index}", "position": tuple(position), "direction": tuple(direction)}
        goals.append(motion.goals[0].model_copy(update=new))
    motion = motion.model_copy(
        update={"goals": tuple(goals), "hold": HOLD, "acceleration": 0.1, "settle_speed": 1e-8, "patience": 1.0}
    )
    return Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion, "conveyance": HOSE})))


@pytest.fixture(scope="module")
def log(site, program):
    return run(site, program)


@pytest.fixture(scope="module")
def clean(site, program, log):
    return verify(site, log, program)


def test_run_without_a_fault_passes(clean):
    assert clean.passed, failed(clean)


@each(LOG_FAULTS)
def test_fault_in_the_log(site, program, log, clean, fault):
    judge(fault, verify(site, fault.spoil(log), program), clean)


@each(MODEL_FAULTS)
def test_fault_in_the_model(site, program, clean, fault):
    judge(fault, verify(site, run_spoilt_model(fault, site, program), program), clean)


@each(RUN_FAULTS)
def test_fault_in_the_run(site, program, clean, monkeypatch, fault):
    judge(fault, verify(site, run_spoilt_plant(fault, site, program, monkeypatch), program), clean)


def test_every_fault_has_its_line_in_the_docs():
    assert PAGE.read_text() == write_page(), f"python {PAGE.parents[1]}/tests/verification/fault_page.py writes it"
    names = [(where, fault.what) for where, each in PARTS for fault in each]
    assert len(set(names)) == len(names) >= 40
