"""The method of joints for a whole arm, from the tip plate to the mast flange, over any batch of instants.

Every group of three nodes (a face, or the mid-plane of a double octahedron) has nine equations and nine unknowns: the
three members among its nodes and the six that join it to the groups below. The one new node of a tetrahedral module has
three: the two sides of its top and its actuator. The rigid tip plate counts as three bars among its corners, which changes
no member's force. So the equilibrium matrix is block triangular, and the groups are solved one after the other from the
tip. Feet and heads of joint blocks are such groups too, with the bars that stand for blocks and actuators between them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics import Truss
from vgtsim.kinematics.vectors import cross, dot
from vgtsim.statics.framework import framework_of
from vgtsim.statics.joints import substitute_back
from vgtsim.statics.loads import LoadModel, add_up, block_loads, hub_loads, member_loads
from vgtsim.statics.motion import NodeMotion

Array = NDArray[np.float64]

_CHUNK = 512  # instants solved at a time: keeps the work arrays in cache


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

    def at(self, instants: NDArray[np.intp]) -> MemberForces:
        """The forces of some instants."""
        return MemberForces(**{item.name: getattr(self, item.name)[instants] for item in fields(self)})


def solve_members(
    model: LoadModel, nodes: ArrayLike, motion: NodeMotion | None = None, nodal_forces: ArrayLike | None = None
) -> MemberForces:
    """Find the force in every member in poses of shape (..., N, 3), m, frame G; NaN at instants whose motion is NaN.

    No motion is rest. Further forces on the hubs are broadcast to shape (..., N, 3), N, in frame G.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress at one of the instants; members are named.

    Source: method of joints. Differs: the dissertation leaves force analysis to future work (chapter 9).
    """
    n = np.asarray(nodes, float)
    batch, flat, moving = n.shape[:-2], n.reshape(-1, *n.shape[-2:]), None if motion is None else motion.flat
    extra = None if nodal_forces is None else np.broadcast_to(nodal_forces, n.shape).reshape(flat.shape)
    parts = []
    for start in range(0, max(len(flat), 1), _CHUNK):
        part = slice(start, start + _CHUNK)
        more = None if extra is None else extra[part]
        parts.append(_solve_chunk(model, flat[part], moving and moving.at(part), more, start))
    whole = {}
    for item in fields(MemberForces):
        values = [getattr(part, item.name) for part in parts]
        value = np.concatenate(values) if len(values) > 1 else values[0]
        whole[item.name] = value.reshape(*batch, *value.shape[1:])
    return MemberForces(**whole)


def _solve_chunk(
    model: LoadModel, nodes: Array, motion: NodeMotion | None, extra: Array | None, start: int
) -> MemberForces:
    """As `solve_members` for a flat batch, whose first instant is `start` of all."""
    truss, frame, loads = model.truss, framework_of(model.truss), member_loads(model, nodes, motion)
    force = hub_loads(model, nodes, motion) + add_up(truss, loads)
    if extra is not None:
        force += extra
    if len(truss.rings):
        _load_blocks(model, nodes, motion, force)
    tension, total = substitute_back(frame, frame.directions(nodes), force, nodes, start)
    near, far = (dot(share, loads.direction) for share in (loads.near, loads.far))
    bar, transverse = tension[:, : len(truss.members)].copy(), loads.near - near * loads.direction
    moments = np.zeros((2, *loads.near.shape))
    if len(truss.rings):
        bent = truss.ring_actuators.ravel()
        bar[:, bent], shear, moments[:, :, bent] = _find_rings(truss, nodes, tension)
        transverse[:, bent] += shear
    base, left = nodes[:, truss.base], total[:, truss.base]
    moment = cross(base - base.mean(axis=1)[:, None], -left).sum(axis=1)
    return MemberForces(
        bar=bar,
        near_axial=bar + near[..., 0],
        far_axial=bar - far[..., 0],
        near_transverse=transverse,
        direction=loads.direction,
        near_moment=moments[0],
        far_moment=moments[1],
        reaction=np.concatenate([-left.sum(axis=1), moment], axis=-1),
    )


def _load_blocks(model: LoadModel, nodes: Array, motion: NodeMotion | None, force: Array) -> None:
    """Put the posts' loads on feet and heads, and pass the loads at the middles on to these."""
    foot, middle, head = model.truss.rings.reshape(-1, 3).T
    posts = block_loads(model, nodes, motion)
    force[:, foot] += posts.near + force[:, middle] / 2
    force[:, head] += posts.far + force[:, middle] / 2
    force[:, middle] = 0.0


def _find_rings(truss: Truss, nodes: Array, tension: Array) -> tuple[Array, Array, Array]:
    """Axial force, shear and moments of the P actuators between joint blocks, from tensions of all bars, shape (T, B), N.

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
