"""The least deviation from a directrix that any posture of an arm can have, feed by feed.

Sequential linear programmes make the greatest distance of the axis from the curve small, inside the strokes and with the
modules in the riser stowed. Each posture is sought for itself, so a way in, whose postures must follow one another, cannot
do better: the greatest of these distances bounds the deviation of every way in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.planning.unfolding import Follower

_SPACING = 0.25  # m of feed from posture to posture
_ROUNDS = 25  # programmes for a posture; about five bring it to rest
_TRUST = 0.3  # first greatest change of a bend, rad, and of an extension, m
_REST = 1e-4  # change and trust at which a posture is at rest
_PRICE = 5.0  # deviation that a violated stroke counts as, per metre


@dataclass(frozen=True)
class Postures:
    """Postures over feed, m: bends, rad, and extensions, m, shape (W, A); greatest distances from the curve, shape (W,), m."""

    feed: Array
    bend: Array
    extension: Array
    deviation: Array

    @property
    def bound(self) -> float:
        """Greatest of the least deviations, m."""
        return float(self.deviation.max())


def find_postures(guide: Follower) -> Postures:
    """Postures of least deviation every quarter of a metre of feed, from the first opening to the end of the way.

    Each is sought from the one before it, and so are the modules that have just opened, from the stowed pose.
    """
    first = max(float(guide.opening.max()), _SPACING)
    feeds = np.unique(np.concatenate([np.arange(first, 0.0, -_SPACING), [0.0], guide.opening]))[::-1]
    feeds = feeds[(feeds >= 0.0) & (feeds <= first)]
    bend, reach = np.zeros(len(guide.opening)), np.array(guide.planar.stowed)
    rows = []
    for feed in feeds:
        free = guide.opening > feed
        if free.any():
            bend, reach = _settle(guide, feed, free, bend, reach)
        off, _ = guide.axis(bend[None], reach[None], np.array([feed]))
        rows.append((bend, reach, np.abs(off).max()))
    bends, reaches, deviations = (np.array(column) for column in zip(*rows, strict=True))
    return Postures(feeds, bends, reaches, deviations)


def _settle(guide: Follower, feed: float, free: Mask, bend: Array, reach: Array) -> tuple[Array, Array]:
    """Posture of least deviation at one feed, the free modules moved."""
    count, which = len(free), np.flatnonzero(np.concatenate([free, free]))
    legs = free[guide.owner]
    x, trust = np.concatenate([bend, reach]), _TRUST
    value = _merit(guide, feed, legs, x)
    for _ in range(_ROUNDS):
        step = _programme(guide, feed, legs, which, x, trust)
        if step is None:
            trust /= 4
        else:
            trial = np.array(x)
            trial[which] += step
            after = _merit(guide, feed, legs, trial)
            if after < value:
                done = value - after < _REST * value and np.abs(step).max() < 0.99 * trust
                x, value, trust = trial, after, trust * 1.5
                if done:
                    break
            else:
                trust /= 4
        if trust < _REST:
            break
    return x[:count], x[count:]


def _merit(guide: Follower, feed: float, legs: Mask, x: Array) -> float:
    bend, reach = np.split(x[None], 2, axis=1)
    state = guide.chain.state(guide.planar.inputs(bend, reach))
    if not state.assembles[0]:
        return np.inf
    length = state.lengths[0][legs]
    over = np.maximum(guide.least[legs] - length, length - guide.greatest[legs])
    off, _ = guide.axis(bend, reach, np.array([feed]))
    return float(np.abs(off).max() + _PRICE * np.maximum(over, 0.0).sum())


def _programme(guide: Follower, feed: float, legs: Mask, which: Index, x: Array, trust: float) -> Array | None:
    """Change of the free shape parameters, shape (k,), that makes the linearised greatest distance least; None without one."""
    # slow to load; `linprog` asks the same solver for the same answer and takes a quarter longer
    from scipy.optimize import milp

    bend, reach = np.split(x[None], 2, axis=1)
    off, J = guide.axis(bend, reach, np.array([feed]), slopes=True)
    state, S = guide.state(bend, reach)
    J, S, length = J[0][:, which], S[0][legs][:, which], state.lengths[0][legs]
    low, high = guide.least[legs] - length, guide.greatest[legs] - length
    ones = np.ones((len(J), 1))
    rows = np.block([[J, -ones], [-J, -ones], [S, np.zeros((len(S), 1))], [-S, np.zeros((len(S), 1))]])
    room = np.concatenate([-off[0], off[0], np.maximum(high, 0.0), np.maximum(-low, 0.0)])
    most = np.full(len(which), trust)
    bounds: Any = np.append(-most, 0.0), np.append(most, np.inf)
    held: Any = rows, np.full(len(rows), -np.inf), room
    found = milp(np.append(0.0 * most, 1.0), bounds=bounds, constraints=held)
    return found.x[:-1] if found.success else None
