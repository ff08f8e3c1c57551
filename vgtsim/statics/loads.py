"""Weight and inertia of the members, hubs, tip plate and payload as forces at the nodes.

A point of a member's near segment, at distance s from the near hub, moves with p1 + s û; one of the far segment, at
distance e from the far hub, with p2 - e û. Its mass dm loads the member with dm (g - a). The transverse part goes to the
two hubs by moment equilibrium about them, which is exact and holds the rotary inertia; the axial part goes to the
segment's own hub, so that the bar force left between them is the force where the segments meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, Truss
from vgtsim.kinematics.inertia import (
    MemberInertia,
    PlateInertia,
    make_block_inertia,
    make_hub_masses,
    make_member_inertia,
    make_plate_inertia,
)
from vgtsim.kinematics.vectors import across, cross, dot
from vgtsim.statics.motion import NodeMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoadModel:
    """Everything that weighs and resists acceleration: members, posts of joint blocks, tip plate and payload.

    Attributes:
        face_side: Side b of the tip plate, m.
        tool_offset: Distance of the payload's centre from the last face along its normal, m.
        hub_mass: Of the nodes, with the members' mass where it is lumped, shape (N,), kg.
        gravity: Acceleration of gravity in frame G, shape (3,), m/s².
    """

    truss: Truss
    members: MemberInertia
    blocks: MemberInertia
    plate: PlateInertia
    face_side: float
    tool_offset: float
    hub_mass: Array
    payload: Payload
    gravity: Array

    @property
    def mass(self) -> float:
        """Mass of the arm with hubs and payload, kg."""
        parts = self.members.mass.sum() + self.blocks.mass.sum() + self.hub_mass.sum()
        return float(parts) + self.plate.mass + self.payload.mass

    @cached_property
    def member_parts(self) -> _Parts:
        """The members' segments."""
        return _Parts(self.truss.ends, self.members)

    @cached_property
    def block_parts(self) -> _Parts:
        """The posts of the joint blocks, between feet and heads."""
        return _Parts(self.truss.rings[:, :, [0, 2]].reshape(-1, 2), self.blocks)


class _Parts:
    """Bodies of two segments between two nodes each, as `_share` needs them; near and far apart, shapes (M, 1)."""

    def __init__(self, ends: NDArray[np.intp], inertia: MemberInertia) -> None:
        self.ends = ends
        columns = (inertia.mass, inertia.first_moment, inertia.about_end)
        self.mass, self.first_moment, self.about_end = (np.moveaxis(item, -1, 0)[..., None] for item in columns)


@dataclass(frozen=True)
class MemberLoads:
    """Weight and inertia of each member, shared between its near and far hubs, shape (..., M, 3), N; in frame G.

    `direction` is the unit vector from the near to the far hub, shape (..., M, 3).
    """

    direction: Array
    near: Array
    far: Array


def make_load_model(
    chain: Chain, payload: Payload, gravity: float, *, split: bool = False, lumped: bool = False
) -> LoadModel:
    """Collect masses from the description; gravity is m/s² along -z of frame G.

    `split` makes each tube two halves that move with their own hubs along it, as elastic members do. `lumped` puts the
    members' mass into their hubs: then a member carries one axial force and nothing else.
    """
    arm = chain.manipulator
    down, hubs = np.array([0.0, 0.0, -gravity]), make_hub_masses(arm, chain.truss, lumped=lumped)
    down.flags.writeable = hubs.flags.writeable = False
    return LoadModel(
        truss=chain.truss,
        members=make_member_inertia(arm, chain.truss, split=split, lumped=lumped),
        blocks=make_block_inertia(arm, chain.truss),
        plate=make_plate_inertia(arm),
        face_side=arm.face_side,
        tool_offset=arm.tip_plate.tool_offset,
        hub_mass=hubs,
        payload=payload,
        gravity=down,
    )


def weigh(chain: Chain) -> float:
    """Mass of an arm with hubs and tip plate, without payload, kg."""
    return make_load_model(chain, Payload(mass=0.0, radius=1.0), 0.0).mass


def member_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> MemberLoads:
    """Share each member's weight and inertia between its two hubs, for nodes of shape (..., N, 3), m; no motion is rest.

    Source: moment equilibrium of each segment about the member's ends; no counterpart in the dissertation.
    """
    return _share(model.member_parts, model.gravity, nodes, motion)


def add_up(truss: Truss, loads: MemberLoads) -> Array:
    """Loads of members added up at their nodes, shape (..., N, 3), N."""
    near, far = _selections(truss)
    return near @ loads.near + far @ loads.far


@lru_cache(maxsize=64)
def _selections(truss: Truss) -> tuple[Array, Array]:
    """Matrices that add up values of members at their near and at their far nodes, shapes (N, M)."""
    node = np.arange(len(truss.nodes))[:, None]
    return (node == truss.ends[:, 0]).astype(float), (node == truss.ends[:, 1]).astype(float)


def block_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> MemberLoads:
    """As `member_loads` for the posts of the joint blocks, between feet and heads."""
    return _share(model.block_parts, model.gravity, nodes, motion)


def _share(parts: _Parts, gravity: Array, nodes: Array, motion: NodeMotion | None) -> MemberLoads:
    first, second = parts.ends[:, 0], parts.ends[:, 1]
    span = nodes[..., second, :] - nodes[..., first, :]
    length = np.sqrt(dot(span, span))
    unit = span / length
    mass, first_moment, about_end = parts.mass, parts.first_moment, parts.about_end
    pulls, turn = [gravity, gravity], 0.0
    if motion is not None:
        pulls = [gravity - motion.acceleration[..., end, :] for end in (first, second)]
        turn = _direction_acceleration(parts.ends, unit, length, motion)
    crossed1 = across(first_moment[0] * pulls[0] - about_end[0] * turn, unit) / length
    crossed2 = across(first_moment[1] * pulls[1] + about_end[1] * turn, unit) / length
    exchange = crossed2 - crossed1
    near = mass[0] * pulls[0] - first_moment[0] * turn + exchange
    far = mass[1] * pulls[1] + first_moment[1] * turn - exchange
    return MemberLoads(unit, near, far)


def tool_point(model: LoadModel, nodes: Array) -> Array:
    """Tool point from the tip nodes, shape (..., 3), m, for nodes of shape (..., N, 3)."""
    corner = nodes[..., model.truss.tip, :]
    x, y = _face_axes(corner, model.face_side)
    return corner.mean(axis=-2) + model.tool_offset * cross(x, y)


def tool_forces(model: LoadModel, nodes: Array, wrench: Array) -> Array:
    """Least forces at all nodes, shape (..., N, 3), N, that make up a wrench on the tool.

    Nodes have shape (..., N, 3), m; the wrench is force and moment about the tool point, shape (..., 6), N and N·m, frame G.
    """
    x, y = _face_axes(nodes[..., model.truss.tip, :], model.face_side)
    z = cross(x, y)
    force = np.broadcast_to(wrench[..., :3], z.shape)
    moment = wrench[..., 3:] + cross(model.tool_offset * z, force)
    total = np.zeros(nodes.shape)
    total[..., model.truss.tip, :] = _spread(force, moment, (x, y, z), model.face_side)
    return total


def _direction_acceleration(ends: NDArray[np.intp], unit: Array, length: Array, motion: NodeMotion) -> Array:
    """Second time derivative of the members' unit vectors, shape (..., M, 3), 1/s², for lengths of shape (..., M, 1), m."""
    first, second = ends[:, 0], ends[:, 1]
    rate, second_rate = (v[..., second, :] - v[..., first, :] for v in (motion.velocity, motion.acceleration))
    stretch = dot(rate, unit)
    spin = (rate - stretch * unit) / length
    turning = (across(second_rate, unit) - 2 * stretch * spin) / length
    return turning - dot(spin, spin) * unit


def hub_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> Array:
    """Weight and inertia of hubs, tip plate and payload as forces at the nodes, shape (..., N, 3), N.

    Nodes have shape (..., N, 3), m; no motion is rest. The wrench of plate and payload stands at the last three nodes, as the
    least forces that are equivalent to it.
    """
    force = np.empty(nodes.shape)
    force[...] = model.hub_mass[:, None] * (model.gravity if motion is None else model.gravity - motion.acceleration)
    force[..., model.truss.tip, :] += _tip_forces(model, nodes, motion)
    return force


def _tip_forces(model: LoadModel, nodes: Array, motion: NodeMotion | None) -> Array:
    """Forces at the three tip nodes, shape (..., 3, 3), N."""
    tip, side, payload = model.truss.tip, model.face_side, model.payload
    x, y = _face_axes(nodes[..., tip, :], side)
    z = cross(x, y)
    centre_pull = tool_pull = model.gravity
    rotary: Array | float = 0.0
    if motion is not None:
        centre_pull = model.gravity - motion.acceleration[..., tip, :].mean(axis=-2)
        dx, dy = _face_axes(motion.velocity[..., tip, :], side)
        ddx, ddy = _face_axes(motion.acceleration[..., tip, :], side)
        ddz = cross(ddx, y) + 2 * cross(dx, dy) + cross(x, ddy)
        tool_pull = centre_pull - model.tool_offset * ddz
        ball = payload.mass * payload.radius**2 / 5  # second moment of a solid ball about its centre
        for axis, change, moment in zip((x, y, z), (ddx, ddy, ddz), model.plate.second_moments, strict=True):
            rotary = rotary - (moment + ball) * cross(axis, change)
    load = payload.mass * tool_pull
    moment = model.tool_offset * cross(z, load) + rotary
    return _spread(model.plate.mass * centre_pull + load, moment, (x, y, z), side)


def _spread(force: Array, moment: Array, axes: tuple[Array, Array, Array], side: float) -> Array:
    """Least forces at the corners of a triangle that make up a force and a moment about its centroid, shape (..., 3, 3)."""
    x, y, z = axes
    lever = (2 * moment - dot(moment, z) * z) / side**2
    low, high = side / (2 * np.sqrt(3)), side / np.sqrt(3)  # distances of a side and of a corner from the centroid
    corners = np.stack([x * side / 2 - y * low, y * high, -x * side / 2 - y * low], axis=-2)
    return force[..., None, :] / 3 + cross(lever[..., None, :], corners)


def _face_axes(corners: Array, side: float) -> tuple[Array, Array]:
    """X and Y axes of a face from its corners, shape (..., 3, 3), or the derivatives of both."""
    n1, n2, n3 = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    return (n1 - n3) / side, (2 * n2 - n1 - n3) / (np.sqrt(3) * side)
