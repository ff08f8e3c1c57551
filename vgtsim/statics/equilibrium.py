"""The method of joints for a whole arm, from the tip plate to the mast flange, over any batch of instants.

Every group of three nodes (a face, or the mid-plane of a double octahedron) has nine equations and nine unknowns: the
three members among its nodes and the six that join it to the groups below. The one new node of a tetrahedral module has
three: the two sides of its top and its actuator. The rigid tip plate counts as three bars among its corners, which changes
no member's force. So the equilibrium matrix is block triangular, and the groups are solved one after the other from the
tip. Feet and heads of joint blocks are such groups too, with the bars that stand for blocks and actuators between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.kinematics import Truss, cross_into
from vgtsim.statics.framework import framework_of, substitute_back
from vgtsim.statics.loads import LoadModel, block_loads, hub_loads, member_loads
from vgtsim.statics.motion import NodeMotion

_CHUNK, _LEAST = 512, 64  # instants times loads solved at a time, and instants: keeps the work arrays in cache


@dataclass(frozen=True)
class MemberForces:
    """Forces in an arm; tension positive, vectors in frame G. Shapes (..., M), N, or (..., M, 3), N and N·m.

    Attributes:
        bar: Axial force where a member's two segments meet: the drive force of an actuator, the force at the far end of
            a tube.
        near_axial: Axial force at the near ball joint.
        far_axial: Axial force at the far hub.
        near_transverse: Shear on the near hub: that of the member's weight and inertia, and of the bending of an actuator
            between joint blocks.
        direction: Unit vector from near to far hub.
        near_moment: Moment on the near hub: the bending of an actuator between joint blocks, zero for any other member.
        far_moment: The same at the far hub.
        reaction: Force and moment of the mast flange on the arm, flange hubs included, about its centroid, shape
            (..., 6), N and N·m.
    """

    bar: Array
    near_axial: Array
    far_axial: Array
    near_transverse: Array
    direction: Array
    near_moment: Array
    far_moment: Array
    reaction: Array

    @property
    def along(self) -> Array:
        """Axial forces at the near hub, where the segments meet and at the far hub, shape (3, ..., M), N."""
        return np.stack([self.near_axial, self.bar, self.far_axial])

    def at(self, instants: int | Index) -> MemberForces:
        """The forces at an index, or at several, of the first dimension."""
        return MemberForces(**{name: getattr(self, name)[instants] for name in _FORCES})

    def of(self, members: Index) -> MemberForces:
        """The forces of some members, with the reaction of the whole arm."""
        parts = {name: getattr(self, name) for name in _FORCES if name != "reaction"}
        parts = {name: np.take(part, members, axis=self.bar.ndim - 1) for name, part in parts.items()}
        return MemberForces(**parts, reaction=self.reaction)

    @staticmethod
    def join(parts: Sequence[MemberForces]) -> MemberForces:
        """The forces of parts of a batch one after the other, along the first dimension."""
        return MemberForces(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in _FORCES})


_FORCES = tuple(item.name for item in fields(MemberForces))


def blend(first: MemberForces, second: MemberForces, part: Array) -> MemberForces:
    """Forces a part of the way from one load's to another's, and beyond, in the same poses; a part for each member, (..., M)."""
    mixed = {}
    for name in _FORCES:
        one, two = getattr(first, name), getattr(second, name)
        if name not in ("reaction", "direction"):
            one = one + (two - one) * part.reshape(*part.shape, *(1,) * (one.ndim - part.ndim))
        mixed[name] = one
    return MemberForces(**mixed)


@dataclass(frozen=True)
class Loading:
    """One load on an arm: its weight, its inertia in a motion, and forces on its hubs in frame G, N; each may be absent.

    Forces are broadcast to the shape of the nodes, (..., N, 3). Shares are those of forces along the members in what their near
    and far hubs carry, shape (2, T, M, 3), N, for nodes of shape (T, N, 3).
    """

    model: LoadModel | None
    motion: NodeMotion | None = None
    forces: ArrayLike | None = None
    shares: Array | None = None


def solve_members(
    model: LoadModel,
    nodes: ArrayLike,
    motion: NodeMotion | None = None,
    nodal_forces: ArrayLike | None = None,
    shares: Array | None = None,
) -> MemberForces:
    """Find the force in every member in poses of shape (..., N, 3), m, frame G; NaN at instants whose motion is NaN.

    No motion is rest. Further forces on the hubs are broadcast to shape (..., N, 3), N, in frame G; for those along the
    members see `Loading`.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress at one of the instants; members are named.

    Source: method of joints. Differs: the dissertation leaves force analysis to future work (chapter 9).
    """
    return solve_loadings(model.truss, nodes, [Loading(model, motion, nodal_forces, shares)]).at(0)


def solve_loadings(truss: Truss, nodes: ArrayLike, loadings: Sequence[Loading]) -> MemberForces:
    """Member forces of L loads by one inversion for each pose; shapes begin with L; nodes and errors as `solve_members`."""
    n = np.asarray(nodes, float)
    batch, flat = n.shape[:-2], n.reshape(-1, *n.shape[-2:])
    each = [
        Loading(
            item.model,
            None if item.motion is None else item.motion.flat,
            None if item.forces is None else np.broadcast_to(item.forces, n.shape).reshape(flat.shape),
            item.shares,
        )
        for item in loadings
    ]
    step = max(_CHUNK // len(each), _LEAST)
    parts = [_solve_chunk(truss, flat, slice(i, i + step), each) for i in range(0, max(len(flat), 1), step)]
    if len(parts) == len(batch) == 1:
        return parts[0]
    whole = {}
    for name in _FORCES:
        values = [getattr(part, name) for part in parts]
        if len(values) > 1 and "moment" in name and not len(truss.rings):
            value = np.broadcast_to(0.0, (len(each), len(flat), *values[0].shape[2:]))
        else:
            value = np.concatenate(values, axis=1) if len(values) > 1 else values[0]
        whole[name] = value if len(batch) == 1 else value.reshape(len(value), *batch, *value.shape[2:])
    return MemberForces(**whole)


def _solve_chunk(truss: Truss, every: Array, part: slice, loadings: Sequence[Loading]) -> MemberForces:
    """As `solve_loadings` for a part of a flat batch; the directions are the same for all loads and stand once."""
    nodes, frame, count = by_rows(every[part]), framework_of(truss), len(truss.members)
    units, loads = frame.directions(nodes), [_load(truss, nodes, item, part) for item in loadings]
    force, near, far = (item[0][None] if len(loads) == 1 else np.stack(item) for item in zip(*loads, strict=True))
    if len(truss.rings):
        _pass_on(truss, force)
    tension, total = substitute_back(frame, units, force, nodes, part.start)
    bar, moments = tension[..., :count].copy(), np.broadcast_to(0.0, (2, *near.shape))  # takes no memory
    axial, transverse, reaction = np.empty((2, *bar.shape)), np.empty(near.shape), np.empty((*bar.shape[:2], 6))
    bent, shear = truss.ring_actuators.ravel(), np.empty(0)
    if len(truss.rings):
        moments = moments.copy()
        bar[..., bent], shear, moments[..., bent, :] = _find_rings(truss, nodes, tension)
    _split(units, nodes, total, bar, by_rows(near), by_rows(far), axial, transverse, reaction)
    if len(truss.rings):
        transverse[..., bent, :] += shear
    return MemberForces(
        bar=bar,
        near_axial=axial[0],
        far_axial=axial[1],
        near_transverse=transverse,
        direction=units[None, :, :count],
        near_moment=moments[0],
        far_moment=moments[1],
        reaction=reaction,
    )


@compiled
def _split(
    units: Array,
    nodes: Array,
    left: Array,
    bar: Array,
    near: Array,
    far: Array,
    axial: Array,
    transverse: Array,
    reaction: Array,
) -> None:
    """Axial forces at either hub, shear at the near one and the reaction of the flange, the first three nodes.

    From directions (T, B, 3), nodes, what is left at them, bar forces (L, T, M), and the members' loads at their ends.
    """
    arm, turn = np.empty(3), np.empty(3)
    for load in range(bar.shape[0]):
        for t in range(bar.shape[1]):
            for m in range(bar.shape[2]):
                first = second = 0.0
                for k in range(3):
                    first += near[load, t, m, k] * units[t, m, k]
                    second += far[load, t, m, k] * units[t, m, k]
                axial[0, load, t, m] = bar[load, t, m] + first
                axial[1, load, t, m] = bar[load, t, m] - second
                for k in range(3):
                    transverse[load, t, m, k] = near[load, t, m, k] - first * units[t, m, k]
            for k in range(3):
                reaction[load, t, k] = -(left[load, t, 0, k] + left[load, t, 1, k] + left[load, t, 2, k])
                reaction[load, t, 3 + k] = 0.0
            for i in range(3):
                for k in range(3):
                    arm[k] = nodes[t, i, k] - (nodes[t, 0, k] + nodes[t, 1, k] + nodes[t, 2, k]) / 3
                cross_into(arm, left[load, t, i], turn)
                for k in range(3):
                    reaction[load, t, 3 + k] -= turn[k]


def _load(truss: Truss, nodes: Array, loading: Loading, part: slice) -> tuple[Array, Array, Array]:
    """Forces on the nodes, shape (T, N, 3), and the members' shares in them at their near and far hubs, shape (T, M, 3), N."""
    if (model := loading.model) is None:
        force, near = np.zeros(nodes.shape), np.zeros((len(nodes), len(truss.members), 3))
        far = near
    else:
        motion = loading.motion and loading.motion.at(part)
        force = hub_loads(model, nodes, motion)
        if model.massless:
            near = far = np.zeros((len(nodes), len(truss.members), 3))
        else:
            loads = member_loads(model, nodes, motion)
            force, near, far = force + loads.total, loads.near, loads.far
        if len(truss.rings):
            force += block_loads(model, nodes, motion).total
    if loading.forces is not None:
        force += np.asarray(loading.forces)[part]
    if loading.shares is not None:
        here = loading.shares[:, part]
        for share, column in zip(here, truss.ends.T, strict=True):
            np.add.at(force.swapaxes(0, 1), column, share.swapaxes(0, 1))
        near, far = near + here[0], far + here[1]
    return force, near, far


def _pass_on(truss: Truss, force: Array) -> None:
    """Pass loads at the middles of blocks on to their feet and heads."""
    foot, middle, head = truss.rings.reshape(-1, 3).T
    force[..., foot, :] += force[..., middle, :] / 2
    force[..., head, :] += force[..., middle, :] / 2
    force[..., middle, :] = 0.0


def _find_rings(truss: Truss, nodes: Array, tension: Array) -> tuple[Array, Array, Array]:
    """Axial force, shear and moments of the P actuators between joint blocks, from tensions of all bars, shape (L, T, B), N.

    An actuator of length L between blocks of height h = Ljo is, see `kinematics.truss`, a lower chord, an upper chord and
    a diagonal of length D from its first block's foot to its second's head. With e from the first block to the second and
    U from feet to heads, tensions S_l, S_u and S_d in them put on the first block, at its middle,

        N e + V U and M_i (U x e),   N = S_l + S_u + S_d L / D,   V = S_d h / D,   M_i = h / 2 (S_u - S_l - S_d L / D)

    and on the second -N e - V U and M_j (U x e), M_j = h / 2 (S_l - S_u - S_d L / D): three forces against three unknowns,
    so nothing is assumed. M_i + M_j + V L = 0, as the actuator's own moments are in the loads at its ends.

    Returns:
        N, shape (T, P), N; V U, shape (T, P, 3), N; and M_i (U x e), M_j (U x e), shape (2, T, P, 3), N·m, in frame G.
    """
    member = truss.ring_actuators.ravel()
    first = len(truss.members) + len(truss.tip_edges)  # after the bars of members and plate: upper chords, diagonals
    upper, diagonal = (tension[..., first + k * len(member) :][..., : len(member)] for k in range(2))
    rise = nodes[..., truss.rings[:, :, 2].ravel(), :] - nodes[..., truss.rings[:, :, 0].ravel(), :]
    span = truss.spans(nodes)[..., member, :]
    height, length = (np.linalg.norm(item, axis=-1) for item in (rise, span))
    whole, lower = np.hypot(height, length), tension[..., member]
    along = diagonal * length / whole
    about = np.cross(rise / height[..., None], span / length[..., None])
    near, far = height / 2 * (upper - lower - along), height / 2 * (lower - upper - along)
    moments = np.stack([near, far])[..., None] * about
    return lower + upper + along, (diagonal / whole)[..., None] * rise, moments
