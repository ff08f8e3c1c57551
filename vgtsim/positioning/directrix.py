"""Curves that an arm is given the shape of (section 7.4 and appendix A)."""

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
