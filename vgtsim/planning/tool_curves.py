"""Points of the curves that the tool is led along."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

Array = NDArray[np.float64]


def line(first: ArrayLike, last: ArrayLike, count: int) -> Array:
    """Points of a straight line, shape (count, 3), m, between points of shape (3,)."""
    part = np.linspace(0, 1, count)[:, None]
    return (1 - part) * np.asarray(first, float) + part * np.asarray(last, float)


def arc(centre: ArrayLike, start: ArrayLike, axis: ArrayLike, angle: float, count: int) -> Array:
    """Points of a circular arc, shape (count, 3), m, from a start about an axis through a centre, shape (3,), by rad."""
    middle, out = np.asarray(centre, float), np.asarray(start, float) - np.asarray(centre, float)
    normal = np.asarray(axis, float) / np.linalg.norm(axis)
    turn = np.linspace(0, angle, count)[:, None]
    along = (out @ normal) * normal
    return middle + along + np.cos(turn) * (out - along) + np.sin(turn) * np.cross(normal, out)


def spline(points: ArrayLike, count: int) -> Array:
    """Points of a cubic spline through way-points, shape (W, 3), m, at equal steps of the parameter, shape (count, 3), m.

    The parameter is the distance from one way-point to the next; no two in a row are the same, and W is at least 2.
    """
    through = np.asarray(points, float)
    reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
    curve = make_interp_spline(reach, through, k=min(3, len(through) - 1))
    return curve(np.linspace(0.0, reach[-1], count))
