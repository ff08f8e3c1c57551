"""Stands an arm in given poses under rigid drives, without scene or tank, and reads what its members carry."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import mujoco
import numpy as np

from vgtsim.description import Manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.mjcf import build_arm_spec, fill_qpos, make_pose_map, names, select_drive, stiffen
from vgtsim.plant.gauges import MemberGauges
from vgtsim.plant.recorder import Recorder
from vgtsim.statics import make_load_model, solve_members

STEP = 0.005  # s
STILL = 1e-8  # m/s: a speed lost in one step is an acceleration of 2e-6 m/s²
PATIENCE = 400  # steps
WAY = 501  # steps from one pose to the next: 2.5 s


@dataclass(frozen=True)
class Standing:
    """What was measured, a row for each pose; forces as in `verification.loads`.

    `moment` is that at members with a ball at each end; `bending` and its `bending_error`, torsion and moments about the
    pins included, are those at the near pins of actuators between joint blocks.
    """

    closure: np.ndarray
    agreement: np.ndarray
    moment: np.ndarray
    shear: np.ndarray
    axial: np.ndarray
    forces: np.ndarray
    bending: np.ndarray
    bending_error: np.ndarray


def stand(manipulator: Manipulator, poses: np.ndarray, moved: bool = False, lumped: bool = False) -> Standing:
    """Hold each of the poses until it is still; `moved` comes to each from the one before through all between."""
    spec = build_arm_spec(manipulator, STEP, lumped=lumped, limited=False)
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    model = spec.compile()
    stiffen(model, 1e-5)
    select_drive(model, "rigid")
    chain = Chain(manipulator, hanging_mount(float(model.body(names.MAST).pos[2])))
    truss = chain.truss
    pose, recorder = make_pose_map(model, truss), Recorder(MemberGauges(model, SimpleNamespace(truss=truss)))
    actuators = [truss.member_names[i] for i in truss.actuated]
    rows = np.array([model.equality(names.drive(name)).id for name in actuators])
    at = recorder.gauges.at
    zero = model.qpos0[at.position]
    data = mujoco.MjData(model)
    balls = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_BALL
    felt = ~balls if lumped else np.full(model.nv, True)  # rounding spins a member without mass about its axis
    wanted = chain.lengths(poses)
    fill_qpos(pose, truss, chain.nodes(poses[0]), data.qpos)
    for k, q in enumerate(poses):
        if moved and k:
            for s in np.linspace(0, 1, WAY):
                model.eq_data[rows, 0] = wanted[k - 1] + s * s * (3 - 2 * s) * (wanted[k] - wanted[k - 1]) - zero
                mujoco.mj_step(model, data)
        else:
            fill_qpos(pose, truss, chain.nodes(q), data.qpos)
            data.qvel[:] = 0
        model.eq_data[rows, 0] = wanted[k] - zero
        for _ in range(PATIENCE):
            mujoco.mj_step(model, data)
            if np.abs(data.qvel[felt]).max() < STILL:
                break
        noted = recorder.gauges.note(data)
        mujoco.mj_step(model, data)
        recorder.record(
            data,
            time=float(k),
            commanded=wanted[k],
            noted=noted,
            goal=0,
            settled=True,
        )
    return _measure(chain, vars(recorder.make_log((), {}, "", {})), lumped)


def _measure(chain: Chain, log: dict, lumped: bool) -> Standing:
    truss = chain.truss
    q = chain.inputs_from_lengths(log["actual"])
    along = log["ends"][:, :, 1] - log["ends"][:, :, 0]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    axial = np.einsum("tmk,tmk->tm", log["member_force"], along)
    model = make_load_model(chain, Payload(mass=0.0, radius=0.1), 9.80665, lumped=lumped)
    expected = solve_members(model, log["nodes"])
    shear = log["member_force"] - axial[..., None] * along - expected.near_transverse
    pinned = truss.ring_actuators.ravel()
    balls = np.setdiff1d(np.arange(len(truss.members)), pinned)
    off = log["member_moment"] - expected.near_moment
    largest = np.abs(expected.near_axial).max(axis=-1, keepdims=True)
    return Standing(
        np.linalg.norm(log["ends"] - log["nodes"][:, truss.ends], axis=-1).max(axis=-1),
        np.linalg.norm(log["nodes"] - chain.nodes(q), axis=-1),
        np.linalg.norm(log["member_moment"][:, balls], axis=-1),
        np.linalg.norm(shear, axis=-1),
        np.abs(axial - expected.near_axial) / largest,
        axial,
        np.linalg.norm(log["member_moment"][:, pinned], axis=-1),
        np.linalg.norm(off[:, pinned], axis=-1),
    )
