"""Weight and inertia of the members, hubs, tip plate and payload as forces at the nodes.

A point of a member's near segment, at distance s from the near hub, moves with p1 + s û; one of the far segment, at
distance e from the far hub, with p2 - e û. Its mass dm loads the member with dm (g - a). The transverse part goes to the
two hubs by moment equilibrium about them, which is exact and holds the rotary inertia; the axial part goes to the
segment's own hub, so that the bar force left between them is the force where the segments meet.

A bent hose in the arm lies in an arc between two faces, whose curvature times its stiffness EI is the couple with which it
straightens. It slides in the faces, so it carries no force along itself. Its weight stands in `LoadModel.hub_mass`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.description import Conveyance, Payload
from vgtsim.kinematics import (
    Chain,
    MemberInertia,
    PlateInertia,
    Truss,
    find_axis,
    make_block_inertia,
    make_hub_masses,
    make_line_masses,
    make_member_inertia,
    make_plate_inertia,
)
from vgtsim.statics.face_loads import bend_faces, load_hubs, place_tool, push_tool
from vgtsim.statics.motion import NodeMotion

_REST = np.empty((0, 0, 0))  # velocities of no motion, for compiled functions


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

    @cached_property
    def units(self) -> tuple[LoadModel, ...]:
        """The arm without payload under 1 m/s² along each axis; then weightless without payload, and weightless with it."""
        bare = replace(self, payload=self.payload.model_copy(update={"mass": 0.0}))
        pulled = [replace(bare, gravity=axis) for axis in np.eye(3)]
        return (*pulled, *(replace(model, gravity=np.zeros(3)) for model in (bare, self)))

    @cached_property
    def member_bodies(self) -> tuple[Index, Array]:
        """Nodes of each member, shape (M, 2), and masses, first moments and moments of inertia about the ends, (3, M, 2)."""
        return _tabulate(self.truss.ends, self.members)

    @cached_property
    def massless(self) -> bool:
        """Whether members have no mass along them: it is in their hubs."""
        return not self.member_bodies[1].any()

    @cached_property
    def block_bodies(self) -> tuple[Index, Array]:
        """The same of the posts of the joint blocks, from foot to head."""
        return _tabulate(self.truss.rings[:, :, [0, 2]].reshape(-1, 2), self.blocks)

    @cached_property
    def figures(self) -> tuple[Array, Array, Array]:
        """Gravity, masses of the hubs and figures of the tip, see `face_loads`, as compiled functions take them."""
        ball = self.payload.mass * self.payload.radius**2 / 5  # second moment of a solid ball about its centre
        second = [moment + ball for moment in self.plate.second_moments]
        tip = [self.face_side, self.tool_offset, self.plate.mass, self.payload.mass, *second]
        return np.array(self.gravity, float), np.array(self.hub_mass, float), np.array(tip, float)


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
    down, hubs = np.array([0.0, 0.0, -gravity]), make_hub_masses(chain, lumped=lumped)
    if line is not None:
        hubs += make_line_masses(chain, line.density)
    down.flags.writeable = hubs.flags.writeable = False
    return LoadModel(
        truss=chain.truss,
        members=make_member_inertia(chain, split=split, lumped=lumped),
        blocks=make_block_inertia(chain),
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
    return _share(model, model.member_bodies, nodes, motion)


def block_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> MemberLoads:
    """As `member_loads` for the posts of the joint blocks, between feet and heads."""
    return _share(model, model.block_bodies, nodes, motion)


def _share(model: LoadModel, bodies: tuple[Index, Array], nodes: Array, motion: NodeMotion | None) -> MemberLoads:
    ends, inertia = bodies
    flat, velocity, acceleration = _flatten(nodes, motion)
    shares, total = np.empty((3, len(flat), len(ends), 3)), np.zeros(flat.shape)
    _fill_shares(ends, inertia, model.figures[0], flat, velocity, acceleration, shares, total)
    direction, near, far = shares.reshape(3, *nodes.shape[:-2], len(ends), 3)
    return MemberLoads(direction, near, far, total.reshape(nodes.shape))


def _tabulate(ends: Index, inertia: MemberInertia) -> tuple[Index, Array]:
    return np.array(ends, np.intp, order="C"), np.array([inertia.mass, inertia.first_moment, inertia.about_end])


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
    flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
    point = np.empty((len(flat), 3))
    place_tool(model.figures[2], flat, point)
    return point.reshape(*nodes.shape[:-2], 3)


def tool_forces(model: LoadModel, nodes: Array, wrench: Array) -> Array:
    """Least forces at all nodes, shape (..., N, 3), N, that make up a wrench on the tool.

    Nodes have shape (..., N, 3), m; the wrench is force and moment about the tool point, shape (..., 6), N and N·m, frame G.
    """
    flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
    wrenches, total = np.broadcast_to(wrench, (*nodes.shape[:-2], 6)).reshape(-1, 6), np.zeros(flat.shape)
    push_tool(model.figures[2], flat, by_rows(wrenches), total)
    return total.reshape(nodes.shape)


def hub_loads(model: LoadModel, nodes: Array, motion: NodeMotion | None = None) -> Array:
    """Weight and inertia of hubs, tip plate and payload as forces at the nodes, shape (..., N, 3), N.

    Nodes have shape (..., N, 3), m; no motion is rest. The wrench of plate and payload stands at the last three nodes, as the
    least forces that are equivalent to it.
    """
    flat, velocity, acceleration = _flatten(nodes, motion)
    gravity, hubs, tip = model.figures
    force = np.empty(flat.shape)
    load_hubs(tip, hubs, gravity, flat, velocity, acceleration, force)
    if model.hose:
        _bend_hose(model, flat, force)
    return force.reshape(nodes.shape)


def hose_forces(model: LoadModel, nodes: Array) -> Array:
    """Forces at the nodes, shape (..., N, 3), N, of a hose that is bent with the arm, for nodes of shape (..., N, 3), m."""
    flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
    total = np.zeros(flat.shape)
    _bend_hose(model, flat, total)
    return total.reshape(nodes.shape)


def _bend_hose(model: LoadModel, flat: Array, total: Array) -> None:
    couples = by_rows(hose_couples(model.truss, model.hose, flat))
    bend_faces(np.array(model.truss.faces, np.intp), model.face_side, flat, couples, total)


def _flatten(nodes: Array, motion: NodeMotion | None) -> tuple[Array, Array, Array]:
    """Nodes, velocities and accelerations with one leading dimension, for compiled functions; the last two empty at rest."""
    flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
    if motion is None:
        return flat, _REST, _REST
    return flat, by_rows(motion.velocity.reshape(flat.shape)), by_rows(motion.acceleration.reshape(flat.shape))


def hose_couples(truss: Truss, stiffness: float, nodes: Array) -> Array:
    """Couples of a hose of a stiffness EI, N·m², on the faces, shape (T, K + 1, 3), N·m, for nodes of shape (T, N, 3), m.

    Source: M = EI / R, the elastica between parallel guides of its ends.
    """
    axis = find_axis(truss, nodes)
    bent = stiffness * (axis.angle / axis.length)[..., None] * axis.bend
    total = np.zeros(axis.places.shape)
    total[:, :-1] += bent
    total[:, 1:] -= bent
    return total
