"""The path of an arm's leader in space, and how far the arm's axis is from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.planning.directrix import LeadCurve
from vgtsim.planning.insertion import Insertion
from vgtsim.site import Site


@dataclass(frozen=True, eq=False)
class Leader:
    """A directrix in its vertical plane, which an arm follows on its way in or out.

    Attributes:
        foot: A point of the mast's axis, shape (3,), m, at z = 0 of frame G; `level` is the level direction of the plane, shape
            (3,), unit.
        deviation: Greatest distance of the axis from it in the plan, m; `bound` is the least that any posture can have.
    """

    directrix: LeadCurve
    foot: Array
    level: Array
    deviation: float
    bound: float

    def measure(self, points: Array) -> Array:
        """Distances of points of frame G, shape (..., 3), m, from the path, shape (...), m; across the plane too."""
        away = points - self.foot
        r, across = away @ self.level, np.cross(self.level, [0.0, 0.0, 1.0])
        off, _ = self.directrix.offsets(np.stack([r, points[..., 2]], axis=-1))
        return np.hypot(off, away @ across)


@dataclass(frozen=True, eq=False)
class LeaderPair:
    """Paths of an arm that goes back on one and on along another: it has to be near either."""

    first: Leader | LeaderPair
    second: Leader

    @property
    def deviation(self) -> float:
        """The greater of the planned distances, m."""
        return max(self.first.deviation, self.second.deviation)

    @property
    def bound(self) -> float:
        """The greater of the least distances that a posture can have, m."""
        return max(self.first.bound, self.second.bound)

    def measure(self, points: Array) -> Array:
        """Distances of points of frame G, shape (..., 3), m, from the nearer path, shape (...), m."""
        return np.minimum(self.first.measure(points), self.second.measure(points))


def make_leader(site: Site, way: Insertion) -> Leader:
    """The path of the leader of a way in."""
    mount = site.chain.mount
    level = mount[:3, :3] @ [np.cos(way.azimuth), np.sin(way.azimuth), 0.0]
    return Leader(way.directrix, mount[:3, 3] * [1.0, 1.0, 0.0], level, way.deviation, way.bound)
