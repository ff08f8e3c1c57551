"""Descriptions to compiled models: the arm alone, or a whole scene."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.constants import GRAVITY
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import DoubleOctahedral, Prism, SectionModule
from vgtsim.description.scene import Scene
from vgtsim.errors import VgtError
from vgtsim.geometry import make_mast
from vgtsim.kinematics import Chain, Truss, hanging_mount
from vgtsim.kinematics.modules.static import make_static
from vgtsim.kinematics.sampling import sample_inputs
from vgtsim.mjcf import names
from vgtsim.mjcf.arm import add_arm
from vgtsim.mjcf.pose import qpos_from_nodes
from vgtsim.mjcf.rigging import Rigging
from vgtsim.mjcf.rows import select_drive, stiffen
from vgtsim.mjcf.tank import add_tank
from vgtsim.mjcf.views import add_arm_cameras, add_goal_markers, add_tank_cameras
from vgtsim.site import Site

Array = NDArray[np.float64]

VIEW_TIMESTEP = 0.001  # of model files for viewers, s: without the scaled weights the sag grows as its square
RISER_MOUTH = 0.5  # a module nearer than this to the riser's mouth is stowed in the straight keyframe, m
HOLDING_WEIGHTS, HOLDING_TIME = 1e-5, 0.1  # of an arm alone; how holding forces are found, s
STIFF_TUBES = 1e4  # on elastic tubes meanwhile: they must not ring
ELASTIC_ITERATIONS = 3  # of the solver: without contacts the problem is linear; zero tolerance would spend a hundred
_MOST_LEAN = 0.35  # of a mid-plane in the reach pose, rad: half of what its module bends
_REACH_SAMPLE = 200  # configurations that the reach pose of a mixed arm is picked from


def build_spec(site: Site, poses: Mapping[str, Array] | None = None, timestep: float | None = None) -> mujoco.MjSpec:
    """Lay out a scene in MJCF.

    Args:
        site: The scene's.
        poses: Inputs, shape (n,), of keyframes besides `stowed` and `straight`, by name.
        timestep: In place of the scene's, s.

    Returns:
        The specification, with keyframes; the servos hold the arm until `select_drive` says otherwise.
    """
    chain, task, tank, pivot = site.chain, site.task, site.tank, site.scene.pivot_height
    step = timestep or task.simulation.timestep
    mast = make_mast(site.scene)
    keyed = _withdrawn_poses(chain, site.scene) | {name: (q, 0.0) for name, q in dict(poses or {}).items()}
    rigging = Rigging(
        mast_diameter=mast.outer_diameter,
        mast_wall=mast.wall,
        mast_density=mast.density,
        mast_length=mast.length,
        feed_range=(0.0, max(lift for _, lift in keyed.values())),
        payload_mass=task.payload.mass,
        payload_radius=task.payload.radius,
        reference=site.start,
        timestep=step,
        servo_stiffness=task.simulation.servo_stiffness,
        servo_damping=task.simulation.servo_damping,
        elastic=task.simulation.members == "elastic",
        lumped=task.simulation.lumped,
    )
    spec = _start_spec(task.name, step, task.simulation.gravity, task.simulation.weight_scale)
    if rigging.elastic and task.simulation.drive != "servo":
        spec.option.iterations = ELASTIC_ITERATIONS
    add_tank(spec, tank)
    add_arm(spec, chain, rigging)
    add_goal_markers(spec, task.motion.goals)
    add_tank_cameras(spec, tank, pivot)
    _add_keyframes(spec, chain, keyed)
    return spec


def build_arm_spec(manipulator: Manipulator, timestep: float = VIEW_TIMESTEP, *, lumped: bool = False) -> mujoco.MjSpec:
    """Lay out an arm alone, hanging over an empty floor.

    Args:
        manipulator: The arm.
        timestep: s.
        lumped: Whether the members' mass sits in their hubs.

    Returns:
        The specification, with keyframes `straight`, `reach` (see `reach_pose`) and, of an arm that stows, `stowed`.
    """
    free = Chain(manipulator, np.eye(4))
    poses = {"straight": free.straight, "reach": reach_pose(free)}
    if manipulator.stowed is not None:
        poses = {"stowed": free.stowed} | poses
    height = 1.0 + float(np.linalg.norm(free.tool(next(iter(poses.values())))[0]))
    chain = Chain(manipulator, hanging_mount(height))
    rigging = Rigging(
        mast_diameter=0.9144,  # the reference scene's mast, cut short
        mast_wall=0.0127,
        mast_density=7850.0,
        mast_length=2.0,
        feed_range=(0.0, 0.0),
        payload_mass=0.0,
        payload_radius=0.1,
        reference=chain.straight,
        timestep=timestep,
        servo_stiffness=1e8,
        servo_damping=1e6,
        lumped=lumped,
    )
    spec = _start_spec(manipulator.name, timestep, gravity=GRAVITY, weight_scale=HOLDING_WEIGHTS)
    add_arm(spec, chain, rigging)
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1], conaffinity=0)
    floor.rgba = [0.86, 0.87, 0.88, 1]
    add_arm_cameras(spec, height)
    _add_keyframes(spec, chain, {name: (q, 0.0) for name, q in poses.items()})
    return spec


def reach_pose(chain: Chain) -> Array:
    """Inputs of a pose that loads an arm much.

    Args:
        chain: The arm, its root on the z axis of its mount.

    Returns:
        q, shape (n,): a uniform chain bent evenly by its first modules, to the horizontal if three can; of any other,
        the one of a seeded sample whose tool is farthest from the axis.
    """
    if chain.manipulator.uniform:
        q = np.array(chain.straight)
        bent = min(3, len(chain.layout.names))
        q[: 3 * bent : 3] = np.sin(min(np.pi / 4 / bent, _MOST_LEAN))
        return q
    sample = sample_inputs(chain, _REACH_SAMPLE, seed=0)
    out = chain.tool(sample)[0] - chain.mount[:3, 3]
    across = np.linalg.norm(np.cross(out, chain.mount[:3, 2]), axis=-1)
    return sample[int(np.argmax(across))]


def build_model(site: Site, poses: Mapping[str, Array] | None = None) -> mujoco.MjModel:
    """Compile a scene for simulation: weights scaled, the scene's drive selected.

    Args:
        site: The scene's.
        poses: Inputs, shape (n,), of keyframes besides `stowed` and `straight`, by name.

    Returns:
        The model.

    Raises:
        VgtError: The compiled model is not the truss that was described.
    """
    return finish_model(build_spec(site, poses), site)


def finish_model(spec: mujoco.MjSpec, site: Site) -> mujoco.MjModel:
    """Compile a specification and give it the scene's weights and drive.

    Args:
        spec: From `build_spec`, edited or not.
        site: The scene's.

    Returns:
        The model.

    Raises:
        VgtError: The compiled model is not the truss that was described.
    """
    model = spec.compile()
    stiffen(model, site.task.simulation.weight_scale)
    select_drive(model, site.task.simulation.drive)
    _check_compiled(model, site.truss)
    return model


def _withdrawn_poses(chain: Chain, scene: Scene) -> dict[str, tuple[Array, float]]:
    """Inputs and lift of the mast of the two keyframes that do not fit under a mast at its working depth.

    Stowed: the tool at the crown, all of the arm in and above the riser. Straight: the tool a metre above the waste;
    what is still in the riser has to be stowed.
    """
    crown = scene.tank.shell.crown
    low = scene.tank.waste.level + scene.task.payload.radius + 1.0
    q, height = np.array(chain.straight), low + scene.manipulator.tip_plate.tool_offset
    faces = chain.frames(chain.straight)[1]
    active = len(chain.layout.names)
    for k, module in reversed(list(enumerate(scene.manipulator.modules))):
        if isinstance(module, Prism | SectionModule):
            height += float(make_static(module, scene.manipulator.face_side).P[2])
            continue
        active -= 1
        own = chain.layout.owner == active
        if not isinstance(module, DoubleOctahedral):  # which has no other pose than the straight one to be stowed in
            height += float(np.linalg.norm(faces[k + 1] - faces[k]))
            continue
        if height + module.straight > crown - RISER_MOUTH:
            q[own] = chain.stowed[own]
        height += 2 * q[own][2] + module.joint_offset
    stowed_length = scene.pivot_height - chain.tool(chain.stowed)[0][2]
    return {
        "stowed": (chain.stowed, crown + stowed_length - scene.pivot_height),
        "straight": (q, height - scene.pivot_height),
    }


def _start_spec(name: str, timestep: float, gravity: float, weight_scale: float) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.degree = False
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.gravity = [0, 0, -gravity]
    option.tolerance = 0.0  # an early stop leaves the joints short of equilibrium: moments of 1e-6 N*m at member ends
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_REFSAFE  # closures are stiffer than two steps
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a diverged state must be seen, not hidden
    spec.add_numeric(name=names.WEIGHT_SCALE, data=[weight_scale])
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 3840, 2160
    spec.visual.map.znear, spec.visual.map.zfar = 0.002, 10.0
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.5, 0.5, 0.5]
    spec.stat.extent = 20.0
    return spec


def _add_keyframes(spec: mujoco.MjSpec, chain: Chain, poses: Mapping[str, tuple[Array, float]]) -> None:
    """Add keyframes from inputs and lift of the mast; the servos hold the weight as well as the lengths.

    The servos' bias holds the reference pose, which a viewer starts from, and the targets of a keyframe add to that.
    """
    model = spec.compile()
    stiffen(model, HOLDING_WEIGHTS)
    select_drive(model, "rigid")
    model.jnt_stiffness *= STIFF_TUBES
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)  # weight is held, not what a pose leans on
    joints = model.actuator_trnid[:, 0]
    address, speed, stiffness = model.jnt_qposadr[joints], model.jnt_dofadr[joints], model.actuator_gainprm[:, 0]
    rest = _holding_forces(model, model.qpos0)[speed]
    for servo, push in zip(spec.actuators, rest, strict=True):
        servo.biasprm[0] += push
    for name, (q, lift) in poses.items():
        qpos = qpos_from_nodes(model, chain.truss, chain.nodes(q) + np.array([0.0, 0.0, lift]))
        push = _holding_forces(model, qpos)[speed] - rest
        spec.add_key(name=name, qpos=qpos, ctrl=(qpos - model.qpos0)[address] + push / stiffness)


def _holding_forces(model: mujoco.MjModel, qpos: Array) -> Array:
    """Generalised forces with which rigid drives hold a pose at rest, shape (nv,)."""
    rows = model.eq_type == mujoco.mjtEq.mjEQ_JOINT
    address = model.jnt_qposadr[model.eq_obj1id[rows]]
    model.eq_data[rows, 0] = qpos[address] - model.qpos0[address]
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    for _ in range(round(HOLDING_TIME / model.opt.timestep)):
        mujoco.mj_step(model, data)
    force = np.zeros(model.nv)
    drives = set(np.flatnonzero(rows).tolist())
    for row in range(data.ne):
        if int(data.efc_id[row]) in drives and data.efc_type[row] == mujoco.mjtConstraint.mjCNSTR_EQUALITY:
            force[model.jnt_dofadr[model.eq_obj1id[data.efc_id[row]]]] = data.efc_force[row]
    return force


def _check_compiled(model: mujoco.MjModel, truss: Truss) -> None:
    """Hold the compiled model against the description by what both can count."""
    closures = int(np.sum(model.eq_type == mujoco.mjtEq.mjEQ_CONNECT))
    balls = int(np.sum(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL))
    members, blocks = len(truss.members), truss.ring_actuators.size  # a block and an actuator pinned to it, each a ball
    if (closures, balls) != (members + blocks, members):
        raise VgtError(
            f"compiled model has {balls} ball joints and {closures} closures for {members} members and {blocks} blocks"
        )
