"""Measured lengths: what posture the arm really has, and how far the commands must go for it to have the wanted one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.kinematics import Chain, State

_SAME = 1e-9  # m: lengths that are as commanded
_GAIN = 0.2  # 1/s, below twice the damping ratio of a slow elastic arm times its frequency, above which the trim would shake it
_FILTER = 0.5  # s, of the error: most of an arm's ringing does not pass
_SMALL = 1e-4  # m: a smaller error is left, so that an arm at rest comes to rest
_MOST = 0.02  # m: what a drive is off by more is no sag


@dataclass
class Feedback:
    """Follows the measured lengths, whose last state that assembles is `measured`; a slow trim takes away what drives leave."""

    chain: Chain
    measured: State = field(init=False)
    _error: Array = field(init=False)
    _trim: Array = field(init=False)
    _filtered: Array = field(init=False)

    def start(self, state: State) -> None:
        """Begin with lengths as commanded."""
        self.measured = state
        self._error, self._trim, self._filtered = (np.zeros_like(state.lengths[0]) for _ in range(3))

    def look(self, wanted: State, commanded: Array, lengths: Array) -> None:
        """Take the wanted state, and lengths as commanded and as measured at one instant, shape (J,), m."""
        self._error = commanded - self._trim - lengths
        for near in (wanted, self.measured):
            if np.abs(lengths - near.lengths[0]).max() <= _SAME:
                self.measured = near
                return
        self.measured = self.chain.follow(lengths, self.measured) or self.measured

    def trim(self, rate: Array, moving: bool, timestep: float) -> Array:
        """What is to be added to the wanted lengths for a step, s, shape (J,), m; rates are the greatest, m/s."""
        _advance(self._error, rate, moving, timestep, self._filtered, self._trim)
        return self._trim


@compiled
def _advance(error: Array, rate: Array, moving: bool, timestep: float, filtered: Array, trim: Array) -> None:
    """Filter the error, and move the trim while the arm moves or something is off; both in place."""
    share, off = -np.expm1(-timestep / _FILTER), False
    for j in range(len(error)):
        filtered[j] += share * (error[j] - filtered[j])
        off = off or abs(filtered[j]) > _SMALL
    if off or moving:
        for j in range(len(error)):
            change = _GAIN * filtered[j] if abs(filtered[j]) > _SMALL else 0.0
            change = min(max(change, -0.1 * rate[j]), 0.1 * rate[j])  # a tenth: the wish has the rest
            trim[j] = min(max(trim[j] + timestep * change, -_MOST), _MOST)
