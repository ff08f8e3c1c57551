"""The instants at which a run is recorded."""

from __future__ import annotations

import numpy as np

from vgtsim.errors import CommandError

_SAME_STEP = 1e-6  # of a step: by which rounding may move the instant of a record


class RecordClock:
    """Tells which steps are recorded: the first one at or after each instant that a rate asks for."""

    def __init__(self, timestep: float, rate: float) -> None:
        """Begin at the first step of a time step, s, with a rate, Hz; errors are those of `set_rate`."""
        self._timestep = timestep
        self.set_rate(rate, 0)

    def set_rate(self, rate: float, steps: int) -> None:
        """Take a rate, Hz, from the coming step on, before which so many were made.

        Raises:
            CommandError: It is negative or above that of the steps.
        """
        most = 1 / self._timestep
        if not 0 <= rate <= most * (1 + _SAME_STEP):
            raise CommandError("record_rate", f"{rate:g} Hz", f"0 to {most:g} Hz, the rate of steps")
        self.rate, self._first, self._taken = rate, steps, 0

    def is_due(self, steps: int) -> bool:
        """Whether the coming step is recorded, before which so many were made; to be asked once a step."""
        due = self._taken / (self.rate * self._timestep) if self.rate else np.inf
        recorded = steps - self._first >= due - _SAME_STEP
        self._taken += recorded
        return recorded
