"""The line from the arm to the nearest thing in its tank, for the eye; the distance itself is that of `Proximity`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import (
    WASTE,
    Bed,
    Obstacles,
    Profile,
    enclosure_distance,
    make_bed,
    make_profile,
    obstacles,
    segment_distance,
)
from vgtsim.kinematics.inertia import member_radii
from vgtsim.proximity import Proximity
from vgtsim.site import Site

Array = NDArray[np.float64]

_ALONG = np.linspace(0.0, 1.0, 33)[:, None]  # parts of a member at which it is held against riser and waste


@dataclass(frozen=True, eq=False)
class Gap:
    """The least distance, m, of the arm from a thing, with its name, and the line between them, shape (2, 3), m."""

    distance: float
    place: str
    line: Array


@dataclass(frozen=True, eq=False)
class Nearest:
    """Finds what is nearest to a site's arm; parts that may touch a place are not held against it."""

    site: Site

    @cached_property
    def _proximity(self) -> Proximity:
        return Proximity(self.site)

    @cached_property
    def _profile(self) -> Profile:
        return make_profile(self.site.tank.shell)

    @cached_property
    def _around(self) -> Obstacles:
        return obstacles(self.site.tank)

    @cached_property
    def _bed(self) -> Bed | None:
        return make_bed(self.site.tank)

    @cached_property
    def _radii(self) -> Array:
        """Radii of members, nodes and payload."""
        members = member_radii(self.site.arm, self.site.truss)
        hubs = np.full(len(self.site.truss.nodes), self.site.arm.hub.radius)
        return np.concatenate([members, hubs, [self.site.task.payload.radius]])

    def find(self, nodes: Array, tool: Array) -> list[Gap]:
        """The nearest thing in each of T postures: nodes of shape (T, N, 3) and tool points of shape (T, 3), m, in frame G."""
        found, gaps = self._proximity.apart(nodes, tool), []
        for t, k in enumerate(found.nearest.tolist()):
            place = found.places[k]
            line = self._draw(place, int(found.body[t, k]), nodes[t], tool[t])
            gaps.append(Gap(float(found.distance[t, k]), place, line))
        return gaps

    def _draw(self, place: str, body: int, nodes: Array, tool: Array) -> Array:
        """The shortest line from the surface of a part of the arm to that of a place."""
        truss, radius = self.site.truss, self._radii[body]
        count = len(truss.members)
        if body < count:
            first, second = nodes[truss.ends[body]]
        else:
            first = second = tool if body == count + len(truss.nodes) else nodes[body - count]
        around = self._around
        if place in around.names:
            k = around.names.index(place)
            _, s, t = segment_distance(first, second, *around.axes[k])
            near, far = first + s * (second - first), around.axes[k, 0] + t * (around.axes[k, 1] - around.axes[k, 0])
            away = (near - far) / np.linalg.norm(near - far)
            return np.stack([near - radius * away, far + around.radii[k] * away])
        points = first + _ALONG * (second - first)
        distance, away = self._measure(place, points)
        k = int(np.argmin(distance))
        return np.stack([points[k] - radius * away[k], points[k] - distance[k] * away[k]])

    def _measure(self, place: str, points: Array) -> tuple[Array, Array]:
        """Distances of points from shell, riser or waste, shape (n,), m, and directions away from it, shape (n, 3)."""
        if place != WASTE:
            return enclosure_distance(self.site.tank, self._profile, points)
        if self._bed is not None:
            return self._bed.distance(points)
        return points[:, 2] - self.site.tank.waste.level, np.tile([0.0, 0.0, 1.0], (len(points), 1))
