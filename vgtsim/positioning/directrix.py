"""Curves that an arm is given the shape of, and the twisted surface swept along them (section 7.4 and appendix A)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

F = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 0.0, 3.0, -2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, -1.0, 1.0]])  # (7.7)
_GAUSS = np.polynomial.legendre.leggauss(8)
_PIECES = 64  # of the parameter for arc lengths


@dataclass(frozen=True)
class Directrix:
    """A curve over u in [0, 1].

    Attributes:
        point: From u, shape (k,), to positions, shape (k, 3), m.
        tangent: From u, shape (k,), to derivatives by u, shape (k, 3), m.
    """

    point: Callable[[Array], Array]
    tangent: Callable[[Array], Array]


def cubic(start: ArrayLike, end: ArrayLike, first: ArrayLike, last: ArrayLike) -> Directrix:
    """The cubic of given end points and end tangents.

    Args:
        start: C(0), shape (3,), m.
        end: C(1), shape (3,), m.
        first: C'(0) = t_0 q_0, shape (3,), m.
        last: C'(1) = t_1 q_1, shape (3,), m.

    Returns:
        The curve.

    Source: equations 7.3 to 7.8 and A.1 to A.9.
    """
    A = np.stack([np.asarray(item, float) for item in (start, end, first, last)], axis=1) @ F

    def point(u: Array) -> Array:
        return np.stack([np.ones_like(u), u, u**2, u**3], axis=-1) @ A.T

    def tangent(u: Array) -> Array:
        return np.stack([np.zeros_like(u), np.ones_like(u), 2 * u, 3 * u**2], axis=-1) @ A.T

    return Directrix(point, tangent)


def spline(points: ArrayLike, first: ArrayLike, last: ArrayLike) -> Directrix:
    """A cubic spline through way-points, spaced by their chords, with given end tangents.

    Args:
        points: Shape (k, 3), m; the ends are the first and the last.
        first: Derivative by u at the start, shape (3,), m.
        last: At the end, shape (3,), m.

    Returns:
        The curve; its curvature is continuous.

    Raises:
        ValueError: Two way-points in a row coincide.
    """
    way = np.asarray(points, float)
    chord = np.linalg.norm(np.diff(way, axis=0), axis=1)
    if np.any(chord < 1e-9):
        raise ValueError(f"way-points {int(np.argmin(chord))} and {int(np.argmin(chord)) + 1} coincide")
    u = np.concatenate([[0.0], np.cumsum(chord)]) / chord.sum()
    ends: Any = ((1, np.asarray(first, float)), (1, np.asarray(last, float)))
    curve = CubicSpline(u, way, bc_type=ends)
    rate = curve.derivative()
    return Directrix(lambda at: curve(at), lambda at: rate(at))


def arc_length(curve: Directrix, u: ArrayLike) -> Array:
    """Length of the curve from its start.

    Args:
        curve: The curve.
        u: Shape (k,), in [0, 1].

    Returns:
        Shape (k,), m, by Gauss and Legendre's rule on 64 pieces of the curve and on the last one up to each u.
    """
    at = np.asarray(u, float)
    begin = np.minimum(np.floor(at * _PIECES), _PIECES - 1) / _PIECES
    whole = _lengths_between(curve, np.arange(_PIECES) / _PIECES, np.full(_PIECES, 1 / _PIECES))
    before = np.concatenate([[0.0], np.cumsum(whole)])[np.rint(begin * _PIECES).astype(int)]
    return before + _lengths_between(curve, begin, at - begin)


def _lengths_between(curve: Directrix, begin: Array, step: Array) -> Array:
    """Length of each piece, shape (k,), m, that begins at some u and goes on by a step, shape (k,) each."""
    node, weight = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2
    at = begin[:, None] + step[:, None] * node
    speed = np.linalg.norm(curve.tangent(at.ravel()), axis=-1).reshape(at.shape)
    return step * (speed @ weight)


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
    table = regular_partition(4 * _PIECES)
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
