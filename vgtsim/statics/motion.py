"""Velocities and accelerations of the nodes from their recorded positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SPACING = 1e-6  # relative change of the record spacing that ends a run: far above rounding, far below one step


@dataclass(frozen=True)
class NodeMotion:
    """Velocities, m/s, and accelerations, m/s², of the nodes in frame G, shapes (..., N, 3)."""

    velocity: Array
    acceleration: Array

    @property
    def flat(self) -> NodeMotion:
        """The same with one leading dimension."""
        return NodeMotion(*(item.reshape(-1, *item.shape[-2:]) for item in (self.velocity, self.acceleration)))

    def at(self, instants: slice | NDArray[np.intp]) -> NodeMotion:
        """The motion at some instants."""
        return NodeMotion(self.velocity[instants], self.acceleration[instants])


def motion_from_log(time: ArrayLike, nodes: ArrayLike, window: int = 5) -> NodeMotion:
    """Differentiate node positions, shape (T, N, 3), m, at increasing times, shape (T,), s, by local polynomials.

    Only records of constant spacing are differenced together; NaN where there are fewer of these than a polynomial takes.
    A polynomial goes through all records of its window: five are best for smooth motion; with three the accelerations are those
    of MuJoCo's steps, if each step is recorded.

    Source: A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964), 1627-1639.
    """
    t, n = np.asarray(time, float), np.asarray(nodes, float)
    velocity, acceleration = np.full(n.shape, np.nan), np.full(n.shape, np.nan)
    for run in uniform_runs(t):
        stretch = n[run]
        spacing = float(t[run.stop - 1] - t[run.start]) / max(len(stretch) - 1, 1)
        if len(stretch) < window or spacing <= 0:
            continue
        # differences from the mean keep the digits that the distance from the tank's origin would cost
        offset = stretch - stretch.mean(axis=0)
        velocity[run] = _differentiate(offset, 1, window) / spacing
        acceleration[run] = _differentiate(offset, 2, window) / spacing**2
    return NodeMotion(velocity, acceleration)


def _differentiate(values: Array, order: int, window: int) -> Array:
    """Derivatives of values, shape (T, ...), by the number of the record; those at either end from one polynomial."""
    half, weights = window // 2, _weigh(order, window)
    found = np.empty_like(values)
    found[half:-half] = sum(w * values[j : len(values) + j + 1 - window] for j, w in enumerate(weights[half]))
    found[:half] = np.tensordot(weights[:half], values[:window], axes=1)
    found[-half:] = np.tensordot(weights[-half:], values[-window:], axes=1)
    return found


@cache
def _weigh(order: int, window: int) -> Array:
    """Weights of the records of a window, shape (W,), in the derivative at each of them, shape (W, W)."""
    places = np.arange(window) - window // 2
    slopes = polyval(places, polyder(np.eye(window), order))  # of every power, at every place
    weights = np.array(np.linalg.solve(np.vander(places, increasing=True).T, slopes).T, float)
    weights.flags.writeable = False
    return weights


def uniform_runs(time: Array) -> tuple[slice, ...]:
    """Stretches of constant spacing in times of shape (T,), s; neighbours share the record at which the spacing changes."""
    step = np.diff(time)
    change = np.abs(np.diff(step)) > _SPACING * np.abs(step[:-1])
    edges = [0, *(np.flatnonzero(change) + 1).tolist(), len(time) - 1]
    return tuple(slice(first, last + 1) for first, last in pairwise(edges))
