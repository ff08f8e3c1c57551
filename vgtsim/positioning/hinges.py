"""Clearance as an objective: hinges that rise when a pair of bodies comes too near."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.positioning.objectives import Configurations, Objective, Terms
from vgtsim.positioning.surroundings import Surroundings

Array = NDArray[np.float64]

_STEP = 1e-6  # of one-sided differences of closed-form slopes, in units of the inputs: the root of their rounding


@dataclass(frozen=True)
class ClearanceHinges(Objective):
    """Half the sum of squares of hinges, one for each near pair of bodies.

    A hinge begins `softness`, m, beyond the wanted clearance, m, and is 1 at it. `payload` tells whether the payload's
    distance from all but the arm counts: it is constant where goal rows hold the tool.
    """

    surroundings: Surroundings
    wanted: float = 0.12
    softness: float = 0.10
    payload: bool = True
    name: str = "clearance"

    @property
    def dear(self) -> bool:
        """Slopes take the derivatives of all nodes."""
        return True

    def terms(self, at: Configurations) -> Terms:
        """In closed form, with Gauss and Newton's curvature."""
        rows = self.surroundings.rows(at.state, self.wanted + self.softness, payload=self.payload)
        batch, count = at.q.shape
        rise = self._rise(rows.gap)
        value, slope, dense = np.zeros(batch), np.zeros((batch, count)), np.zeros((batch, count, count))
        np.add.at(value, rows.config, 0.5 * rise**2)
        for b in np.unique(rows.config):
            mine = rows.config == b
            gradient = rows.gradient[mine] / self.softness
            slope[b], dense[b] = -rise[mine] @ gradient, gradient.T @ gradient
        return Terms(value, slope, dense=dense)

    def values(self, at: Configurations) -> Array:
        """Without gradients."""
        rows = self.surroundings.rows(at.state, self.wanted + self.softness, slopes=False, payload=self.payload)
        value = np.zeros(len(at.q))
        np.add.at(value, rows.config, 0.5 * self._rise(rows.gap) ** 2)
        return value

    def _rise(self, gap: Array) -> Array:
        return (self.wanted - gap) / self.softness + 1

    def bend(self, at: Configurations) -> Array:
        """Curvature that Gauss and Newton leave out, by differences of slopes, shape (b, n, n).

        A goal near a wall holds the tool and the last nodes: the multipliers of the rows balance the slopes of those
        hinges, so without their curvatures steps along the null space look far too long.
        """
        first = self.terms(at)
        assert first.dense is not None
        found, used = np.zeros_like(first.dense), np.flatnonzero(first.value > 0)
        if not len(used):
            return found
        shift = _STEP * np.eye(first.slope.shape[1])
        moved = (at.q[used, None] + shift).reshape(-1, len(shift))
        there = replace(at, state=at.box.chain.state(moved), which=np.repeat(at.which[used], len(shift)))
        slope = self.terms(there).slope.reshape(len(used), len(shift), -1)
        found[used] = (slope - first.slope[used, None]) / _STEP - first.dense[used]
        return (found + np.swapaxes(found, 1, 2)) / 2
