from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from finite_elements import forces_with_pynite
from mass_points import Cloud

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.errors import TrussError
from vgtsim.kinematics import Chain, Member, Truss, hanging_mount
from vgtsim.statics import NodeMotion, diagnose, make_load_model, motion_from_log, solve_members
from vgtsim.statics.framework import equilibrium_matrix, framework_of
from vgtsim.statics.loads import hub_loads, member_loads

ROUNDING = 1e-9  # of the largest force: 135 equations of condition 1e3 in double precision
FINITE_ELEMENTS = 1e-8  # of the largest force: a stiffness solve loses digits in the displacements first
DIFFERENCES = 1e-8  # of the weight or largest force: five-point differences at 5 ms, and of lengths by 1 mm
GRAVITY = 9.81


@pytest.fixture(scope="module")
def chain():
    arm = load_manipulator(Path(__file__).parents[2] / "models" / "arm15" / "arm15.toml")
    return Chain(arm, hanging_mount(7.32))


@pytest.fixture(scope="module")
def payload():
    return Payload(mass=453.6, radius=0.15)


@pytest.fixture(scope="module")
def model(chain, payload):
    return make_load_model(chain, payload, GRAVITY)


@pytest.fixture(scope="module")
def bent(chain):
    """Seven seeded poses, shape (7, n)."""
    rng = np.random.default_rng(20)
    return chain.straight + np.resize([0.25, 0.25, 0.02], chain.straight.size) * rng.uniform(
        -1, 1, (7, *chain.straight.shape)
    )


@pytest.fixture(scope="module")
def path(chain):
    """A smooth motion of all modules at once, fast enough for inertia to count."""
    rng = np.random.default_rng(21)
    amplitude = np.resize([0.12, 0.12, 0.02], chain.straight.size) * rng.uniform(0.5, 1, chain.straight.shape)
    phase = rng.uniform(0, 2 * np.pi, chain.straight.shape)
    return lambda time: chain.straight + amplitude * np.sin(1.5 * time + phase)


def moving(chain, path, time):
    """Nodes and motion at an instant, by the record's route."""
    times = time + 0.005 * np.arange(-2, 3)
    nodes = np.stack([chain.nodes(path(t)) for t in times])
    motion = motion_from_log(times, nodes)
    return nodes[2], NodeMotion(motion.velocity[2], motion.acceleration[2])


def all_loads(model, nodes):
    """Loads at the nodes, shape (N, 3)."""
    shares = member_loads(model, nodes)
    force = hub_loads(model, nodes)
    np.add.at(force, model.truss.ends[:, 0], shares.near)
    np.add.at(force, model.truss.ends[:, 1], shares.far)
    return force


def test_group_by_group_is_the_dense_solution(chain, model, bent):
    nodes = chain.nodes(bent)
    bar = solve_members(model, nodes).bar
    for instant, n in zip(bar, nodes, strict=True):
        dense = np.linalg.solve(equilibrium_matrix(framework_of(model.truss), n), -all_loads(model, n)[3:].ravel())
        assert np.abs(instant - dense[:-3]).max() < ROUNDING * np.abs(dense).max()


def test_forces_agree_with_finite_elements(chain, model, bent):
    nodes = chain.nodes(bent[0])
    found = forces_with_pynite(model.truss, nodes, all_loads(model, nodes))
    bar = solve_members(model, nodes).bar
    assert np.abs(found - bar).max() < FINITE_ELEMENTS * np.abs(bar).max()


def test_hanging_straight_arm_is_the_hand_calculation(chain):
    """Six longerons share the payload; the actuators hold the twelve longerons apart."""
    arm = chain.manipulator
    light = {name: item.model_copy(update={"density": 1e-12}) for name, item in arm.materials.items()}
    weightless = Chain(arm.model_copy(update={"materials": light}), chain.mount)
    model = make_load_model(weightless, Payload(mass=100.0, radius=0.1), GRAVITY)
    forces = solve_members(model, weightless.nodes(weightless.straight))
    weight, half = 100.0 * GRAVITY, weightless.straight[2]
    for module in arm.active:
        lean = np.sqrt(module.longeron**2 - arm.face_side**2 / 4 - half**2)
        for member, bar in zip(model.truss.members, forces.bar, strict=True):
            if member.name.startswith(f"{module.name}/longeron"):
                assert bar == pytest.approx(weight * module.longeron / (6 * half), rel=ROUNDING)
            if member.name.startswith(f"{module.name}/actuator"):
                assert bar == pytest.approx(-2 * weight * lean / (3 * np.sqrt(3) * half), rel=ROUNDING)
    assert forces.reaction == pytest.approx([0, 0, weight, 0, 0, 0], abs=ROUNDING * weight)


def test_reaction_at_rest_holds_every_mass_point(chain, model, payload, bent):
    cloud = Cloud(chain, payload.mass, payload.radius)
    for q in bent:
        points, masses, weighty = cloud.points(q)
        held = (masses * weighty)[:, None] * np.array([0, 0, GRAVITY])
        nodes = chain.nodes(q)
        reaction, pivot = solve_members(model, nodes).reaction, nodes[model.truss.base].mean(axis=0)
        moment = np.cross(points, held).sum(axis=0) - np.cross(pivot, held.sum(axis=0))
        assert np.abs(reaction[:3] - held.sum(axis=0)).max() < ROUNDING * held.sum()
        assert np.abs(reaction[3:] - moment).max() < ROUNDING * held.sum()
    assert model.mass == pytest.approx((masses * weighty).sum(), rel=ROUNDING)


@pytest.mark.parametrize("time", [0.0, 0.7, 1.9])
def test_reaction_in_motion_is_the_rate_of_momentum(chain, model, payload, path, time):
    cloud = Cloud(chain, payload.mass, payload.radius)
    loads, (points, _, weighty) = cloud.loads(path, time, GRAVITY), cloud.points(path(time))
    nodes, motion = moving(chain, path, time)
    reaction, pivot = solve_members(model, nodes, motion).reaction, nodes[model.truss.base].mean(axis=0)
    moment = reaction[3:] + np.cross(pivot, reaction[:3])  # about the origin
    weight = model.mass * GRAVITY
    force = (loads * weighty[:, None]).sum(axis=0)
    assert np.linalg.norm(force - [0, 0, weight]) > 1e-3 * weight  # inertia does count in this motion
    assert np.abs(reaction[:3] - force).max() < DIFFERENCES * weight
    assert np.abs(moment - np.cross(points, loads).sum(axis=0)).max() < DIFFERENCES * weight


def virtual_forces(chain, cloud, q, loads):
    """Drive forces by virtual work: minus the work of the held loads per unit length of each actuator."""
    lengths = chain.lengths(q)
    found = np.empty(lengths.shape)
    for index in np.ndindex(*lengths.shape):
        work = []
        for step in (-2, -1, 1, 2):
            shifted = lengths.copy()
            shifted[index] += step * 1e-3
            work.append(np.sum(loads * cloud.points(chain.inputs_from_lengths(shifted, q))[0]))
        found[index] = -(work[0] - 8 * work[1] + 8 * work[2] - work[3]) / 12e-3
    return found


def test_drive_forces_at_rest_are_the_gradient_of_potential_energy(chain, model, payload, bent):
    cloud = Cloud(chain, payload.mass, payload.radius)
    _, masses, weighty = cloud.points(bent[0])
    held = (masses * weighty)[:, None] * np.array([0, 0, GRAVITY])
    bar = solve_members(model, chain.nodes(bent[0])).bar[model.truss.actuated]
    expected = virtual_forces(chain, cloud, bent[0], held)
    assert np.abs(bar - expected).max() < DIFFERENCES * np.abs(bar).max()


def test_drive_forces_in_motion_do_the_work_of_inertia(chain, model, payload, path):
    cloud = Cloud(chain, payload.mass, payload.radius)
    nodes, motion = moving(chain, path, 0.7)
    bar = solve_members(model, nodes, motion).bar[model.truss.actuated]
    still = solve_members(model, nodes).bar[model.truss.actuated]
    expected = virtual_forces(chain, cloud, path(0.7), cloud.loads(path, 0.7, GRAVITY))
    assert np.abs(bar - still).max() > 1e-2 * np.abs(bar).max()
    assert np.abs(bar - expected).max() < DIFFERENCES * np.abs(bar).max()


def test_members_hand_their_weight_to_their_hubs(chain, model, bent):
    forces = solve_members(model, chain.nodes(bent))
    weight = model.members.mass.sum(axis=1) * GRAVITY
    down = forces.direction @ np.array([0, 0, -1.0])
    along = forces.near_axial - forces.far_axial
    assert along == pytest.approx(weight * down, abs=ROUNDING * np.abs(forces.bar).max())
    tubes = np.setdiff1d(np.arange(len(weight)), model.truss.actuated)
    shear = np.linalg.norm(forces.near_transverse[:, tubes], axis=-1)
    assert shear == pytest.approx((weight * np.sqrt(1 - down**2) / 2)[:, tubes], abs=1e-9)
    assert np.abs(np.sum(forces.near_transverse * forces.direction, axis=-1)).max() < 1e-9


def test_hub_forces_of_neighbours_balance_at_every_free_node(chain, model, path):
    """Near and far forces, rebuilt from the public fields, and the hub's own load leave nothing over."""
    nodes, motion = moving(chain, path, 1.3)
    forces = solve_members(model, nodes, motion)
    rest = hub_loads(model, nodes, motion)
    shares = member_loads(model, nodes, motion)
    far_shear = shares.far - np.sum(shares.far * forces.direction, axis=-1, keepdims=True) * forces.direction
    np.add.at(rest, model.truss.ends[:, 0], forces.near_axial[..., None] * forces.direction + forces.near_transverse)
    np.add.at(rest, model.truss.ends[:, 1], far_shear - forces.far_axial[:, None] * forces.direction)
    assert np.abs(rest[3:-3]).max() < ROUNDING * np.abs(forces.bar).max()


def test_forces_superpose(chain, model, bent):
    nodes = chain.nodes(bent)
    extra = np.random.default_rng(3).normal(0, 1e3, nodes.shape)
    one, two = solve_members(model, nodes, nodal_forces=extra), solve_members(model, nodes, nodal_forces=2 * extra)
    none = solve_members(model, nodes)
    assert two.bar - one.bar == pytest.approx(one.bar - none.bar, abs=ROUNDING * np.abs(two.bar).max())
    assert one.reaction[:, :3] - none.reaction[:, :3] == pytest.approx(-extra.sum(axis=1), abs=1e-5)


def test_batches_of_any_shape_are_their_instants(chain, model, bent):
    nodes = chain.nodes(bent[:6])
    flat, square = solve_members(model, nodes), solve_members(model, nodes.reshape(2, 3, *nodes.shape[1:]))
    single = solve_members(model, nodes[4])
    for name in ("bar", "near_axial", "far_axial", "near_transverse", "direction", "reaction"):
        assert np.array_equal(getattr(flat, name), getattr(square, name).reshape(getattr(flat, name).shape))
        assert getattr(single, name) == pytest.approx(getattr(flat, name)[4], abs=1e-6)
    assert solve_members(model, nodes[:0]).bar.shape == (0, len(model.truss.members))


def test_instants_without_motion_are_left_open(chain, model, bent):
    nodes = chain.nodes(bent[:2])
    motion = NodeMotion(np.zeros(nodes.shape), np.zeros(nodes.shape))
    motion.velocity[0], motion.acceleration[0] = np.nan, np.nan
    forces = solve_members(model, nodes, motion)
    assert np.isnan(forces.bar[0]).all()
    assert forces.bar[1] == pytest.approx(solve_members(model, nodes[1]).bar, abs=1e-6)


def rebuilt(truss, members):
    return Truss(truss.nodes, truss.node_module, tuple(members), truss.group)


def test_sound_arm_is_isostatic(chain, bent):
    for nodes in chain.nodes(bent):
        assert diagnose(chain.truss, nodes) > 1e-6


def test_missing_member_is_named_a_mechanism(chain, model, bent):
    lost = next(i for i, member in enumerate(chain.truss.members) if member.name == "m3/longeron/2")
    members = [member for i, member in enumerate(chain.truss.members) if i != lost]
    loose = replace(model, truss=rebuilt(chain.truss, members))
    with pytest.raises(TrussError, match="1 mechanism") as caught:
        diagnose(loose.truss, chain.nodes(bent[0]))
    assert caught.value.rank == 3 * len(chain.truss.nodes) - 10
    assert caught.value.members
    with pytest.raises(TrussError, match="1 mechanism"):
        solve_members(make_short(loose, lost), chain.nodes(bent[0]))


def make_short(model, lost):
    """The mass model without one member."""
    keep = np.arange(len(model.members.mass)) != lost
    members = model.members
    part = replace(members, mass=members.mass[keep], centre=members.centre[keep], centroidal=members.centroidal[keep])
    return replace(model, members=part)


def test_member_too_many_is_named_in_a_self_stress(chain, bent):
    # across a side of the second prism, against its diagonal
    bottom = chain.truss.nodes.index("m2/top/2")
    top = chain.truss.nodes.index("s2/top/1")
    brace = Member("brace", "cross_longeron", (bottom, top), 3, chain.truss.members[-1].section)
    with pytest.raises(TrussError, match="1 self-stress") as caught:
        diagnose(rebuilt(chain.truss, [*chain.truss.members, brace]), chain.nodes(bent[0]))
    assert "brace" in caught.value.members
    assert all(name == "brace" or name.startswith(("s2/", "m2/batten")) for name in caught.value.members)


def test_flattened_module_is_a_mechanism(chain, model):
    """Longerons in the plane of their face carry nothing across it."""
    nodes = chain.nodes(chain.straight)
    top = [chain.truss.nodes.index(f"m1/mid/{i}") for i in (1, 2, 3)]
    nodes[top, 2] = nodes[0, 2]
    with pytest.raises(TrussError, match="mechanism") as caught:
        solve_members(model, nodes)
    assert any(name.startswith("m1/") for name in caught.value.members)


def test_singular_pose_of_a_batch_is_named(chain, model, bent):
    """Exactly singular, so that no inverse is found, and in the second of the chunks that are solved at a time."""
    nodes = np.repeat(chain.nodes(bent[0])[None], 600, axis=0)
    nodes[530] = chain.nodes(chain.straight)
    nodes[530, [chain.truss.nodes.index(f"m1/mid/{i}") for i in (1, 2, 3)], 2] = nodes[530, 0, 2]
    with pytest.raises(TrussError, match=r"instant 530: .*mechanism") as caught:
        solve_members(model, nodes)
    assert any(name.startswith("m1/") for name in caught.value.members)
