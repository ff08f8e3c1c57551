"""Turns of unit directions, compiled: a controller needs them in every cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.kinematics import cross_into

Array = NDArray[np.float64]

_NOWHERE = 1e-12  # rad: a smaller turn is none


@compiled
def _size(a: Array) -> float:
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@compiled
def _find_across(direction: Array, out: Array) -> None:
    """A unit vector across a direction; near ties of its parts are one on every processor."""
    axis, least = np.zeros(3), 0
    for k in range(1, 3):
        if np.rint(1e9 * abs(direction[k])) < np.rint(1e9 * abs(direction[least])):
            least = k
    axis[least] = 1.0
    cross_into(direction, axis, out)
    out /= _size(out)


@compiled
def find_turn(first: Array, second: Array) -> Array:
    """Turn from one unit direction to another about the axis across both, a vector of shape (3,), rad."""
    axis = np.empty(3)
    cross_into(first, second, axis)
    size = _size(axis)
    angle = np.arctan2(size, first[0] * second[0] + first[1] * second[1] + first[2] * second[2])
    if size < _NOWHERE:
        if angle < 1:
            return axis
        _find_across(first, axis)  # half a turn: about any axis across
        size = 1.0
    return axis * (angle / size)


@compiled
def turn(direction: Array, by: Array) -> Array:
    """A unit direction turned by a vector, shape (3,), rad."""
    angle = _size(by)
    if angle < _NOWHERE:
        return direction.copy()
    axis, across = by / angle, np.empty(3)
    cross_into(axis, direction, across)
    along = axis[0] * direction[0] + axis[1] * direction[1] + axis[2] * direction[2]
    moved = np.cos(angle) * direction + np.sin(angle) * across + (1 - np.cos(angle)) * along * axis
    return moved / _size(moved)


@compiled
def split_twist(direction: Array) -> Array:
    """Rows of a twist, shape (6, 6): velocity, two turns across a direction, the turn about it."""
    rows = np.zeros((6, 6))
    for k in range(3):
        rows[k, k] = 1.0
        rows[5, 3 + k] = direction[k]
    _find_across(direction, rows[3, 3:])
    cross_into(direction, rows[3, 3:], rows[4, 3:])
    return rows
