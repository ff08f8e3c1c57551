"""Hard limits of the cylinders: how fast each may go in the coming step, and which limit says so."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.planning.timing import make_limits
from vgtsim.site import Site

Array = NDArray[np.float64]
Index = NDArray[np.intp]

RATE, ACCELERATION, STROKE = range(3)
_BRAKE = 0.5  # part of a cylinder's acceleration that it brakes with before the end of its stroke: its bound may fall meanwhile
_SOFT = 1.0  # 1/s: near a limit the speed towards it falls with the distance
_SPARE = 0.995  # of the scene's acceleration: what rounding and drives leave of a length must not break it
_LEAST = 0.05  # part of the scene's acceleration that a cylinder always has


def allow(distance: Array, acceleration: Array | float, timestep: float) -> Array:
    """Greatest speeds towards limits at distances, m, that can be stopped before them; negative beyond them, to come back.

    It is a parabola of braking with its last part replaced by a decay, so that the arm comes to rest without a jerk.
    """
    a, d = acceleration, np.maximum(distance, 0.0)
    braked = np.sqrt((a * timestep) ** 2 + 2 * a * d) - a * timestep
    return np.where(distance > 0, np.minimum(braked, _SOFT * d), _SOFT * distance)


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
        most = _SPARE * self.site.task.motion.acceleration
        lever = np.sqrt(np.einsum("ij,ij->j", jacobian[:3], jacobian[:3]))
        return np.clip(self.tool_acceleration / np.maximum(lever, 1e-9), _LEAST * most, most)

    def bound_rates(self, lengths: Array, last: Array, most: Array, timestep: float) -> tuple[Array, Array, Index]:
        """Least and greatest speeds in the coming step, shape (J,), m/s, and which limit each of them is, shape (2, J).

        Given are lengths, m, the speeds of the last step, m/s, and greatest accelerations, m/s², all of shape (J,).
        """
        box, change = self.site.box, most * timestep
        ends = allow(np.stack([lengths - box.least, box.greatest - lengths]), _BRAKE * most, timestep)
        down = np.stack([-self.rate, last - change, -ends[0]])
        up = np.stack([self.rate, last + change, ends[1]])
        low, high = down.max(axis=0), up.min(axis=0)
        if (low > high).any():  # what cannot be kept without a jump is approached as fast as the acceleration allows
            low, high = np.minimum(low, up[ACCELERATION]), np.maximum(high, down[ACCELERATION])
            middle, crossed = (low + high) / 2, low > high
            low, high = np.where(crossed, middle, low), np.where(crossed, middle, high)
        return low, high, np.stack([down.argmax(axis=0), up.argmin(axis=0)])
