"""Models with joint blocks: loops, kinematics, axial longerons, and the bending of the actuators that statics gives."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from offset_arms import OFFSET, with_offset
from standing import STEP, stand

from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, sample_inputs
from vgtsim.mjcf import build_arm_spec, names, qpos_from_nodes, select_drive, stiffen
from vgtsim.statics.loads import weigh

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2] / "models"
CLOSURE = 1e-8  # m
AGREEMENT = 1e-7  # m: the closures' gaps, longer by the arm's levers
END_MOMENT = 1e-6  # N·m, of members with balls
EXCESS_SHEAR = 1e-2  # N; forces are of the order of 1e3 N
AXIAL = 2e-6  # of the largest force: what the rest of motion and the solver leave
BENDING = 1e-6  # of the largest bending moment: the same
PLACED = 1e-12  # m: nodes written into coordinates and read back
POSES = 200


def load(name: str):
    return load_manipulator(ROOT / name / f"{name}.toml")


def first_two(arm):
    return with_offset(arm.model_copy(update={"modules": arm.modules[:4]}))


ARMS = {
    "alone": (load("octahedron_offset"), POSES),
    "two in a row": (first_two(load("arm15")), 40),
    "among other kinds": (with_offset(load("mixed")), 10),
    "general": (load("octahedron_general"), POSES),
}


@pytest.mark.parametrize("which", ARMS)
@pytest.mark.parametrize("moved", [False, True])
def test_longerons_are_axial_and_actuators_bend_as_statics_say(which, moved):
    arm, count = ARMS[which]
    poses = sample_inputs(Chain(arm, np.eye(4)), count, seed=8)
    found = stand(arm, poses[:3] if moved else poses, moved)
    assert found.closure.max() < CLOSURE
    assert found.agreement.max() < AGREEMENT
    assert found.moment.max() < END_MOMENT
    assert found.shear.max() < EXCESS_SHEAR
    assert found.axial.max() < AXIAL
    assert found.bending.max() > 30.0
    assert found.bending_error.max() < BENDING * found.bending.max()


@pytest.fixture(scope="module")
def model():
    compiled = build_arm_spec(load("octahedron_offset"), STEP, limited=False).compile()
    stiffen(compiled, 1e-5)
    select_drive(compiled, "rigid")
    return compiled


@pytest.fixture(scope="module")
def chain(model):
    mount = np.diag([1.0, -1.0, -1.0, 1.0])
    mount[2, 3] = model.body(names.MAST).pos[2]
    return Chain(load("octahedron_offset"), mount)


def test_nodes_and_pins_stand_where_kinematics_puts_them(model, chain):
    """Feet, middles and heads, and both ends of every member, with the rods' pins along the blocks' axes."""
    data = mujoco.MjData(model)
    truss = chain.truss
    for q in sample_inputs(chain, 20, seed=9):
        nodes = chain.nodes(q)
        data.qpos[:] = qpos_from_nodes(model, truss, nodes)
        mujoco.mj_kinematics(model, data)
        sites = np.array([data.site(name).xpos for name in truss.nodes])
        assert np.abs(sites - nodes).max() < PLACED
        for member in truss.members:
            for site, node in ((names.near, member.ends[0]), (names.far, member.ends[1])):
                assert np.abs(data.site(site(member.name)).xpos - nodes[node]).max() < PLACED
        for index, (_, _, head) in zip(truss.ring_actuators[0], np.roll(truss.rings[0], -1, axis=0), strict=True):
            assert np.abs(data.site(names.lug(truss.member_names[index])).xpos - nodes[head]).max() < PLACED


def test_pins_are_hinges_along_the_normal_of_the_mid_plane(model, chain):
    data = mujoco.MjData(model)
    q = sample_inputs(chain, 1, seed=10)[0]
    nodes = chain.nodes(q)
    data.qpos[:] = qpos_from_nodes(model, chain.truss, nodes)
    mujoco.mj_kinematics(model, data)
    foot = nodes[chain.truss.rings[0, :, 0]]
    normal = np.cross(foot[1] - foot[0], foot[2] - foot[0])
    normal /= np.linalg.norm(normal)
    assert np.linalg.norm(nodes[9] - nodes[3]) == pytest.approx(OFFSET, abs=PLACED)
    for index in chain.truss.ring_actuators[0]:
        joint = model.joint(names.pin(chain.truss.member_names[index]))
        assert joint.type[0] == mujoco.mjtJoint.mjJNT_HINGE
        assert joint.damping[0] == chain.manipulator.blocks["b250"].pin_damping
        assert np.abs(data.xaxis[joint.id] - normal).max() < 1e-9


def test_a_model_with_blocks_weighs_what_the_description_says(model, chain):
    others = model.body_mass[model.body(names.MAST).id]
    assert model.body_mass.sum() - others == pytest.approx(weigh(chain), rel=1e-12)


def test_a_block_turns_as_a_solid_post_with_a_ball_at_each_end(model, chain):
    """By the closed forms of a cylinder and of balls away from the axis."""
    arm, block = chain.manipulator, model.body("m/mid/1")
    wide, ball, radius = arm.blocks["b250"].diameter, arm.hub_mass, arm.hub.radius
    post = arm.materials["steel"].density * np.pi / 4 * wide**2 * OFFSET
    along = post * wide**2 / 8 + 2 * 0.4 * ball * radius**2
    across = post * (OFFSET**2 / 12 + wide**2 / 16) + 2 * ball * (0.4 * radius**2 + OFFSET**2 / 4)
    assert block.mass == pytest.approx(post + 2 * ball, rel=1e-12)
    assert block.inertia == pytest.approx([across, across, along], rel=1e-12)


def test_the_idle_spin_of_a_block_dies_out_at_its_pins(model, chain):
    """Nothing loads it and nothing but its pin holds it: rate falls by the pin's friction over its own inertia."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos_from_nodes(model, chain.truss, chain.nodes(chain.straight))
    rows = [model.equality(names.drive(chain.truss.member_names[i])).id for i in chain.truss.actuated]
    slides = [model.joint(names.slide(chain.truss.member_names[i])).qposadr[0] for i in chain.truss.actuated]
    model.eq_data[rows, 0] = data.qpos[slides] - model.qpos0[slides]
    for _ in range(200):
        mujoco.mj_step(model, data)
    spin = model.joint(names.turn("m/mid/1")).dofadr[0] + 2
    block = model.body("m/mid/1")
    decay = chain.manipulator.blocks["b250"].pin_damping / block.inertia[2]
    children = ["m/actuator/1", "m/longeron/9", "m/longeron/10"]
    data.qvel[spin] = 1.0
    for child in children:  # what hangs from the block stays where it is
        joint = model.joint(names.pin(child) if "actuator" in child else child)
        body = data.xmat[model.body(child).id].reshape(3, 3)
        axis = data.xmat[block.id].reshape(3, 3)[:, 2]
        turned = body.T @ axis
        data.qvel[joint.dofadr[0] : joint.dofadr[0] + len(joint.damping)] = -turned[: len(joint.damping)]
    steps = 40
    for _ in range(steps):
        mujoco.mj_step(model, data)
    expected = (1 + decay * STEP) ** -steps  # friction is taken at the end of the step
    assert data.qvel[spin] == pytest.approx(expected, rel=1e-3)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-7
