"""A piece of a tank's profile: a straight line or an arc."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, pi, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Piece:
    """An arc, or a straight line, of the profile, from its first point (r, z), m, the tangent point with the piece before.

    The heading there is from the r axis towards z, rad; the turn is to the left, rad; the length is in m.
    """

    name: str
    start: tuple[float, float]
    heading: float
    turn: float
    length: float

    @property
    def curvature(self) -> float:
        """1/m; the interior lies to the left."""
        return self.turn / self.length

    @property
    def radius(self) -> float:
        """m; infinite for a straight piece."""
        return self.length / self.turn if self.turn else inf

    @property
    def centre(self) -> tuple[float, float]:
        """Centre (r, z) of the arc, m; at infinity for a straight piece."""
        if not self.turn:
            upright = sin(self.heading) > 0.5
            return (-inf if upright else self.start[0], inf if cos(self.heading) > 0.5 else self.start[1])
        return (self.start[0] - self.radius * sin(self.heading), self.start[1] + self.radius * cos(self.heading))

    @property
    def end(self) -> tuple[float, float]:
        """Its last point (r, z), m; the tangent point with the piece after."""
        r, z = self.at(self.length)
        return (float(r), float(z))

    def at(self, distance: ArrayLike) -> Array:
        """Points (r, z), shape (..., 2), m, at arc lengths from the start of the piece, shape (...), m."""
        s = np.asarray(distance, float)
        half = self.curvature * s / 2
        chord = s * np.sinc(half / pi)
        r, z = self.start[0] + chord * np.cos(self.heading + half), self.start[1] + chord * np.sin(self.heading + half)
        return np.stack([r, z], -1)
