"""Forward solutions that stay on the assembly mode of their start, with proof.

A plain Newton iteration may land on any of a cell's sixteen assemblies. Here the lengths run from those of the start
to the goal, t from 0 to 1. Every step is cut until the theorem of Newton and Kantorovich holds from the present angles
for every t of the step: beta K eta <= 1/2, with beta = |J^-1|, K a bound of the change of J per radian, and eta =
|J^-1 F|. Then a ball about the angles holds exactly one assembly at every t, with a regular Jacobian. So the assembly
moves continuously, and Newton started at the angles ends on it. Where no step passes, the path meets a singularity.

The bounds of the closure's change within a step come from its middle and its end; they are exact for closures that are
quadratic in t, and of third order in the step otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows
from vgtsim.kinematics.mode_steps import certify_cells, follow_cells
from vgtsim.kinematics.ties import first_greatest

_SAME_VALUE = 1e-6  # of the greatest: singular values this near are one, whose directions are any mix


@dataclass(frozen=True)
class FollowedMode:
    """Angles at which a batch of followed solutions ended, shape (N, 3), rad, and the part of the path covered, (N,)."""

    phi: Array
    reached: Array


def follow_mode(closure: Array, slope: Array, square: Array, start: ArrayLike) -> FollowedMode:
    """Carry assemblies, angles of shape (N, 3), rad, along closures C + t (C' + t C'') from t = 0 to t = 1.

    The closure, its slope and its square have shape (5, 3, N), m².
    """
    table = np.moveaxis(np.stack([closure, slope, square]), -1, 0)
    return _follow(table, np.empty((0, 2, 3)), np.empty(6), np.empty(3), start)


def follow_squares(closure: Array, change: Array, start: ArrayLike) -> FollowedMode:
    """As `follow_mode`, where only the squared edges change, straight, by minus the change, shape (3, N), m²."""
    slope = np.zeros(closure.shape)
    slope[0] = change
    return follow_mode(closure, slope, np.zeros(closure.shape), start)


def follow_sides(begin: Array, goal: Array, longerons: ArrayLike, edges: ArrayLike, start: ArrayLike) -> FollowedMode:
    """As `follow_mode`, of the cell over a triangle whose sides change, straight, from shape (N, 3) to (N, 3), m.

    Longerons, shape (6,), m, are those of `make_circles` with edges `UPPER`; edges are those between the upper nodes,
    shape (3,), m.
    """
    return _follow(np.empty((0, 3, 5, 3)), np.stack([begin, goal], axis=1), longerons, edges, start)


def _follow(table: Array, ends: Array, sides: ArrayLike, edges: ArrayLike, start: ArrayLike) -> FollowedMode:
    # impossible lengths on the way give closures that are not numbers, which certify nothing: it ends there
    phi = np.array(start, float, order="C")
    reached = np.zeros(len(phi))
    follow_cells(by_rows(table), by_rows(ends), by_rows(sides), by_rows(edges), phi, reached)
    return FollowedMode(phi, reached)


def certify_box(C: Array, half: ArrayLike, phi: Array) -> tuple[Array, Array]:
    """As for a step, over all squared edges within boxes: the Jacobian does not depend on them.

    C are closures at the boxes' centres, shape (5, 3, n), m², `half` the half edges of the boxes, shape (3,), m², and
    phi angles that close there, shape (n, 3), rad.

    Returns:
        Radius of the ball (in the greatest angle) that holds one assembly for each point of the box, rad, and eta
        times the bound of J^-1 F'', each shape (n,): at most 1/2 where that is proved, infinite where J is singular.
    """
    radius, quality = np.empty(len(phi)), np.empty(len(phi))
    certify_cells(by_rows(np.moveaxis(C, -1, 0)), by_rows(half), by_rows(phi), radius, quality)
    return radius, quality


def worst_row(left: Array, value: Array) -> Index:
    """Row with most of what is lost at the smallest singular value, shape (...), the first of equals.

    Left singular vectors have shape (..., n, n), falling singular values (..., n). All directions of one value count,
    because which of them come out is chance.
    """
    same = value <= value[..., -1:] + _SAME_VALUE * value[..., :1]
    return first_greatest(np.sum(left**2 * same[..., None, :], axis=-1), axis=-1)


def worst_direction(J: ArrayLike, scale: ArrayLike = 1.0) -> tuple[float, int]:
    """Smallest singular value of J / scale, and the index of the row with most of its left singular vector.

    J are derivatives of lengths, one row each, shape (n, n); the scale has the units of the columns, shape (n,).
    """
    left, value, _ = np.linalg.svd(np.asarray(J, float) / np.asarray(scale, float))
    return float(value[-1]), int(worst_row(left, value))
