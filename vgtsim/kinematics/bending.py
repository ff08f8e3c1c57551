"""Bends: the arm bent in a vertical plane and swung about its mast, for modules of every kind; and the mast's motion.

A module is bent symmetrically when the plane midway between its end faces is inclined by half the angle between them,
which is how a double octahedron moves. For an octahedron it is one pose of many: the top face turns by the angle about
the horizontal axis across the bend, and its centroid stands in the direction halfway, at the straight pose's distance.

The motion of the mast moves the arm as a whole: its feed lifts it, and its turn swings it about the mast's axis.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Bend
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.roll_pitch_yaw import rotate_upright
from vgtsim.kinematics.subspace import Subspace

_PARALLEL = 1 - 1e-12  # cosine of the angle between a section's end faces


def azimuth(chain: Chain, point: Array) -> float:
    """Angle, rad, about Z of B_1 from X of B_1 to a point of frame G, shape (3,), m; zero on the mast's axis."""
    local = chain.mount[:3, :3].T @ (point - chain.mount[:3, 3])
    return float(np.arctan2(local[1], local[0])) if np.hypot(local[0], local[1]) > 1e-6 else 0.0


def can_swing(chain: Chain) -> bool:
    """Whether every module follows a swing: no hinges, no static longerons, no sections with inclined faces."""
    free = all(place.modules.is_free(m) for place, m in chain.seats)
    return free and bool(np.all(chain.layout.after[:, 2, 2] > _PARALLEL))


def swing(chain: Chain, q: Array, angle: ArrayLike) -> Array:
    """Inputs, shape (..., n), with the arm's centre line swung about Z of B_1 by angles, scalar or shape (...), rad.

    Turning every module's transform about Z turns the arm, because sections with parallel faces commute with it.
    Static longerons and the hinges of tetrahedra do not follow: of an arm that has them the swing is only a first
    guess.
    """
    turn, shape = rotate_upright(angle)[..., None, :, :], np.broadcast_shapes(q.shape[:-1], np.shape(angle))
    x = np.broadcast_to(q, (*shape, chain.layout.inputs)).copy()
    for place in chain.layout.places:
        x[..., place.columns] = place.modules.swing(x[..., place.columns], turn)
    return x


def bend_all(chain: Chain, angles: ArrayLike, directions: ArrayLike) -> Array:
    """Inputs, shape (..., n), of the modules bent symmetrically at their straight extension.

    Static longerons are left aside, and a tetrahedron's hinge opens by its angle.

    Args:
        angles: Between the end faces of each active module, shape (..., A), rad; positive away from the mast.
        directions: Azimuth that each bends to, from X of B_1 in the straight arm, rad; broadcast to shape (..., A).
    """
    angle, direction = np.asarray(angles, float), np.asarray(directions, float) - chain.straight_yaws
    lean, shape = np.sin(angle / 2), np.broadcast_shapes(angle.shape, direction.shape)
    half = np.empty((*shape, 3))
    half[..., 0], half[..., 1], half[..., 2] = lean * np.cos(direction), lean * np.sin(direction), np.cos(angle / 2)
    x, angle = np.empty((*shape[:-1], chain.layout.inputs)), np.broadcast_to(angle, shape)
    for place in chain.layout.places:
        x[..., place.columns] = place.modules.bend(angle.take(place.active, axis=-1), half.take(place.active, axis=-2))
    return x


def bend_start(chain: Chain, bends: Sequence[Bend]) -> Array:
    """Inputs of the posture that a scene starts from, shape (n,): a symmetric bend for each active module.

    An extension that is absent is that of the straight pose. Of a module with static longerons it is the nearest pose that
    keeps their lengths.
    """
    row = bend_all(chain, [bend.angle for bend in bends], [bend.azimuth for bend in bends])
    for place in chain.layout.places:
        for m, a in enumerate(place.active):
            extension, columns = bends[a].extension, place.columns[m]
            if extension is not None:
                row[columns] = place.modules.extend(m, row[columns], extension)
    try:
        return Subspace(chain).project(row[None])[0]
    except AssemblyError:  # checks name the module that cannot take its bend
        return row


def move_points(chain: Chain, points: Array, feed: ArrayLike = 0.0, turn: ArrayLike = 0.0) -> Array:
    """Points, shape (..., P, 3), m, of an arm at its working depth after the mast's feed, m, and turn from above, rad, (...)."""
    turn = np.asarray(turn, float)
    if np.any(turn):
        points = chain.mount[:3, 3] + (points - chain.mount[:3, 3]) @ np.swapaxes(rotate_upright(turn), -1, -2)
    return points + np.asarray(feed, float)[..., None, None] * [0.0, 0.0, 1.0]


def find_mast_turn(flange: Array, reference: Array) -> float:
    """Turn of the mast, rad, above -pi to pi, from the nodes at its flange now and not turned, both of shape (3, 3), m."""
    here, there = (corners - corners.mean(axis=0) for corners in (reference, flange))
    across = np.sum(here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0])
    return float(np.arctan2(across, np.sum(here[:, :2] * there[:, :2])))
