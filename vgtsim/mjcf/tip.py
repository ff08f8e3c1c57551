"""The tip plate in MJCF: one rigid body with the last face's hubs, the tool point and the payload."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.kinematics import make_plate_inertia
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import set_point_masses
from vgtsim.mjcf.hubs import add_ball
from vgtsim.mjcf.rigging import Rigging


def add_tip(spec: mujoco.MjSpec, rigging: Rigging, nodes: Sequence[int] | None = None) -> None:
    """Add the rigid tip plate with its three hubs, the tool point and the payload.

    Further nodes may be fixed to it; they are then listed with its three, which come last.
    """
    arm, truss = rigging.chain.manipulator, rigging.chain.truss
    R, P = rigging.chain.frames(rigging.reference)
    tip = spec.worldbody.add_body(name=names.TIP, pos=P[-1], info="tip_plate")
    mujoco.mju_mat2Quat(tip.quat, R[-1].ravel())
    tip.add_freejoint(name=names.TIP)
    nodes = nodes or range(len(truss.nodes))[truss.tip]
    places = (rigging.nodes[nodes] - P[-1]) @ R[-1]
    for node, place in zip(nodes, places, strict=True):
        tip.add_site(name=truss.nodes[node], pos=place)
        add_ball(spec, tip, rigging, node, tuple(place))
    reach = np.array([0, 0, arm.tip_plate.tool_offset])
    _dress_tip(spec, tip, rigging, places[-3:], reach)
    hubs = rigging.hub_masses[nodes]
    plate, load = make_plate_inertia(arm), rigging.payload
    tensor = np.diag(plate.moments) + 0.4 * load.mass * load.radius**2 * np.eye(3)  # a solid ball's
    tensor += 0.4 * len(nodes) * arm.hub_mass * arm.hub.radius**2 * np.eye(3)
    points = np.concatenate([np.zeros((1, 3)), places, reach[None]])
    set_point_masses(tip, np.array([plate.mass, *hubs, load.mass]), points, tensor)


_LEAST_STEM = 1e-3  # m: a shorter stem is inside the plate, and MuJoCo draws none of no length


def _dress_tip(spec: mujoco.MjSpec, tip: mujoco.MjsBody, rigging: Rigging, corners: Array, reach: Array) -> None:
    """Add plate, tool and payload."""
    arm = rigging.chain.manipulator
    bits, half = rigging.bits(len(arm.modules) - 1), arm.tip_plate.thickness / 2
    mesh = spec.add_mesh(name=names.TIP)
    mesh.uservert = np.concatenate([corners + [0, 0, -half], corners + [0, 0, half]]).ravel()
    shown, shape = spec.find_default("tip"), mujoco.mjtGeom
    tip.add_geom(name=names.TIP, default=shown, type=shape.mjGEOM_MESH, meshname=names.TIP, **bits)
    if reach[2] > _LEAST_STEM:
        size, stem = [arm.hub.radius, 0, 0], [0, 0, 0, *reach]
        tip.add_geom(name=names.TOOL, default=shown, fromto=stem, size=size, contype=0, conaffinity=0)
    tip.add_site(name=names.face_frame(arm.modules[-1].name))
    tip.add_site(name=names.TOOL, pos=reach, size=[0.03, 0.03, 0.03], rgba=[1, 0.85, 0, 1])
    if rigging.payload.mass:
        tip.add_geom(
            name=names.PAYLOAD,
            default=spec.find_default("payload"),
            size=[rigging.payload.radius, 0, 0],
            pos=reach,
            **bits,
        )
