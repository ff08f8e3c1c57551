"""Hard limits of the cylinders: how fast each may go in the coming step, and which limit says so."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.planning import make_limits
from vgtsim.site import Site

RATE, ACCELERATION, STROKE = range(3)
_BRAKE = 0.5  # part of a cylinder's acceleration that it brakes with before the end of its stroke: its bound may fall meanwhile
_SOFT = 1.0  # 1/s: near a limit the speed towards it falls with the distance
_SPARE = 0.995  # of the scene's acceleration: what rounding and drives leave of a length must not break it
_LEAST = 0.05  # part of the scene's acceleration that a cylinder always has


@compiled
def allow(distance: float, acceleration: float, timestep: float) -> float:
    """Greatest speed towards a limit at a distance, m, that can be stopped before it; negative beyond it, to come back.

    It is a parabola of braking with its last part replaced by a decay, so that the arm comes to rest without a jerk.
    """
    if not distance > 0:
        return _SOFT * distance
    change = acceleration * timestep
    return min(np.sqrt(change * change + 2 * acceleration * distance) - change, _SOFT * distance)


@compiled
def _fill_bounds(
    lengths: Array, last: Array, most: Array, fixed: Array, timestep: float, bounds: Array, kinds: Index
) -> None:
    """See `CylinderLimits.bound_rates`; `fixed` are greatest rates and ends of the strokes, shape (3, J)."""
    for j in range(len(lengths)):
        rate, change, brake = fixed[0, j], most[j] * timestep, _BRAKE * most[j]
        low = (-rate, last[j] - change, -allow(lengths[j] - fixed[1, j], brake, timestep))
        high = (rate, last[j] + change, allow(fixed[2, j] - lengths[j], brake, timestep))
        for kind in range(3):
            if kind == 0 or low[kind] > bounds[0, j]:
                bounds[0, j], kinds[0, j] = low[kind], kind
            if kind == 0 or high[kind] < bounds[1, j]:
                bounds[1, j], kinds[1, j] = high[kind], kind
        if bounds[0, j] > bounds[1, j]:  # what cannot be kept without a jump is approached as the acceleration allows
            least, greatest = min(bounds[0, j], high[ACCELERATION]), max(bounds[1, j], low[ACCELERATION])
            if least > greatest:
                least = greatest = (least + greatest) / 2
            bounds[0, j], bounds[1, j] = least, greatest


@compiled
def _fill_accelerations(jacobian: Array, tool: float, most: float, found: Array) -> None:
    for j in range(len(found)):
        lever = np.sqrt(jacobian[0, j] ** 2 + jacobian[1, j] ** 2 + jacobian[2, j] ** 2)
        found[j] = min(max(tool / max(lever, 1e-9), _LEAST * most), most)


@dataclass(frozen=True, eq=False)
class CylinderLimits:
    """Strokes, rates and accelerations of a site's cylinders; `tool_acceleration` is that of the tool point, m/s²."""

    site: Site
    tool_acceleration: float

    @cached_property
    def rate(self) -> Array:
        """Greatest speeds, shape (J,), m/s: what the scene's motion may use of the rated ones."""
        motion = self.site.task.motion
        return make_limits(self.site.chain, motion.rate_fraction, motion.acceleration).rate

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the cylinders."""
        return tuple(self.site.truss.member_names[i] for i in self.site.truss.actuated)

    def bound_accelerations(self, jacobian: Array) -> Array:
        """Greatest accelerations, shape (J,), m/s²: the scene's, or what gives the tool its own; the Jacobian is (6, J)."""
        found = np.empty(jacobian.shape[1])
        _fill_accelerations(
            by_rows(jacobian), self.tool_acceleration, _SPARE * self.site.task.motion.acceleration, found
        )
        return found

    def bound_rates(self, lengths: Array, last: Array, most: Array, timestep: float) -> tuple[Array, Array, Index]:
        """Least and greatest speeds in the coming step, shape (J,), m/s, and which limit each of them is, shape (2, J).

        Given are lengths, m, the speeds of the last step, m/s, and greatest accelerations, m/s², all of shape (J,).
        """
        bounds, kinds = np.empty((2, len(lengths))), np.empty((2, len(lengths)), np.intp)
        _fill_bounds(by_rows(lengths), last, most, self._fixed, timestep, bounds, kinds)
        return bounds[0], bounds[1], kinds

    @cached_property
    def _fixed(self) -> Array:
        """Greatest rates and ends of the strokes, shape (3, J)."""
        return np.stack([self.rate, self.site.box.least, self.site.box.greatest])
