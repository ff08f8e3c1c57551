"""The elastic arm: it sags, rings and decays as the stiffness and eigenvalue solves say, with its loops closed."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from finite_elements import settle_with_pynite
from offset_arms import with_offset
from playing import bend, change, out_of_the_tank, play, shorten

from vgtsim.errors import DescriptionError
from vgtsim.mjcf import build_spec, finish_model, qpos_from_nodes
from vgtsim.plant.addresses import find_addresses
from vgtsim.plant.hydraulics import FLOW
from vgtsim.plant.springs import fit_springs
from vgtsim.site import Site
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.modes import find_modes
from vgtsim.statics.stiffness import deflect, node_loads, settle, tool_point
from vgtsim.verification import Evidence, drives, members, shape

SAG = 5e-3  # of the greatest deflection: against another program, and what a linear solve leaves of a small sag
SETTLED = 1e-6  # m: against equilibrium at the deformed pose
FREQUENCY = 0.02  # of each of the six slowest modes
QUICK = 15.0  # Hz: from here on a step of 2 ms is too long, for its own error grows with the square of the frequency
DECAY = 0.1  # of the damping ratio set
CLOSURE = 1e-6  # m
POSES = {
    "horizontal": ([np.pi / 6] * 3, [0.0] * 3),
    "bent": ([0.3, 0.6, -0.4], [2.0] * 3),
    "hanging": ([0.0] * 3, [0.0] * 3),
}


@pytest.fixture(scope="module")
def scene(reach_scene):
    """Three modules of the elastic arm in free air, with time to come to rest."""
    reach_scene = shorten(reach_scene, 3)
    motion = reach_scene.task.motion.model_copy(update={"settle_speed": 1e-6, "patience": 9.0, "hold": 0.1})
    free = dataclasses.replace(reach_scene, task=reach_scene.task.model_copy(update={"motion": motion}))
    return change(free, members="elastic", timestep=2e-3, log_rate=100.0, damping_ratio=0.2)


def elastic_of(scene):
    return make_elastic_model(Site(scene).chain, scene.task.payload, scene.task.simulation.gravity)


def with_payload(scene, mass):
    payload = scene.task.payload.model_copy(update={"mass": mass})
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"payload": payload}))


@pytest.mark.long
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("mass", [0.0, 453.6])
def test_arm_sags_as_the_stiffness_solve_says(scene, pose, mass):
    scene = with_payload(scene, mass)
    q, chain = bend(scene, *POSES[pose]), Site(scene).chain
    log = play(scene, q, q, 0.1, out_of_the_tank)
    nodes = chain.nodes(q)
    assert log.settled.any()
    model = elastic_of(scene)
    assert np.abs(log.nodes[-1] - settle(model, nodes)).max() < SETTLED
    assert shape.check_closure(Evidence(Site(scene), log)).value < CLOSURE
    weight = node_loads(elastic_of(with_payload(scene, 0.0)), nodes)
    pull = [0.0, 0.0, -mass * scene.task.simulation.gravity]
    tool = tool_point(model.loads, nodes)
    frame = settle_with_pynite(chain.truss, nodes, model.stiffness_at(nodes), weight, tool, pull)
    sag = log.nodes[-1] - nodes
    assert np.abs(frame[:-1] - nodes - sag).max() < SAG * np.abs(sag).max()


@pytest.fixture(scope="module")
def offset(scene):
    """The same with joint blocks in the middle of every module."""
    return dataclasses.replace(scene, manipulator=with_offset(scene.manipulator))


@pytest.mark.long
@pytest.mark.parametrize("pose", ["bent"])
def test_arm_with_joint_blocks_sags_as_the_stiffness_solve_says(offset, pose):
    q, chain = bend(offset, *POSES[pose]), Site(offset).chain
    log = play(offset, q, q, 0.1, out_of_the_tank)
    assert log.settled.any()
    nodes = settle(elastic_of(offset), chain.nodes(q))
    assert np.abs(log.nodes[-1] - nodes).max() < SETTLED
    assert np.abs(nodes - chain.nodes(q)).max() > 0.02
    assert shape.check_closure(Evidence(Site(offset), log)).value < CLOSURE


@pytest.mark.long
@pytest.mark.parametrize("mode", [1, 3])
def test_arm_with_joint_blocks_rings_at_its_natural_frequencies(offset, mode):
    still = change(offset, damping_ratio=0.0)
    q, model = bend(still, *POSES["horizontal"]), elastic_of(still)
    rest = settle(model, Site(still).chain.nodes(q))
    modes = find_modes(model, rest, 6)
    push = modes.nodes[mode] * (2e-3 / np.abs(modes.nodes[mode]).max())
    along = np.einsum("tnk,nk->t", ring(still, q, rest + push, 4.5 / modes.frequency[mode]) - rest, push)
    times = crossings(along, still.task.simulation.timestep)
    assert len(times) >= 3
    assert (len(times) - 1) / (times[-1] - times[0]) == pytest.approx(modes.frequency[mode], rel=FREQUENCY)


@pytest.mark.long
def test_sag_under_a_tenth_of_gravity_is_the_linear_one(scene):
    light = change(scene, gravity=0.980665)
    q, chain = bend(scene, *POSES["bent"]), Site(scene).chain
    log, nodes = play(light, q, q, 0.1, out_of_the_tank), chain.nodes(q)
    sag, linear = (log.nodes[-1] - nodes)[-3:].mean(axis=0), deflect(elastic_of(light), nodes).nodes[-3:].mean(axis=0)
    assert np.linalg.norm(sag - linear) < SAG * np.linalg.norm(linear)


def ring(scene, q, displaced, seconds):
    """Node positions at every step after a release from displaced nodes, shape (T, N, 3)."""
    spec = build_spec(Site(scene))
    out_of_the_tank(spec)
    model = finish_model(spec, Site(scene))
    data, chain = mujoco.MjData(model), Site(scene).chain
    springs = fit_springs(model, data, Site(scene), chain.nodes(q))
    springs.command(chain.lengths(q), np.zeros(len(springs.joints)))
    data.qpos[:] = qpos_from_nodes(model, chain.truss, displaced)
    sites, history = find_addresses(model, chain.truss).nodes, []
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        history.append(data.site_xpos[sites])
    return np.array(history)


def crossings(signal, step):
    """Times at which a signal passes zero upward, s."""
    up = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    return (up - signal[up] / (signal[up + 1] - signal[up])) * step


@pytest.fixture(scope="module")
def horizontal(scene):
    scene = change(scene, damping_ratio=0.0)
    q, model = bend(scene, *POSES["horizontal"]), elastic_of(scene)
    rest = settle(model, Site(scene).chain.nodes(q))
    return scene, q, rest, find_modes(model, rest, 6)


@pytest.mark.long
@pytest.mark.parametrize("mode", range(6))
def test_free_vibration_has_the_natural_frequencies(horizontal, mode):
    scene, q, rest, modes = horizontal
    if modes.frequency[mode] > QUICK:
        scene = change(scene, timestep=1e-3)
    push = modes.nodes[mode] * (2e-3 / np.abs(modes.nodes[mode]).max())
    history = ring(scene, q, rest + push, 4.5 / modes.frequency[mode])
    along = np.einsum("tnk,nk->t", history - rest, push)
    times = crossings(along, scene.task.simulation.timestep)
    assert len(times) >= 3
    found = (len(times) - 1) / (times[-1] - times[0])
    assert found == pytest.approx(modes.frequency[mode], rel=FREQUENCY)


@pytest.mark.long
@pytest.mark.parametrize("ratio", [0.01, 0.05])
def test_first_mode_decays_with_the_damping_ratio_set(horizontal, ratio):
    scene, q, rest, modes = horizontal
    damped = change(scene, damping_ratio=ratio)
    push = modes.nodes[0] * (5e-3 / np.abs(modes.nodes[0]).max())
    history = ring(damped, q, rest + push, 5.2 / modes.frequency[0])
    along = np.einsum("tnk,nk->t", history - rest, push)
    inner = np.flatnonzero((along[1:-1] > along[:-2]) & (along[1:-1] >= along[2:]) & (along[1:-1] > 0)) + 1
    decrement = np.log(along[inner[0]] / along[inner[-1]]) / (len(inner) - 1)
    assert decrement / (2 * np.pi) == pytest.approx(ratio, rel=DECAY)


def energy(scene, q, history):
    """Kinetic, spring and potential energy along a history, J: from the project's statics, none of it MuJoCo's."""
    from vgtsim.statics.modes import mass_matrix

    model, chain = elastic_of(scene), Site(scene).chain
    nodes, step = chain.nodes(q), scene.task.simulation.timestep
    rest, spring = lengths(chain, nodes), model.stiffness_at(nodes)
    stored = 0.5 * np.sum(spring * (lengths(chain, history[1:-1]) - rest) ** 2, axis=-1)
    rate = (history[2:] - history[:-2]) / (2 * step)
    tip = rate[:, chain.truss.tip]
    lever = history[1:-1, chain.truss.tip] - history[1:-1, chain.truss.tip].mean(axis=1, keepdims=True)
    turn = np.einsum("tnj,tnk->tjk", lever, tip)
    spread = np.einsum("tnj,tnk->tjk", lever, lever)
    inertia = np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3) - spread
    moment = np.stack([turn[:, 1, 2] - turn[:, 2, 1], turn[:, 2, 0] - turn[:, 0, 2], turn[:, 0, 1] - turn[:, 1, 0]], 1)
    spin = np.linalg.solve(inertia, moment[..., None])[..., 0]
    free = rate[:, 3:-3].reshape(len(rate), -1)
    speed = np.concatenate([free, tip.mean(axis=1), spin], axis=1)
    kinetic = np.array(
        [0.5 * v @ mass_matrix(model, n) @ v for v, n in zip(speed[::20], history[1:-1:20], strict=True)]
    )
    weight = np.array([potential(model, n) for n in history[1:-1:20]])
    return kinetic + stored[::20] + weight


def lengths(chain, nodes):
    ends = chain.truss.ends
    return np.linalg.norm(nodes[..., ends[:, 1], :] - nodes[..., ends[:, 0], :], axis=-1)


def potential(model, nodes):
    """Weight times height, J; each member's weight at the height its moments give."""
    truss, part = model.truss, model.loads.members
    first, second = nodes[truss.ends].swapaxes(0, 1)
    unit = (second - first) / np.linalg.norm(second - first, axis=-1, keepdims=True)
    g = -model.loads.gravity[2]
    members = part.mass[:, 0] * first[:, 2] + part.first_moment[:, 0] * unit[:, 2]
    members = members + part.mass[:, 1] * second[:, 2] - part.first_moment[:, 1] * unit[:, 2]
    corner = nodes[truss.tip]
    normal = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    tool = corner.mean(axis=0) + model.loads.tool_offset * normal / np.linalg.norm(normal)
    rest = model.loads.hub_mass @ nodes[:, 2] + model.loads.plate.mass * corner[:, 2].mean()
    return g * (members.sum() + rest + model.loads.payload.mass * tool[2])


@pytest.mark.long
def test_undamped_energy_drift_is_the_integrators_and_halves_with_the_step(horizontal):
    """Setting 0 leaves half a step of damping: the first mode loses 2 pi omega dt / 2 of its energy a period."""
    scene, q, rest, modes = horizontal
    push = modes.nodes[0] * (20e-3 / np.abs(modes.nodes[0]).max())
    omega, lost = 2 * np.pi * modes.frequency[0], []
    model = elastic_of(scene)
    base = potential(model, rest) + 0.5 * np.sum(
        model.stiffness_at(Site(scene).chain.nodes(q))
        * (lengths(Site(scene).chain, rest) - lengths(Site(scene).chain, Site(scene).chain.nodes(q))) ** 2
    )
    for step in (4e-3, 2e-3):
        now = change(scene, timestep=step, log_rate=1 / step)
        history = ring(now, q, rest + push, 2 / modes.frequency[0])
        above = energy(now, q, history) - base
        ratio = -np.polyfit(np.arange(len(above)) * 20 * step, np.log(above), 1)[0] / (2 * omega)
        lost.append(ratio)
        assert ratio == pytest.approx(omega * step / 4, rel=0.15)
    assert lost[0] / lost[1] == pytest.approx(2.0, rel=0.1)


@pytest.mark.long
def test_members_of_a_moving_elastic_arm_carry_axial_force_alone(scene):
    scene = change(scene, damping_ratio=0.5)  # comes to rest within the patience
    start, end = bend(scene, *POSES["horizontal"]), bend(scene, [0.5, 0.45, 0.5], [0.1] * 3)
    log = play(scene, start, end, 2.0, out_of_the_tank)
    found = Evidence(Site(scene), log)
    assert members.check_moment(found).value < 1e-6
    assert members.check_shear(found).value < 1e-2
    assert members.check_axial_moving(found).value < 1e-2
    assert members.check_axial_settled(found).value < 1e-6
    assert shape.check_closure(found).value < CLOSURE
    assert shape.check_settled_shape(found).value < 1e-5


@pytest.mark.long
def test_settled_shape_of_a_softened_member_is_found_out(scene):
    """One tube with half its stiffness: the shape is no longer the description's."""
    scene = change(scene, damping_ratio=0.5)

    def soften(spec):
        out_of_the_tank(spec)
        spec.joint("s2/longeron/1/slide").stiffness[0] *= 0.5

    q = bend(scene, *POSES["horizontal"])
    log = play(scene, q, q, 0.1, soften)
    assert shape.check_settled_shape(Evidence(Site(scene), log)).value > 1e-4


def test_damping_below_what_the_step_holds_is_refused_with_the_least(scene):
    few = change(scene, damping_ratio=1e-4)
    q = bend(few, *POSES["horizontal"])
    with pytest.raises(DescriptionError, match=r"damping_ratio.*at least 0\.00"):
        play(few, q, q, 0.1, out_of_the_tank)


@pytest.mark.long
def test_hydraulic_arm_holds_its_lengths_against_the_load(scene):
    """Valves take up what the oil gives; the lengths come to their command within the lock's band."""
    oil = change(scene, drive="hydraulic", valve_gain=2.0, damping_ratio=0.5)
    q = bend(oil, *POSES["horizontal"])
    log = play(oil, q, q, 1.0, out_of_the_tank)
    assert log.settled.any()
    assert np.abs(log.actual[-1] - log.commanded[-1]).max() < 2 * oil.task.simulation.lock_band
    assert shape.check_settled_shape(Evidence(Site(oil), log)).value < 1e-5
    assert not log.saturation.any()


def test_pressure_that_cannot_hold_the_dead_load_is_refused_with_figures(scene):
    arm = scene.manipulator
    weak = {name: part.model_copy(update={"pressure": part.pressure / 10}) for name, part in arm.cylinders.items()}
    low = dataclasses.replace(scene, manipulator=arm.model_copy(update={"cylinders": weak}))
    low = change(low, drive="hydraulic")
    q = bend(low, *POSES["horizontal"])
    with pytest.raises(DescriptionError, match=r"2\.068 MPa, which holds .* kN; allowed: at least .* MPa: m1/actuator"):
        play(low, q, q, 0.1, out_of_the_tank)


@pytest.mark.long
def test_fast_command_saturates_the_valves_and_is_counted(scene):
    oil = change(scene, drive="hydraulic", damping_ratio=0.5, valve_gain=2.0)
    start, end = bend(oil, *POSES["horizontal"]), bend(oil, [0.3, 0.3, 0.3], [0.0] * 3)
    log = play(oil, start, end, 1.0, out_of_the_tank)
    found = drives.find_saturation(Evidence(Site(oil), log), FLOW)
    assert found.value > 0.05
    assert "of the records" in found.detail


@pytest.mark.long
def test_period_and_damping_are_those_of_the_servos(scene):
    """Soft servos and next to no weight: a quarter of their stiffness doubles the period and the damper's time."""
    q = bend(scene, *POSES["horizontal"])
    found = []
    for stiffness in (4e5, 1e5):
        soft = change(scene, drive="servo", servo_stiffness=stiffness, gravity=1e-6)
        model, chain = finish_model(build_spec(Site(soft)), Site(soft)), Site(soft).chain
        springs = fit_springs(model, mujoco.MjData(model), Site(soft), chain.nodes(q))
        found.append((springs.period, springs.excess + soft.task.simulation.timestep))
    assert found[1] == pytest.approx(2 * np.array(found[0]), rel=0.02)
    assert found[0][1] == pytest.approx(0.2 * found[0][0] / np.pi)


@pytest.mark.long
def test_servos_that_buckle_under_the_weight_are_refused(scene):
    soft = change(with_payload(scene, 2e3), drive="servo", servo_stiffness=1e5)
    q = bend(scene, *POSES["horizontal"])
    with pytest.raises(DescriptionError, match=r"servo_stiffness: found 1e\+05 N/m; allowed: enough to hold the arm"):
        play(soft, q, q, 0.1, out_of_the_tank)
