"""What the null space is used for while the arm is moved: down the slope of an objective, slowly (section 6.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.control.arm_now import ArmNow
from vgtsim.planning import make_objective
from vgtsim.positioning import Configurations, Objective, tool_goal
from vgtsim.site import Site

_GAIN = 0.2  # 1/s, with which mid-stroke would be approached
_MOST = 0.25  # part of the rates that the null space may use
_FULL = 0.05  # m/s of the tool's target from which it may: an arm that nobody moves stays where it is
_EVERY = 5  # cycles for which a slope is good


@dataclass
class Preference:
    """Terms of an objective; without terms nothing is preferred. Errors are those of `planning.resolution.make_objective`."""

    site: Site
    names: tuple[str, ...]
    _cycle: int = 0
    _slope: Array | None = None

    def __post_init__(self) -> None:
        """Refuse unknown terms now and not within a step."""
        if self.names:
            self._make(np.array([1.0, 0, 0]), np.array([1.0, 0, 0]))

    def _make(self, position: Array, direction: Array) -> Objective:
        return make_objective(self.site, tool_goal(position, direction), self.names)

    def like(self, arm: ArmNow, speed: float, full: Array) -> Array:
        """Rates that the null space would like, shape (J,), m/s, while the tool's target has a speed, m/s.

        The greatest rates have shape (J,), m/s.
        """
        if not self.names or not speed:
            return np.zeros_like(full)
        slope = self._slope
        if slope is None or self._cycle % _EVERY == 0:
            at = Configurations(self.site.box, arm.state, np.zeros(1, int))
            slope = self._slope = self._make(arm.position, arm.direction).terms(at).slope[0] @ arm.inputs_by_length
        self._cycle += 1
        liked = -_GAIN * self.site.box.half**2 * slope
        size = float(np.abs(liked / full).max())
        return liked * min(1.0, _MOST / max(size, 1e-12)) * min(1.0, speed / _FULL)
