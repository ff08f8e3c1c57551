"""The twisted surface swept along a curve, and partitions of curves (section 7.4 and appendix A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.positioning.shape import Directrix, arc_length

Array = NDArray[np.float64]

_TABLE = 256  # steps of the parameter from which the partition of equal arcs begins


def regular_partition(count: int) -> Array:
    """U of the ends of segments at equal steps of u, shape (count + 1,)."""
    return np.linspace(0.0, 1.0, count + 1)


def equal_partition(curve: Directrix, count: int) -> Array:
    """U of the ends of segments of equal arc length.

    Args:
        curve: The curve.
        count: Number of segments.

    Returns:
        Shape (count + 1,), by Newton's iteration on the arc length.
    """
    table = regular_partition(_TABLE)
    lengths = arc_length(curve, table)
    wanted = np.linspace(0.0, lengths[-1], count + 1)
    u = np.interp(wanted, lengths, table)
    for _ in range(4):
        speed = np.linalg.norm(curve.tangent(u), axis=-1)
        u = np.clip(u + (wanted - arc_length(curve, u)) / np.maximum(speed, 1e-12), 0.0, 1.0)
    return u


def bryant_angles(tangent: ArrayLike) -> tuple[Array, Array]:
    """X-Y-Z Euler angles that turn Z onto a tangent.

    Args:
        tangent: Shape (..., 3), any length but zero.

    Returns:
        gamma about X and beta about the turned Y, shape (...), rad.

    Source: equations 7.12 and 7.13, for either sign of t_z. Differs: 7.14 adds pi for t_z < 0, which the four-quadrant
    gamma has already taken care of.
    """
    t = np.asarray(tangent, float)
    gamma = -np.arctan2(t[..., 1], t[..., 2])
    return gamma, np.arctan2(t[..., 0], np.hypot(t[..., 1], t[..., 2]))


def bryant_rotation(gamma: ArrayLike, beta: ArrayLike, alpha: ArrayLike) -> Array:
    """Rotation of X-Y-Z Euler angles, shape (..., 3, 3), of angles of shape (...), rad (7.16, 7.17)."""
    a, b, g = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(beta, float), np.asarray(gamma, float))
    ca, sa, cb, sb, cg, sg = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(g), np.sin(g)
    rows = (
        (ca * cb, -sa * cb, sb),
        (ca * sb * sg + sa * cg, -sa * sb * sg + ca * cg, -cb * sg),
        (-ca * sb * cg + sa * sg, sa * sb * cg + ca * sg, cb * cg),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def end_tangent(gamma: float, beta: float) -> Array:
    """Unit end tangent of a goal given by X-Y-Z Euler angles, shape (3,).

    Source: the third column of 7.17. Differs: 8.10 prints (cos beta, cos gamma, sin gamma), which is no unit vector.
    """
    return bryant_rotation(gamma, beta, 0.0)[:, 2]


@dataclass(frozen=True)
class Sweep:
    """Frames and triangles of a swept, twisted surface at the ends of segments.

    Attributes:
        R: Shape (n + 1, 3, 3).
        P: Shape (n + 1, 3), m.
        triangles: Corners, shape (n + 1, 3, 3), m.
    """

    R: Array
    P: Array
    triangles: Array


def sweep(curve: Directrix, u: ArrayLike, side: float, twist: tuple[float, float] = (0.0, 0.0)) -> Sweep:
    """Sweep a triangle along a curve, turning it at a constant rate by segments.

    Args:
        curve: The directrix.
        u: Ends of segments, shape (n + 1,).
        side: L of the triangle, m.
        twist: lambda_i and lambda_f, rad.

    Returns:
        The surface at those places.

    Source: equations 7.9, 7.11 to 7.13, 7.15 to 7.19.
    """
    at = np.asarray(u, float)
    part = np.arange(len(at)) / (len(at) - 1)
    gamma, beta = bryant_angles(curve.tangent(at))
    R, P = bryant_rotation(gamma, beta, (1 - part) * twist[0] + part * twist[1]), curve.point(at)
    nu = 2 * np.pi / 3 * np.arange(3)
    corner = 2 / 3 * side * np.sin(np.pi / 3) * np.stack([np.cos(nu), np.sin(nu), 0 * nu], axis=-1)
    return Sweep(R, P, corner @ np.swapaxes(R, 1, 2) + P[:, None])


def leg_lengths(triangles: ArrayLike) -> Array:
    """Six members between each triangle and the next: from every corner to the one above it and to the one after.

    Args:
        triangles: Shape (n + 1, 3, 3), m.

    Returns:
        Shape (n, 6), m: three upright and three diagonal.
    """
    corners = np.asarray(triangles, float)
    low, high = corners[:-1], corners[1:]
    upright = np.linalg.norm(high - low, axis=-1)
    return np.concatenate([upright, np.linalg.norm(high[:, [1, 2, 0]] - low, axis=-1)], axis=1)
