"""Actuators between joint blocks: isostatic when rods turn in their barrels, and bent as three other routes say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mass_points import Cloud
from offset_arms import OFFSET, with_offset
from Pynite import FEModel3D

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.statics import NodeMotion, diagnose, make_load_model, motion_from_log, solve_members
from vgtsim.statics.blocks import find_heights, seat_blocks
from vgtsim.statics.capacity import GOVERNING, find_allowance
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.loads import block_loads, hub_loads, member_loads
from vgtsim.statics.modes import geometric_stiffness
from vgtsim.statics.rating import make_sections
from vgtsim.statics.stiffness import _residual, band_matrix, deflect, scatter, settle
from vgtsim.statics.stiffness_matrix import unfold
from vgtsim.statics.utilisation import find_use

MODELS = Path(__file__).parents[2] / "models"
ROUNDING = 1e-9  # of the largest force or moment: systems of condition 1e3 in double precision
FINITE_ELEMENTS = 1e-6  # of the largest: blocks and actuators are beams of a stiffness, and turn a little
DIFFERENCES = 1e-8  # of the weight or largest force: five-point differences at 5 ms, and of lengths by 1 mm
SINGULAR = 1e-9  # singular value, dimensionless: rounding leaves 1e-15
GRAVITY = 9.81


@pytest.fixture(scope="module")
def single():
    return Chain(load_manipulator(MODELS / "octahedron_offset/octahedron_offset.toml"), hanging_mount(4.0))


@pytest.fixture(scope="module")
def double():
    """Two offset modules with prisms between and after them."""
    arm = with_offset(load_manipulator(MODELS / "arm15/arm15.toml"))
    return Chain(arm.model_copy(update={"modules": arm.modules[:4]}), hanging_mount(9.0))


@pytest.fixture(scope="module")
def payload():
    return Payload(mass=453.6, radius=0.15)


def poses(chain, count=7):
    return sample_inputs(chain, count, seed=40)


def pinned_equations(points, axis, released):
    """Equilibrium matrix of three blocks joined by three actuators, six rows a body.

    The columns are the force and the moment that each pin passes, none about its axis, and, if a rod does not turn in
    its barrel, the actuator's torsion; that is, an actuator is cut into barrel and rod when it does.
    """
    columns, rows = [], 3 + (6 if released else 3)

    def joint(first, second, point, directions, moments):
        for basis, turning in ((directions, False), (moments, True)):
            for d in basis:
                column = np.zeros(6 * rows)
                for body, sign in ((first, 1.0), (second, -1.0)):
                    column[6 * body : 6 * body + 6] = sign * np.concatenate(
                        [np.zeros(3), d] if turning else [d, np.cross(point, d)]
                    )
                columns.append(column)

    for k in range(3):
        a, b = points[k], points[(k + 1) % 3]
        e = (b - a) / np.linalg.norm(b - a)
        across = np.cross(axis, e)
        barrel, rod = (3 + 2 * k, 4 + 2 * k) if released else (3 + k, 3 + k)
        joint(k, barrel, a, np.eye(3), [e, across])
        joint((k + 1) % 3, rod, b, np.eye(3), [e, across])
        if released:
            joint(barrel, rod, (a + b) / 2, np.eye(3), [axis, across])
    return np.array(columns).T


@pytest.mark.parametrize(("released", "self_stresses"), [(True, 0), (False, 3)])
def test_a_ring_is_isostatic_when_rods_turn_in_their_barrels(single, released, self_stresses):
    """Six equations a rigid body, by rank alone; what is left of motion is six of the whole and three idle spins."""
    for nodes in single.nodes(poses(single)):
        ring = nodes[single.truss.rings[0]]
        axis = (ring[0, 2] - ring[0, 0]) / OFFSET
        matrix = pinned_equations(ring[:, 1], axis, released)
        rank = np.sum(np.linalg.svd(matrix, compute_uv=False) > SINGULAR)
        assert matrix.shape[1] - rank == self_stresses
        assert matrix.shape[0] - rank == 6 + 3
        spins = np.zeros((3, matrix.shape[0]))
        for k in range(3):  # of a block about its own axis: no pin or ball is moved
            spins[k, 6 * k : 6 * k + 6] = np.concatenate([np.cross(ring[k, 1], axis), axis])
        assert np.abs(spins @ matrix).max() < 1e-12


def test_an_arm_with_offsets_is_isostatic(single, double):
    for chain in (single, double):
        truss = chain.truss
        assert len(truss.bars) == 3 * np.sum(truss.group > 0)
        for nodes in chain.nodes(poses(chain)):
            assert diagnose(truss, nodes) > 1e-3


def solve_bodies(chain, nodes, loads):
    """Longerons, battens and pins of one offset module with the tip plate by six equations for each block and the plate.

    Unknown are the tensions of the longerons, and of each actuator its axial force, shear and two pin moments.
    """
    truss = chain.truss
    ring = nodes[truss.rings[0]]
    axis = (ring[0, 2] - ring[0, 0]) / OFFSET
    owner = {int(node): k for k, block in enumerate(truss.rings[0]) for node in block}
    owner |= dict.fromkeys(range(truss.tip.start, truss.tip.stop), 3)
    matrix = np.zeros((24 + 3, 12 + 12))

    def act(column, body, point, force, moment):
        if body is not None:
            matrix[6 * body : 6 * body + 3, column] += force
            matrix[6 * body + 3 : 6 * body + 6, column] += np.cross(point, force) + moment

    none = np.zeros(3)
    for i in range(12):
        first, second = truss.ends[i]
        unit = (nodes[second] - nodes[first]) / np.linalg.norm(nodes[second] - nodes[first])
        act(i, owner.get(int(first)), nodes[first], unit, none)
        act(i, owner.get(int(second)), nodes[second], -unit, none)
    for k in range(3):
        a, b = ring[k, 1], ring[(k + 1) % 3, 1]
        length = np.linalg.norm(b - a)
        e = (b - a) / length
        about, column = np.cross(axis, e), 12 + 4 * k
        for body, point, sign in ((k, a, 1.0), ((k + 1) % 3, b, -1.0)):
            act(column, body, point, sign * e, none)
            act(column + 1, body, point, sign * axis, none)
        act(column + 2, k, a, none, about)
        act(column + 3, (k + 1) % 3, b, none, about)
        matrix[24 + k, [column + 1, column + 2, column + 3]] = length, 1.0, 1.0  # the actuator itself
    right = np.zeros(27)
    for node, body in owner.items():
        right[6 * body : 6 * body + 3] -= loads[node]
        right[6 * body + 3 : 6 * body + 6] -= np.cross(nodes[node], loads[node])
    found, _, rank, _ = np.linalg.lstsq(matrix, right, rcond=None)
    assert rank == 24
    assert np.abs(matrix @ found - right).max() < 1e-9 * np.abs(right).max()
    return found[:12], found[12:].reshape(3, 4)


def all_loads(model, nodes):
    """What weighs on the nodes, shape (N, 3)."""
    force = hub_loads(model, nodes)
    for shares, ends in (
        (member_loads(model, nodes), model.truss.ends),
        (block_loads(model, nodes), model.truss.rings[:, :, [0, 2]].reshape(-1, 2)),
    ):
        np.add.at(force, ends[:, 0], shares.near)
        np.add.at(force, ends[:, 1], shares.far)
    return force


def test_forces_and_moments_are_those_of_rigid_bodies(single, payload):
    """27 equations of four bodies and three actuators: no bar stands for anything."""
    model = make_load_model(single, payload, GRAVITY)
    extra = np.random.default_rng(41).normal(0, 2e3, (7, len(single.truss.nodes), 3))
    for nodes, push in zip(single.nodes(poses(single)), extra, strict=True):
        loads = all_loads(model, nodes) + push
        forces = solve_members(model, nodes, nodal_forces=push)
        longerons, actuators = solve_bodies(single, nodes, loads)
        scale = np.abs(forces.bar).max()
        assert np.abs(forces.bar[:12] - longerons).max() < ROUNDING * scale
        pinned = single.truss.ring_actuators[0]
        axis = (nodes[9] - nodes[3]) / OFFSET
        about = np.cross(axis, forces.direction[pinned])
        assert np.abs(forces.bar[pinned] - actuators[:, 0]).max() < ROUNDING * scale
        assert np.abs(forces.near_moment[pinned] - actuators[:, 2, None] * about).max() < ROUNDING * scale
        assert np.abs(forces.far_moment[pinned] - actuators[:, 3, None] * about).max() < ROUNDING * scale
        assert np.abs(actuators[:, 2:]).max() > 50.0


def test_bending_agrees_with_a_frame_program(single, payload):
    """PyNite: blocks as stiff beams, actuators as beams on pins with rods that turn, longerons pin-jointed.

    All is turned so that the pins are along that program's Y, which then is local y of the actuators.
    """
    model, truss = make_load_model(single, payload, GRAVITY), single.truss
    nodes = single.nodes(poses(single)[0])
    axis = (nodes[9] - nodes[3]) / OFFSET
    turn = np.stack([np.cross(axis, [1.0, 0.0, 0.0]), axis, np.zeros(3)])
    turn[0] /= np.linalg.norm(turn[0])
    turn[2] = np.cross(turn[0], turn[1])
    frame = FEModel3D()
    frame.add_material("steel", 200e9, 77e9, 0.3, 7850.0)
    frame.add_section("bar", 1e-3, 1e-6, 1e-6, 2e-6)
    for index, (position, force) in enumerate(zip(nodes @ turn.T, all_loads(model, nodes) @ turn.T, strict=True)):
        frame.add_node(f"n{index}", *map(float, position))
        held, turns = index < 3, index in truss.rings
        idle = index in truss.rings[:, :, 1]  # nothing turns a block about its own axis, and nothing else holds it
        frame.def_support(f"n{index}", held, held, held, not turns, not turns or idle, not turns)
        for direction, value in zip(("FX", "FY", "FZ"), force, strict=True):
            frame.add_node_load(f"n{index}", direction, float(value))
    pinned = truss.ring_actuators.ravel().tolist()
    for index, (first, second) in enumerate([*truss.ends, *truss.tip_edges]):
        frame.add_member(f"m{index}", f"n{first}", f"n{second}", "steel", "bar")
        if index in pinned:
            frame.def_releases(f"m{index}", Ryi=True, Ryj=True, Rxi=True)
        else:
            frame.def_releases(f"m{index}", Ryi=True, Rzi=True, Ryj=True, Rzj=True, Rxi=True)
    for k, (foot, middle, head) in enumerate(truss.rings[0]):
        frame.add_member(f"below{k}", f"n{foot}", f"n{middle}", "steel", "bar")
        frame.add_member(f"above{k}", f"n{middle}", f"n{head}", "steel", "bar")
    frame.analyze_linear(check_stability=False)
    forces = solve_members(model, nodes)
    axial = np.array([-frame.members[f"m{i}"].axial(0.0, "Combo 1") for i in range(len(truss.members))])
    assert np.abs(axial - forces.bar).max() < FINITE_ELEMENTS * np.abs(axial).max()
    ends = [(frame.members[f"m{i}"], i) for i in pinned]
    near = np.array([member.moment("Mz", 0.0, "Combo 1") for member, _ in ends])
    far = np.array([member.moment("Mz", member.L(), "Combo 1") for member, _ in ends])
    about = np.cross(axis, forces.direction[pinned])
    found = np.sum(forces.near_moment[pinned] * about, axis=-1), np.sum(forces.far_moment[pinned] * about, axis=-1)
    sign = np.sign(near[0] * found[0][0])
    scale = np.abs(near).max()
    assert scale > 50.0
    assert np.abs(sign * near - found[0]).max() < FINITE_ELEMENTS * scale
    assert np.abs(-sign * far - found[1]).max() < FINITE_ELEMENTS * scale


def test_moments_and_shear_hold_the_actuator(single, payload):
    """Moment equilibrium of each actuator about its near pin, in the plane of its bending."""
    model, pinned = make_load_model(single, payload, GRAVITY), single.truss.ring_actuators[0]
    nodes, weight = single.nodes(poses(single)), model.members
    forces = solve_members(model, nodes)
    axis = (nodes[:, 9] - nodes[:, 3]) / OFFSET
    span = nodes[:, single.truss.ends[pinned, 1]] - nodes[:, single.truss.ends[pinned, 0]]
    length = np.linalg.norm(span, axis=-1)
    lever = weight.first_moment[pinned, 0] + weight.mass[pinned, 1] * length - weight.first_moment[pinned, 1]
    own = np.cross(lever[..., None] * forces.direction[:, pinned], [0.0, 0.0, -GRAVITY])
    total = weight.mass[pinned].sum(axis=1)[:, None] * np.array([0.0, 0.0, -GRAVITY])
    near = forces.near_axial[..., None] * forces.direction + forces.near_transverse
    far_force = total - near[:, pinned]  # on the second block: what the first does not carry
    about = np.cross(axis[:, None], forces.direction[:, pinned])
    moment = own - np.cross(span, far_force) - forces.near_moment[:, pinned] - forces.far_moment[:, pinned]
    assert np.abs(np.sum(moment * about, axis=-1)).max() < ROUNDING * np.abs(forces.bar).max()


def test_moments_on_a_block_are_half_the_offset_times_the_difference_of_its_longerons(single):
    """The closed form, without weight: sum of M = -Ljo/2 U x (force on head - force on foot), two actuators a block."""
    none, truss = make_load_model(single, Payload(mass=0.0, radius=0.1), 0.0), single.truss
    push = np.zeros((7, len(truss.nodes), 3))
    push[:, truss.tip] = np.random.default_rng(45).normal(0, 2e3, (7, 3, 3))
    nodes = single.nodes(poses(single))
    forces = solve_members(none, nodes, nodal_forces=push)
    pull = np.zeros(nodes.shape)
    for index in range(12):
        first, second = truss.ends[index]
        pull[:, first] += forces.near_axial[:, index, None] * forces.direction[:, index]
        pull[:, second] -= forces.far_axial[:, index, None] * forces.direction[:, index]
    for k, (foot, _, head) in enumerate(truss.rings[0]):
        moment = (
            forces.near_moment[:, truss.ring_actuators[0, k]] + forces.far_moment[:, truss.ring_actuators[0, k - 1]]
        )
        expected = -np.cross(nodes[:, head] - nodes[:, foot], pull[:, head] - pull[:, foot]) / 2
        assert np.abs(moment - expected).max() < ROUNDING * np.abs(forces.bar).max()
        assert np.abs(moment).max() > 50.0


def test_no_offset_bends_nothing(hanging_arm, payload):
    forces = solve_members(make_load_model(hanging_arm, payload, GRAVITY), hanging_arm.nodes(hanging_arm.straight))
    assert not forces.near_moment.any()
    assert not forces.far_moment.any()


def test_bending_vanishes_with_the_offset():
    """Moments fall as the offset does, and axial forces come to those of the module without."""
    arm = load_manipulator(MODELS / "octahedron_double/octahedron_double.toml")
    arm = arm.model_copy(update={"hub": arm.hub.model_copy(update={"radius": 1e-4})})  # one ball or two: no weight
    bare = Chain(arm, hanging_mount(4.0))
    q = poses(bare, 3)
    load = np.zeros((15, 3))
    load[-3:] = np.random.default_rng(42).normal(0, 2e3, (3, 3))
    none = Payload(mass=0.0, radius=0.1)
    plain = solve_members(make_load_model(bare, none, 0.0), bare.nodes(q), nodal_forces=load[6:])
    moments, errors = [], []
    for offset in (1e-2, 1e-3):
        chain = Chain(with_offset(arm, offset), hanging_mount(4.0))
        found = solve_members(make_load_model(chain, none, 0.0), chain.nodes(q), nodal_forces=load)
        moments.append(np.linalg.norm(found.near_moment, axis=-1).max())
        errors.append(np.abs(found.bar - plain.bar).max() / np.abs(plain.bar).max())
    assert moments[0] > 1.0
    assert moments[1] == pytest.approx(moments[0] / 10, rel=0.05)
    assert errors[1] < 0.15 * errors[0] < 0.15


@pytest.mark.parametrize("moving", [False, True])
def test_drive_forces_of_an_offset_arm_do_the_work_of_weight_and_inertia(double, payload, moving):
    """Virtual work over a cloud of mass points, blocks included: no forces in members at all."""
    cloud, model = Cloud(double, payload.mass, payload.radius), make_load_model(double, payload, GRAVITY)
    phase = np.random.default_rng(43).uniform(0, 6, double.straight.shape)

    def path(time):
        return double.straight + np.resize([0.12, 0.1, 0.02], double.straight.size) * np.sin(
            1.5 * time * moving + phase
        )

    times = 0.7 + 0.005 * np.arange(-2, 3)
    nodes = np.stack([double.nodes(path(t)) for t in times])
    rates = motion_from_log(times, nodes)
    forces = solve_members(model, nodes[2], NodeMotion(rates.velocity[2], rates.acceleration[2]))
    moment = forces.reaction[3:] + np.cross(nodes[2, double.truss.base].mean(axis=0), forces.reaction[:3])
    loads, points = cloud.loads(path, 0.7, GRAVITY), cloud.points(path(0.7))[0]
    lengths = double.lengths(path(0.7))
    expected = []
    for index in np.ndindex(*lengths.shape):
        work = []
        for step in (-2, -1, 1, 2):
            shifted = lengths.copy()
            shifted[index] += step * 1e-3
            work.append(np.sum(loads * cloud.points(double.inputs_from_lengths(shifted, path(0.7)))[0]))
        expected.append(-(work[0] - 8 * work[1] + 8 * work[2] - work[3]) / 12e-3)
    bar = forces.bar[double.truss.actuated]
    assert np.abs(bar - expected).max() < DIFFERENCES * np.abs(bar).max()
    assert np.abs(moment - np.cross(points, loads).sum(axis=0)).max() < DIFFERENCES * model.mass * GRAVITY


def test_elastic_arm_with_joint_blocks_has_the_forces_of_statics_and_keeps_its_energy(single, double, payload):
    """Two routes to the actuators' forces: displacements, and equilibrium alone; and half the loads' work is stored."""
    for chain in (single, double):
        nodes, model = chain.nodes(poses(chain)), make_elastic_model(chain, payload, GRAVITY)
        found = deflect(model, nodes)
        joints = solve_members(model.loads, nodes).bar
        assert np.abs(found.bar - joints).max() < ROUNDING * np.abs(joints).max()
        work = np.sum(all_weights(model.loads, nodes) * found.nodes, axis=(1, 2)) / 2
        assert work == pytest.approx(np.sum(found.bar**2 / model.stiffness_at(nodes), axis=1) / 2, rel=ROUNDING)


def all_weights(model, nodes):
    """Weights at all nodes of a batch."""
    return np.stack([all_loads(model, row) for row in nodes])


def test_blocks_of_a_settled_arm_stand_square_to_their_actuators(double, payload):
    nodes = double.nodes(poses(double))
    settled = settle(make_elastic_model(double, payload, GRAVITY), nodes)
    assert np.abs(settled - nodes).max() > 1e-3
    for row in settled:
        for ring in row[double.truss.rings]:
            axis = (ring[:, 2] - ring[:, 0]) / OFFSET
            assert np.linalg.norm(axis, axis=1) == pytest.approx(1.0, abs=1e-9)
            assert (ring[:, 0] + ring[:, 2]) / 2 == pytest.approx(ring[:, 1], abs=1e-9)
            for k in range(3):
                assert axis[[k, (k + 1) % 3]] @ (ring[(k + 1) % 3, 1] - ring[k, 1]) == pytest.approx(0, abs=1e-9)


def test_stiffness_of_a_preloaded_arm_is_the_change_of_its_residual(double, payload):
    """Elastic and geometric stiffness together: the forces that a small move of the unknowns calls for, by differences."""
    model, truss = make_elastic_model(double, payload, GRAVITY), double.truss
    unloaded = double.nodes(poses(double)[0])
    rest, spring = truss.lengths(unloaded), model.stiffness_at(unloaded)
    nodes = settle(model, unloaded)
    whole = unfold(band_matrix(model, nodes[None], spring[None]).upper[0]) + geometric_stiffness(model, unloaded)
    heights, rng = find_heights(truss, nodes), np.random.default_rng(9)
    move = np.zeros(len(whole))
    move[:-6] = rng.uniform(-1, 1, len(move) - 6)  # hubs and blocks; turns of the plate are not additive

    def residual(step):
        there = nodes + scatter(truss, nodes[None], step * move[None])[0]
        seat_blocks(truss, there, heights)
        bar = spring * (truss.lengths(there) - rest)
        return _residual(model, there[None], bar[None], None, np.zeros((1, *there.shape)))[0]

    found = -(residual(1e-5) - residual(-1e-5)) / 2e-5
    assert np.abs(found - whole @ move)[:-6].max() < 2e-5 * np.abs(found).max()


def test_allowable_payload_of_a_bent_actuator_is_found_by_scanning(double):
    """The greatest payload up to which no member is used beyond its strength, bending included, against payloads in steps."""
    arm = double.manipulator
    weak = {name: part.model_copy(update={"rod": part.rod / 2}) for name, part in arm.cylinders.items()}
    chain = Chain(arm.model_copy(update={"cylinders": weak}), double.mount)
    nodes = chain.nodes(poses(chain, 2))
    found = find_allowance(chain, nodes, GRAVITY, 1.67, 0.15)
    sections = make_sections(chain)
    assert {GOVERNING[i] for i in found.limit} >= {"axial force with bending"}
    for pose, most, member, limit in zip(nodes, found.payload, found.member, found.limit, strict=True):
        steps = np.linspace(0.0, 2 * most, 30)
        used = [
            find_use(make_load_model(chain, Payload(mass=m, radius=0.15), GRAVITY), sections, pose, 1.67)
            for m in (*steps, most)
        ]
        worst = np.array([use.worst.max() for use in used])
        assert np.all((worst[:-1] <= 1.0) == (steps <= most))
        assert worst[-1] == pytest.approx(1.0, abs=1e-7)
        by_limit = [getattr(used[-1], name) for name in ("tension", "compression", "rod", "pressure", "pin", "bent")]
        assert by_limit[limit][member] == pytest.approx(1.0, abs=1e-7)
