"""Faults in runs of other kinds are caught: sections, elastic members, an operator, a leaning tool."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from other_faults import CONTACT_FAULTS, CONTROLLER_FAULTS, ELASTIC_FAULTS, OPERATION_FAULTS, SECTION_FAULTS
from playing import bend, change, climb, shorten
from spoiling import each, failed, judge, run_spoilt_model

from vgtsim.control import rehearse
from vgtsim.description import AllowedContact, Operator, OperatorCommand
from vgtsim.description.waste import Mound
from vgtsim.planning import Leg, Tour
from vgtsim.plant import Plant, operate, run
from vgtsim.site import Site, load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

STEP = 0.02  # s
COMMANDS = (
    OperatorCommand(time=0.1, twist=(0.03, 0.02, -0.04, 0, 0, 0)),
    OperatorCommand(time=1.0, twist=(-0.05, 0, 0.02, 0, 0.02, 0)),
    OperatorCommand(time=1.5, hold=True),
)
DEEP = 0.05  # m that the tool goes down, most of them in the air
LEANING = 1e-2  # of the largest force, in motion and with knocks


@pytest.fixture(scope="module")
def two():
    """Two modules of the nine-actuator arm."""
    return shorten(load_site("arm9_nullspace").scene, 2)


def run_leg(scene, start, end, **motion):
    """Site, tour and clean report of one leg between two bends, in a second."""
    site = Site(scene)
    start, end = bend(scene, *start), bend(scene, *end)
    lengths = site.chain.lengths(start + climb(1.0, 2.4, site.timestep)[:, None] * (end - start))
    position, direction = site.chain.tool(end)
    goal = site.task.motion.goals[0].model_copy(update={"position": tuple(position), "direction": tuple(direction)})
    changed = site.task.motion.model_copy(update={"goals": (goal,), "acceleration": 0.1, **motion})
    site = Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": changed})))
    leg = Leg(name=goal.name, goal=0, lengths=lengths, q=end, clearance=1.0, place="nothing")
    tour = Tour(start, (leg,), site.timestep)
    report = verify(site, run(site, tour), tour)
    assert report.passed, failed(report)
    return site, tour, report


@pytest.fixture(scope="module")
def sections(two):
    scene = change(two, members="sections", timestep=STEP, log_rate=25.0)
    return run_leg(scene, ([0.5, 0.3], [0.4, 0.9]), ([0.53, 0.28], [0.43, 0.85]), settle_speed=1e-8)


@each(SECTION_FAULTS)
def test_fault_in_the_model_of_rigid_sections(sections, fault):
    site, tour, clean = sections
    judge(fault, verify(site, run_spoilt_model(fault, site, tour), tour), clean)


@pytest.fixture(scope="module")
def elastic():
    """One module of the elastic arm, which bends a little and settles."""
    scene = change(shorten(load_site("type_ii_elastic").scene, 1), log_rate=50.0)
    return run_leg(scene, ([0.3], [0.2]), ([0.35], [0.4]), hold=0.6)


@each(ELASTIC_FAULTS)
def test_fault_in_the_description_of_an_elastic_arm(elastic, fault):
    site, tour, clean = elastic
    judge(fault, verify(site, run(fault.spoil(site), tour), tour), clean)


@pytest.fixture(scope="module")
def operation(two):
    scene = change(two, timestep=STEP, log_rate=1 / STEP)
    motion = scene.task.motion.model_copy(update={"goals": ()})
    task = scene.task.model_copy(update={"motion": motion, "operator": Operator()})
    site = Site(dataclasses.replace(scene, task=task, commands=COMMANDS))
    log = operate(site)
    report = verify(site, log, rehearse(site, log))
    assert report.passed, failed(report)
    return site, log, report


@each(CONTROLLER_FAULTS)
def test_fault_in_the_controller(operation, fault):
    site, _, clean = operation
    log = operate(fault.spoil(site))
    judge(fault, verify(site, log, rehearse(site, log)), clean)


@each(OPERATION_FAULTS)
def test_fault_in_the_log_of_an_operator(operation, fault):
    site, log, clean = operation
    spoilt = fault.spoil(log)
    judge(fault, verify(site, spoilt, rehearse(site, spoilt)), clean)


@pytest.fixture(scope="module")
def leaning():
    """The nine-actuator arm lowers its tool onto a mound of waste, and stays there."""
    scene = change(load_site("arm9_nullspace").scene, drive="servo", timestep=0.01, log_rate=25.0)
    chain, q = Site(scene).chain, bend(scene, [0.7, 0.4, -0.3], [0.0, 0.0, 0.0])
    x, y, z = chain.tool(q)[0]
    mound = Mound(radius=float(np.hypot(x, y)), azimuth=float(np.arctan2(y, x)), height=0.2, foot=1.5)
    level = float(z) - scene.task.payload.radius - DEEP - mound.height
    waste = scene.tank.waste.model_copy(update={"level": level, "mounds": (mound,)})
    limits = scene.task.limits.model_copy(update={"axial_force_moving": LEANING})
    rule = AllowedContact(part="tool", place="waste", force=2e5)
    task = scene.task.model_copy(update={"contacts": (rule,), "limits": limits})
    scene = dataclasses.replace(scene, task=task, tank=scene.tank.model_copy(update={"waste": waste}))
    site = Site(scene)
    plant = Plant(site)
    plant.reset(inputs=q)
    down = q.copy()
    for _ in range(8):
        place = chain.tool(down)[0]
        slope = (chain.tool(down + 1e-6 * np.eye(len(q)))[0] - place).T / 1e-6
        down = down + np.linalg.pinv(slope) @ ([x, y, z - DEEP - 0.02] - place)
    first, last = chain.lengths(q), chain.lengths(down)
    for s in climb(1.0, 2.0, plant.timestep):
        plant.command(first + s * (last - first))
        plant.step()
    plant.step(round(0.4 / plant.timestep))
    log = plant.log
    assert not plant.stopped
    assert np.linalg.norm(log.contact_force, axis=1).max() > 3e3
    return site, log, verify(site, log)


@each(CONTACT_FAULTS)
def test_fault_in_the_log_of_a_leaning_tool(leaning, fault):
    site, log, clean = leaning
    judge(fault, verify(site, fault.spoil(log)), clean)
