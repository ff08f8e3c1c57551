"""Keyframes: the postures that a model file offers, each with servo targets that carry the weight."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, kind_of, sample_inputs, within_strokes
from vgtsim.mjcf import names
from vgtsim.mjcf.pose import qpos_from_nodes
from vgtsim.mjcf.rows import select_drive, stiffen
from vgtsim.site import Site

Poses = Mapping[str, tuple[Array, float]]

RISER_MOUTH = 0.5  # a module nearer than this to the riser's mouth is stowed in the straight keyframe, m
HOLDING_WEIGHTS = 1e-5  # on the inverse weights of an arm alone, and wherever holding forces are worked out
HOLDING_TIME = 0.1  # in which an arm under rigid drives comes to rest, s
STIFF_TUBES = 1e4  # on elastic tubes meanwhile: they must not ring
_WASTE_GAP = 1.0  # between payload and waste in the straight keyframe, m
_MOST_LEAN = 0.35  # of a mid-plane in the reach pose, rad: half of what its module bends
_SHARES = np.linspace(1.0, 0.0, 21)  # of that lean, in steps of a degree or less
_REACH_SAMPLE = 200  # configurations that the reach pose of a mixed arm is picked from


def reach_pose(chain: Chain) -> Array:
    """Inputs, shape (n,), of a pose that loads an arm much, its root being on the z axis of its mount.

    A uniform chain is bent evenly by its first modules, to the horizontal if three can, or as far as their strokes allow.
    Of any other arm it is the pose of a seeded sample whose tool is farthest from the axis.
    """
    if chain.leans:
        bent = min(3, len(chain.layout.names))
        poses = np.tile(chain.straight, (len(_SHARES), 1))
        poses[:, : 3 * bent : 3] = np.sin(_SHARES * min(np.pi / 4 / bent, _MOST_LEAN))[:, None]
        stands = within_strokes(chain, poses)
        stands[-1] = True  # the straight pose, from which strokes are measured
        return poses[int(np.argmax(stands))]
    sample = sample_inputs(chain, _REACH_SAMPLE, seed=0)
    out = chain.tool(sample)[0] - chain.mount[:3, 3]
    across = np.linalg.norm(np.cross(out, chain.mount[:3, 2]), axis=-1)
    return sample[int(np.argmax(across))]


def withdrawn_poses(site: Site) -> dict[str, tuple[Array, float]]:
    """Inputs and lift of the mast, m, of the two keyframes that do not fit under a mast at its working depth.

    Stowed: the tool at the crown, all of the arm in and above the riser. Straight: the tool a metre above the waste's top;
    what is still in the riser has to be stowed.
    """
    chain, arm, pivot, crown = site.chain, site.arm, site.scene.pivot_height, site.tank.shell.crown
    bed = site.surroundings.obstacles.bed
    top = site.tank.waste.level if bed is None else float(bed.heights.max())
    low = top + site.task.payload.radius + _WASTE_GAP
    q, height = np.array(chain.straight), low + arm.tip_plate.tool_offset
    faces = chain.frames(chain.straight)[1]
    active = len(chain.layout.names)
    for k, module in reversed(list(enumerate(arm.modules))):
        make_static = kind_of(module).make_static
        if make_static:
            height += float(make_static(module, arm.face_side).P[2])
            continue
        active -= 1
        place, m = chain.seats[active]
        columns, length = place.columns[m], float(np.linalg.norm(faces[k + 1] - faces[k]))
        if place.modules.stows and height + length > crown - RISER_MOUTH:
            q[columns] = chain.stowed[columns]
            length = float(np.linalg.norm(place.modules.at(place.take(q)[None]).frame[0, m, :, 3]))
        height += length
    stowed_length = pivot - chain.tool(chain.stowed)[0][2]
    return {"stowed": (chain.stowed, crown + stowed_length - pivot), "straight": (q, height - pivot)}


def add_keyframes(spec: mujoco.MjSpec, bare: mujoco.MjSpec, chain: Chain, poses: Poses) -> None:
    """Add keyframes from inputs and lift of the mast; the servos hold the weight as well as the lengths.

    A cylinder's target is beyond its length by what the servo gives under the holding force. The feed's servo carries mast and
    arm besides, as a counterweight does: its target is the height. Holding forces are worked out on the bare arm, without
    tank, which compiles in a fraction of the time.
    """
    model = bare.compile()
    stiffen(model, HOLDING_WEIGHTS)
    select_drive(model, "rigid")
    model.jnt_stiffness *= STIFF_TUBES
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)  # weight is held, not what a pose leans on
    joints = model.actuator_trnid[:, 0]
    address, speed, stiffness = model.jnt_qposadr[joints], model.jnt_dofadr[joints], model.actuator_gainprm[:, 0]
    rest = _holding_forces(model, model.qpos0)[speed]
    feed = model.actuator(names.servo(names.FEED)).id
    rest[np.arange(len(rest)) != feed] = 0.0
    for each in dict.fromkeys((spec, bare)):
        each.actuator(names.servo(names.FEED)).biasprm[0] = rest[feed]
    for name, (q, lift) in poses.items():
        qpos = qpos_from_nodes(model, chain.truss, chain.nodes(q) + np.array([0.0, 0.0, lift]))
        push = _holding_forces(model, qpos)[speed] - rest
        spec.add_key(name=name, qpos=qpos, ctrl=qpos[address] + push / stiffness)


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
    owner = data.efc_id[: data.ne]  # equalities come first
    driven = rows[owner]
    force[model.jnt_dofadr[model.eq_obj1id[owner[driven]]]] = data.efc_force[: data.ne][driven]
    return force
