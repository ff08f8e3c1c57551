"""Axial force, shear and bending of actuators between joint blocks, from the bars that stand for them.

An actuator of length L between blocks of height h = Ljo is, see `kinematics.truss`, a lower chord, an upper chord and a
diagonal of length D from its first block's foot to its second's head. With e from the first block to the second and U from
feet to heads, tensions S_l, S_u and S_d in them put on the first block, at its middle,

    N e + V U and M_i (U x e),   N = S_l + S_u + S_d L / D,   V = S_d h / D,   M_i = h / 2 (S_u - S_l - S_d L / D)

and on the second -N e - V U and M_j (U x e), M_j = h / 2 (S_l - S_u - S_d L / D): three forces against three unknowns, so
nothing is assumed. M_i + M_j + V L = 0, as the actuator's own moments are in the loads at its ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Truss

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RingForces:
    """What the actuators between joint blocks carry besides their own loads; P of them, in frame G.

    Attributes:
        member: Indices of the actuators among the members, shape (P,).
        axial: N, tension positive, shape (..., P), N.
        shear: V U, force on the first block across the actuator, shape (..., P, 3), N; the second gets the opposite.
        near_moment: M_i (U x e) on the first block, shape (..., P, 3), N·m.
        far_moment: M_j (U x e) on the second block, shape (..., P, 3), N·m.
    """

    member: NDArray[np.intp]
    axial: Array
    shear: Array
    near_moment: Array
    far_moment: Array


def find_ring_forces(truss: Truss, nodes: Array, tension: Array) -> RingForces:
    """Turn tensions of bars into what the actuators carry.

    Args:
        nodes: Shape (..., N, 3), m, in frame G.
        tension: Of all bars, shape (..., B), N.
    """
    member = truss.ring_actuators.ravel()
    first = len(truss.members) + len(truss.tip_edges)
    upper, diagonal = (tension[..., first + k * len(member) :][..., : len(member)] for k in range(2))
    foot, head = truss.rings[:, :, 0].ravel(), truss.rings[:, :, 2].ravel()
    rise = nodes[..., head, :] - nodes[..., foot, :]
    span = truss.spans(nodes)[..., member, :]
    height, length = (np.linalg.norm(item, axis=-1) for item in (rise, span))
    across, along = diagonal * height, diagonal * length
    whole = np.hypot(height, length)
    lower = tension[..., member]
    about = np.cross(rise / height[..., None], span / length[..., None])
    near, far = height / 2 * (upper - lower - along / whole), height / 2 * (lower - upper - along / whole)
    return RingForces(
        member,
        lower + upper + along / whole,
        (across / whole / height)[..., None] * rise,
        near[..., None] * about,
        far[..., None] * about,
    )
