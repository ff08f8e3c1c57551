"""Mast and hubs in MJCF: the pipe on its feed, which may turn as well, with the three hubs of the flange, and the free hubs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from vgtsim.geometry import MastPipe
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import add_drives, add_force_sensors
from vgtsim.mjcf.rigging import TANK, Rigging

_MAST = -1  # in place of a module's index


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
