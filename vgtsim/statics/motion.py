"""Velocities and accelerations of the nodes from their recorded positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index

_SPACING = 1e-6  # relative change of the record spacing that ends a run: far above rounding, far below one step
_WINDOWS = (5, 7)  # records of a polynomial: nine follow the ends of a move no better, and take more records beside
_LEAST_PART = 1e-3  # of the spacing: over a shorter step differences lose digits, and are derivatives to 1e-7
_STEPS = 3  # records that hold two steps, where each step is recorded


@dataclass(frozen=True)
class NodeMotion:
    """Velocities, m/s, and accelerations, m/s², of the nodes in frame G, shapes (..., N, 3)."""

    velocity: Array
    acceleration: Array

    @property
    def flat(self) -> NodeMotion:
        """The same with one leading dimension."""
        return NodeMotion(*(item.reshape(-1, *item.shape[-2:]) for item in (self.velocity, self.acceleration)))

    def at(self, instants: slice | Index) -> NodeMotion:
        """The motion at some instants."""
        return NodeMotion(self.velocity[instants], self.acceleration[instants])


def motion_from_log(time: ArrayLike, nodes: ArrayLike, step: float = 0.0) -> NodeMotion:
    """Differentiate node positions, shape (T, N, 3), m, at increasing times, shape (T,), s, by local polynomials.

    Only records of constant spacing are differenced together; NaN where there are fewer of these than five. A polynomial
    goes through seven records, or five of fewer.

    With the step of a simulation, s, velocities are those of the step that led to a record, and accelerations those from that
    step to the next one: differences of places a step apart. These are what the simulated forces go with, where derivatives
    at the record are off by a twelfth of the step squared times the fourth derivative. Where every step is recorded, the
    differences are those of three records. A simulation begins at time zero at rest: no step led to a record of that instant.

    Source: A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964), 1627-1639.
    """
    t, n = np.asarray(time, float), np.asarray(nodes, float)
    velocity, acceleration = np.full(n.shape, np.nan), np.full(n.shape, np.nan)
    for run in uniform_runs(t):
        stretch = n[run]
        spacing = float(t[run.stop - 1] - t[run.start]) / max(len(stretch) - 1, 1)
        part = step / spacing if _LEAST_PART * spacing < step < spacing * (1 + _SPACING) else 0.0
        window = _fit_window(len(stretch), part)
        if not window or spacing <= 0:
            continue
        # differences from the mean keep the digits that the distance from the tank's origin would cost
        offset, weights = stretch - stretch.mean(axis=0), _weigh(window, part)
        velocity[run] = _combine(offset, weights[0]) / spacing
        acceleration[run] = _combine(offset, weights[1]) / spacing**2
        if part and t[run.start] == 0.0:
            ahead = np.tensordot(_step_ahead(window, part), offset[:window], axes=1)
            velocity[run.start], acceleration[run.start] = 0.0, (ahead - offset[0]) / (part * spacing) ** 2
    return NodeMotion(velocity, acceleration)


def _fit_window(count: int, part: float) -> int:
    """Records of a polynomial, of so many of one spacing, for a step of that part of the spacing; 0 if too few."""
    windows = (_STEPS,) if abs(part - 1) < _SPACING else _WINDOWS
    return max((window for window in windows if window <= count), default=0)


@lru_cache(maxsize=8)
def _weigh(window: int, part: float) -> Array:
    """Weights of a window's records, one apart, in both derivatives at each of its places, shape (2, window, window).

    For a part of the spacing they are differences of places so far apart.
    """
    places = np.arange(window) - window // 2
    weights = np.linalg.inv(np.vander(places, increasing=True).astype(float))  # of the records in each power
    if not part:
        slopes = np.stack([polyval(places, polyder(np.eye(window), order)).T for order in (1, 2)])
        return slopes @ weights
    before, at, after = (np.vander(places + move, window, increasing=True) for move in (-part, 0.0, part))
    return np.stack([(at - before) / part, (after - 2 * at + before) / part**2]) @ weights


@lru_cache(maxsize=8)
def _step_ahead(window: int, part: float) -> Array:
    """Weights of a window's records in the place that is a part of the spacing after the first, shape (window,)."""
    places = np.arange(window)
    return np.vander([part], window, increasing=True)[0] @ np.linalg.inv(
        np.vander(places, increasing=True).astype(float)
    )


def _combine(values: Array, weights: Array) -> Array:
    """Values of a run, shape (T, ...), by the weights of a window at each of its places; near the ends one window serves all."""
    window = len(weights)
    half = window // 2
    found = np.empty_like(values)
    found[half:-half] = sum(w * values[j : len(values) + j + 1 - window] for j, w in enumerate(weights[half]))
    found[:half] = np.tensordot(weights[:half], values[:window], axes=1)
    found[-half:] = np.tensordot(weights[-half:], values[-window:], axes=1)
    return found


def uniform_runs(time: Array) -> tuple[slice, ...]:
    """Stretches of constant spacing in times of shape (T,), s; neighbours share the record at which the spacing changes."""
    step = np.diff(time)
    change = np.abs(np.diff(step)) > _SPACING * np.abs(step[:-1])
    edges = [0, *(np.flatnonzero(change) + 1).tolist(), len(time) - 1]
    return tuple(slice(first, last + 1) for first, last in pairwise(edges))
