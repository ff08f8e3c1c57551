"""Mast, hubs and tip plate in MJCF.

The mast is a pipe on its feed, which may turn as well, with the three hubs of the flange. The tip plate is one rigid body with
the last face's hubs, the tool point and the payload; the other hubs are free.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from vgtsim.arrays import Array
from vgtsim.geometry import MastPipe
from vgtsim.graphics import mujoco
from vgtsim.kinematics import make_plate_inertia
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import add_drives, add_force_sensors, set_point_masses
from vgtsim.mjcf.rigging import TANK, Rigging

_MAST = -1  # in place of a module's index
_LEAST_STEM = 1e-3  # m: a shorter stem is inside the plate, and MuJoCo draws none of no length


def add_fixed_hubs(spec: mujoco.MjSpec, rigging: Rigging, nodes: Iterable[int]) -> dict[int, mujoco.MjsBody]:
    """Add mast, feed and flange, and hubs that are fixed to it; returns the hubs by node."""
    flange, foot, hubs = _add_mast(spec, rigging), rigging.chain.mount[:3, 3], {}
    for node in nodes:
        hubs[node] = flange.add_body(name=rigging.chain.truss.nodes[node], pos=rigging.nodes[node] - foot)
        _dress_hub(spec, hubs[node], rigging, node)
    return hubs


def add_free_hub(spec: mujoco.MjSpec, rigging: Rigging, node: int) -> mujoco.MjsBody:
    """Add the hub at a node, a point mass on three slides."""
    name = rigging.chain.truss.nodes[node]
    hub = spec.worldbody.add_body(name=name, pos=rigging.nodes[node], info=name)
    for joint, axis in zip(names.slides(name), np.eye(3), strict=True):
        hub.add_joint(name=joint, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    _dress_hub(spec, hub, rigging, node)
    return hub


def _dress_hub(spec: mujoco.MjSpec, hub: mujoco.MjsBody, rigging: Rigging, node: int) -> None:
    """Add ball, site and mass of a hub."""
    arm = rigging.chain.manipulator
    add_ball(spec, hub, rigging, node)
    hub.add_site(name=rigging.chain.truss.nodes[node])
    hub.explicitinertial = True
    hub.ipos = [0, 0, 0]  # without a place MuJoCo writes no inertia into the XML
    hub.mass, hub.inertia = rigging.hub_masses[node], [0.4 * arm.hub_mass * arm.hub.radius**2] * 3  # a solid ball's


def _add_mast(spec: mujoco.MjSpec, rigging: Rigging) -> mujoco.MjsBody:
    """Add mast and feed; returns the flange."""
    pipe, mount = rigging.mast, rigging.chain.mount
    mast = spec.worldbody.add_body(name=names.MAST, pos=mount[:3, 3])
    mast.add_joint(spec.find_default(names.FEED), name=names.FEED, info="mast")
    bits = rigging.bits(_MAST)
    mast.add_geom(
        name=names.MAST,
        default=spec.find_default("mast"),
        size=[pipe.outer_diameter / 2, pipe.length / 2, 0],
        pos=[0, 0, pipe.length / 2],
        contype=bits["contype"],
        conaffinity=bits["conaffinity"] & (~TANK if rigging.guided else ~0),
    )
    _set_pipe_inertia(mast, pipe)
    add_drives(spec, names.FEED, names.FEED, names.FEED)
    if rigging.turn is not None:
        mast.add_joint(spec.find_default(names.TURN), name=names.TURN, info="mast")
        add_drives(spec, names.TURN, names.TURN, names.TURN)
    flange = mast.add_body(name=names.FLANGE)
    flange.add_site(name=names.FLANGE, zaxis=mount[:3, 2])
    add_force_sensors(spec, names.FLANGE, names.FLANGE)
    return flange


def _set_pipe_inertia(body: mujoco.MjsBody, pipe: MastPipe) -> None:
    radius, length = pipe.outer_diameter / 2, pipe.length
    inner = radius - pipe.wall
    mass = pipe.density * np.pi * (radius**2 - inner**2) * length
    across = mass * (3 * (radius**2 + inner**2) + length**2) / 12
    body.explicitinertial = True
    body.mass, body.ipos = mass, [0, 0, length / 2]
    body.inertia = [across, across, mass * (radius**2 + inner**2) / 2]


def add_ball(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    rigging: Rigging,
    node: int,
    place: tuple[float, float, float] = (0, 0, 0),
) -> None:
    """Add the ball of a hub to a body, at a place in its frame, m."""
    truss, radius = rigging.chain.truss, rigging.chain.manipulator.hub.radius
    body.add_geom(
        name=truss.nodes[node],
        default=spec.find_default("hub"),
        size=[radius, 0, 0],
        pos=place,
        **rigging.bits(int(truss.node_module[node])),
    )


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
