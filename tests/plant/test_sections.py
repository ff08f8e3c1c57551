"""The arm with rigid sections held against the arm whose members are bodies, and what it catches and refuses."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from offset_arms import with_offset
from playing import bend, change, shorten

from vgtsim.errors import DescriptionError
from vgtsim.kinematics import find_rigid_sections, sample_inputs
from vgtsim.log import ARRAYS
from vgtsim.mjcf import build_model, make_section_pose
from vgtsim.planning import Leg, Tour
from vgtsim.plant import Plant, run
from vgtsim.site import Site, load_arm
from vgtsim.verification import verify

STEP = 0.02  # s
SAME_PLACE = 1e-5  # m between the two models
SAME_FORCE = 1e-4  # of the largest force
STOPS = 3e-5  # of the largest force, at a stop between two records; derivatives would be off by a third of it
LOOPS = 1e-7  # m: length errors when accelerations jump at every second step


@pytest.fixture(scope="module")
def scene(reach_scene):
    return change(shorten(reach_scene, 2), members="sections", timestep=STEP, log_rate=25.0)


@pytest.fixture(scope="module")
def site(scene):
    return Site(scene)


@pytest.fixture(scope="module")
def tour(scene, site):
    """From one bent pose to another in 4 s."""
    start, end = bend(scene, [0.2, 0.25], [0.0, 1.0]), bend(scene, [0.35, 0.1], [0.6, 2.0])
    s = np.linspace(0, 1, round(4 / STEP) + 1)[:, None]
    lengths = site.chain.lengths(start + s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3) * (end - start))
    return Tour(start, (Leg("goal", 0, lengths, end, 1.0, "nothing"),), STEP)


@pytest.fixture(scope="module")
def logs(scene, site, tour):
    full = Site(change(scene, members="rigid"))
    return run(site, tour), run(full, tour)


@pytest.mark.parametrize("name", ["arm9", "arm15", "arm30", "arm60", "stewart"])
def test_sections_are_the_static_modules_with_the_tip_plate(name):
    """A static module between two active ones is one body, and its members are no rows."""
    chain = load_arm(name)
    sections, truss = find_rigid_sections(chain), chain.truss
    active = {truss.members[i].module for i in truss.actuated}
    static = [i for i, member in enumerate(truss.members) if member.module not in active]
    assert not set(static) & set(sections.rows.tolist())
    assert set(truss.actuated.tolist()) <= set(sections.rows.tolist())
    assert (sections.of_node[truss.base] == 0).all()
    assert (sections.of_node[truss.tip] == sections.count - 1).all()
    moving = sections.count - 1  # rows hold exactly the freedoms of free hubs and moving sections
    assert len(sections.rows) == 3 * np.sum(sections.of_node < 0) + 6 * moving


def test_a_pose_is_stood_in(site):
    """Hubs of the model stand where kinematics puts them, at any inputs."""
    model, chain = build_model(site), site.chain
    data, pose = mujoco.MjData(model), make_section_pose(model, chain)
    for q in sample_inputs(chain, 5, seed=1):
        pose.fill(chain.nodes(q), data.qpos)
        mujoco.mj_kinematics(model, data)
        for i, node in enumerate(chain.truss.nodes):
            assert data.site(node).xpos == pytest.approx(chain.nodes(q)[i], abs=1e-12)
        R = data.body("tip").xmat.reshape(3, 3)
        assert R[:, 2] == pytest.approx(chain.tool(q)[1], abs=1e-12)


def test_mass_of_arm_and_mast(site):
    model = build_model(site)
    assert model.body_mass.sum() == pytest.approx(site.load_model.mass + site.mast.mass, rel=1e-12)


def test_the_tool_goes_where_that_of_the_full_model_goes(logs):
    sections, full = logs
    assert len(sections.time) == len(full.time)
    assert np.abs(sections.nodes - full.nodes).max() < SAME_PLACE
    assert np.abs(sections.tool_position - full.tool_position).max() < SAME_PLACE
    assert np.abs(sections.tool_direction - full.tool_direction).max() < SAME_PLACE


def test_forces_are_those_of_the_full_model(logs):
    """Those of the rows, measured; those inside sections, from statics; at rest and in motion."""
    sections, full = logs
    largest = np.linalg.norm(full.member_force, axis=-1).max()
    assert np.abs(sections.member_force - full.member_force).max() < SAME_FORCE * largest
    assert np.abs(sections.actuator_force - full.actuator_force).max() < SAME_FORCE * largest
    off = np.abs(sections.mast_reaction - full.mast_reaction)
    assert off.max() < SAME_FORCE * np.abs(full.mast_reaction).max()


def test_the_report_says_that_sections_were_simulated(site, logs):
    checks = {check.quantity: check for check in verify(site, logs[0]).checks}
    assert "static modules" in checks["moment of a length row, which has none"].detail
    assert checks["error at rest over largest force"].passed
    assert checks["gap between member end and hub"].measured < LOOPS


def test_a_weight_that_is_wrong_shows_in_the_forces(site, tour):
    """Forces are those of MuJoCo, however they are completed: a tool that is a per cent too heavy fails."""
    model = build_model(site)
    model.body("tip").mass *= 1.01
    checks = {check.quantity: check for check in verify(site, run(site, tour, model)).checks}
    for row in ("error at rest over largest force", "mast reaction error at rest over the reaction"):
        assert not checks[row].passed, row


def test_forces_of_records_two_steps_apart_are_those_of_every_step(scene):
    """A stop at full deceleration falls between records, which derivatives through seven of them would smear."""
    site = Site(scene)
    start, end = (site.chain.lengths(bend(scene, [0.2, angle], [0.0, 1.0])) for angle in (0.25, 0.27))
    logs = []
    for rate in (1 / STEP, 0.5 / STEP):
        plant = Plant(site, record_rate=rate)
        plant.reset(start)
        for share in [*np.linspace(0, 1, 31)[1:] ** 2, *[1.0] * 30]:
            plant.command(start + share * (end - start))
            plant.step()
        logs.append(plant.log)
    every, second = (log.axial(site.truss.ends) for log in logs)
    assert "acceleration" not in {name for name in ARRAYS if getattr(logs[1], name).size}
    assert np.abs(every[::2] - second).max() < STOPS * np.abs(every).max()


def test_lengths_hold_when_accelerations_jump(site):
    rng = np.random.default_rng(3)
    plant = Plant(site, timestep=STEP, record_rate=1 / STEP)
    lengths = plant.reset().commanded
    speed = wanted = np.zeros(len(lengths))
    for step in range(100):
        if step % 5 == 0:
            wanted = rng.uniform(-0.02, 0.02, len(speed))
        speed = speed + np.clip(wanted - speed, -0.002, 0.002)
        lengths = lengths + speed * STEP
        plant.command(lengths)
        plant.step()
    log = plant.log
    assert np.linalg.norm(log.ends - log.nodes[:, site.truss.ends], axis=-1).max() < LOOPS
    assert np.abs(log.actual - log.commanded).max() < LOOPS
    state = plant.state
    assert state.lengths == pytest.approx(lengths, abs=LOOPS)
    assert state.rates == pytest.approx(speed, abs=2 * LOOPS / STEP)


def test_a_collision_stops_it_where_it_stops_the_full_model(scene, tour):
    """The tool goes down, into waste that is raised half the way."""
    chain, leg = Site(scene).chain, tour.legs[0]
    high, low = chain.tool(leg.q)[0][2], chain.tool(tour.start)[0][2]
    down = Tour(leg.q, (dataclasses.replace(leg, lengths=leg.lengths[::-1].copy(), q=tour.start),), STEP)
    waste = scene.tank.waste.model_copy(update={"level": (low + high) / 2 - scene.task.payload.radius})
    flooded = dataclasses.replace(scene, tank=scene.tank.model_copy(update={"waste": waste}))
    logs = [run(Site(change(flooded, members=members)), down) for members in ("sections", "rigid")]
    assert all("waste" in log.stopped and "payload" in log.stopped for log in logs)
    assert logs[0].contact_time[0] == pytest.approx(logs[1].contact_time[0], abs=2 * STEP)


def test_a_collision_right_after_the_start_is_seen(scene, tour):
    """Full speed from rest towards waste 20 mm below: nothing that was measured at rest may keep it from being seen."""
    chain, leg = Site(scene).chain, tour.legs[0]
    level = chain.tool(leg.q)[0][2] - scene.task.payload.radius - 0.02
    waste = scene.tank.waste.model_copy(update={"level": level})
    flooded = dataclasses.replace(scene, tank=scene.tank.model_copy(update={"waste": waste}))
    way = leg.lengths[0] - leg.lengths[-1]
    times = []
    for members in ("sections", "rigid"):
        plant = Plant(Site(change(flooded, members=members)))
        plant.reset(leg.lengths[-1], leg.q)
        plant.command(rates=0.1 * way / np.abs(way).max())
        while not plant.stopped and plant.time < 2:
            plant.step()
        times.append(plant.time)
    assert times[1] < 0.2
    assert times[0] == pytest.approx(times[1], abs=2 * STEP)


@pytest.mark.parametrize(("name", "words"), [("tetra4", "hinge"), ("mixed", "hinge")])
def test_arms_with_hinges_are_refused(name, words):
    with pytest.raises(DescriptionError, match=words):
        find_rigid_sections(load_arm(name))


def test_joint_offsets_are_refused(scene):
    arm = with_offset(scene.manipulator)
    with pytest.raises(DescriptionError, match="joint offset"):
        build_model(Site(dataclasses.replace(scene, manipulator=arm)))


def test_other_drives_are_refused(scene):
    simulation = scene.task.simulation.model_dump() | {"drive": "servo"}
    with pytest.raises(ValueError, match='drive = "rigid" with members = "sections"'):
        type(scene.task.simulation).model_validate(simulation)
