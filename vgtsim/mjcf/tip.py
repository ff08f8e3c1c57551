"""The tip plate in MJCF: one rigid body with the last face's hubs, the tool point and the payload."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import make_hub_masses, make_plate_inertia
from vgtsim.mjcf import names
from vgtsim.mjcf.rigging import Rigging, part_bits

Array = NDArray[np.float64]


def add_tip(spec: mujoco.MjSpec, chain: Chain, nodes: Array, rigging: Rigging) -> None:
    """Add the rigid tip plate with its three hubs, the tool point and the payload.

    Args:
        spec: Changed in place.
        chain: The arm on its mount.
        nodes: Of the reference pose, in frame G, shape (N, 3), m.
        rigging: What it carries.
    """
    arm, corners = chain.manipulator, nodes[chain.truss.tip]
    R, P = chain.frames(rigging.reference)
    tip = spec.worldbody.add_body(name=names.TIP, pos=P[-1], info="tip_plate")
    mujoco.mju_mat2Quat(tip.quat, R[-1].ravel())
    tip.add_freejoint(name=names.TIP)
    bits = part_bits(chain, len(arm.modules) - 1)
    local = (corners - P[-1]) @ R[-1]
    for name, corner in zip(chain.truss.nodes[chain.truss.tip], local, strict=True):
        tip.add_site(name=name, pos=corner)
        tip.add_geom(
            name=name,
            default=spec.find_default("hub"),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[arm.hub.radius, 0, 0],
            pos=corner,
            **bits,
        )
    half = arm.tip_plate.thickness / 2
    mesh = spec.add_mesh(name=names.TIP)
    mesh.uservert = np.concatenate([local + [0, 0, -half], local + [0, 0, half]]).ravel()
    tip.add_geom(
        name=names.TIP,
        default=spec.find_default("tip"),
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=names.TIP,
        **bits,
    )
    reach = np.array([0, 0, arm.tip_plate.tool_offset])
    tip.add_geom(
        name=names.TOOL,
        default=spec.find_default("tip"),
        fromto=[0, 0, 0, *reach],
        size=[arm.hub.radius, 0, 0],
        contype=0,
        conaffinity=0,
    )
    tip.add_site(name=names.face_frame(arm.modules[-1].name))
    tip.add_site(name=names.TOOL, pos=reach, size=[0.03, 0.03, 0.03], rgba=[1, 0.85, 0, 1])
    if rigging.payload_mass:
        tip.add_geom(
            name=names.PAYLOAD,
            default=spec.find_default("payload"),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[rigging.payload_radius, 0, 0],
            pos=reach,
            **bits,
        )
    hubs = make_hub_masses(arm, chain.truss, lumped=rigging.lumped)[chain.truss.tip]
    _set_tip_inertia(tip, arm, hubs, local, reach, rigging)


def _set_tip_inertia(
    tip: mujoco.MjsBody, arm: Manipulator, hubs: Array, corners: Array, reach: Array, rigging: Rigging
) -> None:
    """Plate, corner hubs of given masses and payload as one body."""
    plate = make_plate_inertia(arm)
    points = np.concatenate([np.zeros((1, 3)), corners, reach[None]])
    masses = np.array([plate.mass, *hubs, rigging.payload_mass])
    balls = 0.4 * (3 * arm.hub_mass * arm.hub.radius**2 + rigging.payload_mass * rigging.payload_radius**2)
    centre = masses @ points / masses.sum()
    offset = points - centre
    spread = np.einsum("p,pi,pj->ij", masses, offset, offset)
    tensor = np.diag(plate.moments) + balls * np.eye(3) + np.trace(spread) * np.eye(3) - spread
    tip.explicitinertial = True
    tip.mass, tip.ipos = float(masses.sum()), centre
    tip.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
