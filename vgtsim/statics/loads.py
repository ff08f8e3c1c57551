"""Weight and inertia of the members, hubs, tip plate and payload as forces at the nodes.

A point of a member's near segment, at distance s from the near hub, moves with p1 + s û; one of the far segment, at
distance e from the far hub, with p2 - e û. Its mass dm loads the member with dm (g - a). The transverse part goes to the
two hubs by moment equilibrium about them, which is exact and holds the rotary inertia; the axial part goes to the
segment's own hub, so that the bar force left between them is the force where the segments meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import by_rows, compiled
from vgtsim.description.conveyance import Conveyance
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, Truss
from vgtsim.kinematics.inertia import (
    MemberInertia,
    PlateInertia,
    make_block_inertia,
    make_hub_masses,
    make_line_masses,
    make_member_inertia,
    make_plate_inertia,
)
from vgtsim.kinematics.vectors import cross, dot
from vgtsim.statics.line import hose_couples
from vgtsim.statics.motion import NodeMotion

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class LoadModel:
    """Everything that weighs and resists acceleration: members, posts of joint blocks, tip plate and payload.

    Attributes:
        face_side: Side b of the tip plate, m.
        tool_offset: Distance of the payload's centre from the last face along its normal, m.
        hub_mass: Of the nodes, with the members' mass where it is lumped and with the line's on the faces, shape (N,), kg.
        gravity: Acceleration of gravity in frame G, shape (3,), m/s².
        hose: Stiffness in bending of the hose through the arm, N·m².
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
    hose: float = 0.0

    @property
    def mass(self) -> float:
        """Mass of the arm with hubs and payload, kg."""
        parts = self.members.mass.sum() + self.blocks.mass.sum() + self.hub_mass.sum()
        return float(parts) + self.plate.mass + self.payload.mass


@dataclass(frozen=True)
class MemberLoads:
    """Weight and inertia of each member, shared between its near and far hubs, shape (..., M, 3), N; in frame G.

    `direction` is the unit vector from the near to the far hub, shape (..., M, 3); `total` are the sums at the nodes, shape
    (..., N, 3), N.
    """

    direction: Array
    near: Array
    far: Array
    total: Array


def make_load_model(
    chain: Chain,
    payload: Payload,
    gravity: float,
    *,
    split: bool = False,
    lumped: bool = False,
    line: Conveyance | None = None,
) -> LoadModel:
    """Collect masses from the description, of the line through the arm too; gravity is m/s² along -z of frame G.

    `split` makes each tube two halves that move with their own hubs along it, as elastic members do. `lumped` puts the
    members' mass into their hubs: then a member carries one axial force and nothing else.
    """
    arm = chain.manipulator
    down, hubs = np.array([0.0, 0.0, -gravity]), make_hub_masses(arm, chain.truss, lumped=lumped)
    if line is not None:
        hubs += make_line_masses(chain, line.density)
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
        hose=line.bending_stiffness if line else 0.0,
    )


def weigh(chain: Chain) -> float:
    """Mass of an arm with hubs and tip plate, without payload, kg."""
    return make_load_model(chain, Payload(mass=0.0, radius=1.0), 0.0).mass


def member_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> MemberLoads:
    """Share each member's weight and inertia between its two hubs, for nodes of shape (..., N, 3), m; no motion is rest.

    Source: moment equilibrium of each segment about the member's ends; no counterpart in the dissertation.
    """
    return _share(model, model.truss.ends, model.members, nodes, motion)


def block_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> MemberLoads:
    """As `member_loads` for the posts of the joint blocks, between feet and heads."""
    return _share(model, model.truss.rings[:, :, [0, 2]].reshape(-1, 2), model.blocks, nodes, motion)


def _share(
    model: LoadModel, ends: Index, inertia: MemberInertia, nodes: Array, motion: NodeMotion | None
) -> MemberLoads:
    flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
    moved = () if motion is None else (motion.velocity, motion.acceleration)
    velocity, acceleration = [by_rows(item.reshape(flat.shape)) for item in moved] or [np.empty((0, 0, 0))] * 2
    shares, total = np.empty((3, len(flat), len(ends), 3)), np.zeros(flat.shape)
    parts, gravity = np.array([inertia.mass, inertia.first_moment, inertia.about_end]), np.array(model.gravity, float)
    _fill_shares(np.array(ends, np.intp), parts, gravity, flat, velocity, acceleration, shares, total)
    direction, near, far = shares.reshape(3, *nodes.shape[:-2], len(ends), 3)
    return MemberLoads(direction, near, far, total.reshape(nodes.shape))


@compiled
def _fill_shares(
    ends: Index,
    inertia: Array,
    gravity: Array,
    nodes: Array,
    velocity: Array,
    acceleration: Array,
    shares: Array,
    total: Array,
) -> None:
    """Directions of bodies of two segments and their loads at either end, shape (3, T, M, 3), and the sums at the nodes.

    `inertia` has masses, first moments and moments of inertia about the ends, shape (3, M, 2). Velocities and accelerations
    are empty at rest.
    """
    unit, turn, spin, second = np.empty(3), np.zeros(3), np.empty(3), np.empty(3)
    pull, cross = np.empty((2, 3)), np.empty((2, 3))
    for t in range(len(nodes)):
        for m in range(len(ends)):
            i, j = ends[m, 0], ends[m, 1]
            square = 0.0
            for k in range(3):
                unit[k] = nodes[t, j, k] - nodes[t, i, k]
                square += unit[k] * unit[k]
            length = np.sqrt(square)
            for k in range(3):
                unit[k] /= length
                pull[0, k] = pull[1, k] = gravity[k]
            if len(velocity):
                # the second time derivative of the unit vector: its turning, and the pull inwards as it turns
                stretch = along = spun = 0.0
                for k in range(3):
                    spin[k] = velocity[t, j, k] - velocity[t, i, k]
                    second[k] = acceleration[t, j, k] - acceleration[t, i, k]
                    stretch += spin[k] * unit[k]
                    along += second[k] * unit[k]
                    pull[0, k] -= acceleration[t, i, k]
                    pull[1, k] -= acceleration[t, j, k]
                for k in range(3):
                    spin[k] = (spin[k] - stretch * unit[k]) / length
                    spun += spin[k] * spin[k]
                for k in range(3):
                    turn[k] = (second[k] - along * unit[k] - 2 * stretch * spin[k]) / length - spun * unit[k]
            for s in range(2):
                sign, lean = 1.0 - 2.0 * s, 0.0
                for k in range(3):
                    cross[s, k] = inertia[1, m, s] * pull[s, k] - sign * inertia[2, m, s] * turn[k]
                    lean += cross[s, k] * unit[k]
                for k in range(3):
                    cross[s, k] = (cross[s, k] - lean * unit[k]) / length
            for k in range(3):
                exchange = cross[1, k] - cross[0, k]
                near = inertia[0, m, 0] * pull[0, k] - inertia[1, m, 0] * turn[k] + exchange
                far = inertia[0, m, 1] * pull[1, k] + inertia[1, m, 1] * turn[k] - exchange
                shares[0, t, m, k], shares[1, t, m, k], shares[2, t, m, k] = unit[k], near, far
                total[t, i, k] += near
                total[t, j, k] += far


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


def hub_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> Array:
    """Weight and inertia of hubs, tip plate and payload as forces at the nodes, shape (..., N, 3), N.

    Nodes have shape (..., N, 3), m; no motion is rest. The wrench of plate and payload stands at the last three nodes, as the
    least forces that are equivalent to it.
    """
    force = np.empty(nodes.shape)
    force[...] = model.hub_mass[:, None] * (model.gravity if motion is None else model.gravity - motion.acceleration)
    force[..., model.truss.tip, :] += _tip_forces(model, nodes, motion)
    return force + hose_forces(model, nodes) if model.hose else force


def hose_forces(model: LoadModel, nodes: Array) -> Array:
    """Forces at the nodes, shape (..., N, 3), N, of a hose that is bent with the arm, for nodes of shape (..., N, 3), m."""
    flat = nodes.reshape(-1, *nodes.shape[-2:])
    couples = hose_couples(model.truss, model.hose, flat)
    x, y = _face_axes(flat[:, model.truss.faces], model.face_side)
    spread = _spread(np.zeros(couples.shape), couples, (x, y, cross(x, y)), model.face_side)
    total = np.zeros(flat.shape)
    for face, forces in zip(model.truss.faces, spread.swapaxes(0, 1), strict=True):
        total[:, face] += forces
    return total.reshape(nodes.shape)


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
