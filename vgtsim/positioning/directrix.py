"""Curves that an arm is given the shape of (section 7.4 and appendix A)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

F = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 0.0, 3.0, -2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, -1.0, 1.0]])  # (7.7)
_GAUSS = np.polynomial.legendre.leggauss(8)
_PIECES = 64  # of the parameter for arc lengths


@dataclass(frozen=True)
class Directrix:
    """A curve over u in [0, 1]: positions, m, and derivatives by u, shape (k, 3), of parameters u of shape (k,)."""

    point: Callable[[Array], Array]
    tangent: Callable[[Array], Array]


def cubic(start: ArrayLike, end: ArrayLike, first: ArrayLike, last: ArrayLike) -> Directrix:
    """The cubic with end points C(0), C(1) and end tangents C'(0), C'(1), each of shape (3,), m.

    Source: equations 7.3 to 7.8 and A.1 to A.9.
    """
    A = np.stack([np.asarray(item, float) for item in (start, end, first, last)], axis=1) @ F

    def point(u: Array) -> Array:
        return np.stack([np.ones_like(u), u, u**2, u**3], axis=-1) @ A.T

    def tangent(u: Array) -> Array:
        return np.stack([np.zeros_like(u), np.ones_like(u), 2 * u, 3 * u**2], axis=-1) @ A.T

    return Directrix(point, tangent)


def arc_length(curve: Directrix, u: ArrayLike) -> Array:
    """Length of the curve from its start to each u, shape (k,), m: Gauss and Legendre's rule on 64 pieces."""
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
