"""What the motion of the mast does to an arm: its feed lifts the arm as a whole, and its turn swings it about the mast's axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]


def move_points(chain: Chain, points: Array, feed: ArrayLike = 0.0, turn: ArrayLike = 0.0) -> Array:
    """Points of an arm, shape (..., P, 3), m, for a mast at a feed, m, and a turn from above, rad, each of shape (...).

    The points are those of the mast at its working depth, not turned.
    """
    turn = np.asarray(turn, float)
    if np.any(turn):
        points = chain.mount[:3, 3] + (points - chain.mount[:3, 3]) @ np.swapaxes(rotate_upright(turn), -1, -2)
    return points + np.asarray(feed, float)[..., None, None] * [0.0, 0.0, 1.0]


def rotate_upright(turn: ArrayLike) -> Array:
    """Rotations about the vertical by angles of shape (...), rad: shape (..., 3, 3)."""
    c, s = np.cos(turn), np.sin(turn)
    zero, one = np.zeros_like(c), np.ones_like(c)
    return np.stack([c, -s, zero, s, c, zero, zero, zero, one], axis=-1).reshape(*np.shape(c), 3, 3)


def find_mast_turn(flange: Array, reference: Array) -> float:
    """Turn of the mast, rad, above -pi to pi, from the nodes at its flange now and not turned, both of shape (3, 3), m."""
    here, there = (corners - corners.mean(axis=0) for corners in (reference, flange))
    across = np.sum(here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0])
    return float(np.arctan2(across, np.sum(here[:, :2] * there[:, :2])))
