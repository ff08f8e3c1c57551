"""How near an arm in given postures comes to the tank with all that is in it, to the mast and to itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry import (
    Clearance,
    MemberPairs,
    Obstacles,
    Profile,
    arm_clearance,
    make_profile,
    nearest_pair,
    obstacles,
    pair_members,
)
from vgtsim.kinematics.inertia import member_radii
from vgtsim.site import Site

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_THIN = 1e4  # m; more than any tank


@dataclass(frozen=True, eq=False)
class Proximity:
    """Measures distances of a site's arm; nodes have shape (..., N, 3) and tool points shape (..., 3), m, in frame G."""

    site: Site

    @cached_property
    def _radii(self) -> Array:
        return member_radii(self.site.arm, self.site.truss)

    @cached_property
    def _tank(self) -> tuple[Tank, Profile, Obstacles]:
        tank = self.site.tank
        return tank, make_profile(tank.shell), obstacles(tank)

    @cached_property
    def _pairs(self) -> MemberPairs:
        """Pairs of members of the arm, of the mast, which is before the first module, and of the payload in the last one."""
        site, count = self.site, len(self.site.truss.nodes)
        ends = np.concatenate([site.truss.ends, [[count, count + 1], [count + 2, count + 2]]])
        radii = np.append(self._radii, [site.mast.outer_diameter / 2, site.task.payload.radius])
        return pair_members(ends, radii, np.append(site.truss.module, [-1, len(site.arm.modules) - 1]), 2)

    @cached_property
    def _mast(self) -> Array:
        """Heights of the ends of the mast's capsule above the arm's base face, as displacements, shape (2, 3), m."""
        return np.outer([self.site.mast.outer_diameter / 2, self.site.mast.length], [0, 0, 1])

    def around(self, nodes: Array, tool: Array) -> Clearance:
        """Distances of the arm from tank, riser, equipment and waste."""
        return self._measure(nodes, tool, set())

    def apart(self, nodes: Array, tool: Array) -> Clearance:
        """As `around`, but for the parts that may touch a place, which are not measured from it."""
        found, site = self.around(nodes, tool), self.site
        allowed: dict[str, set[str]] = {}
        for rule in site.task.contacts:
            allowed.setdefault(rule.place, set()).add(rule.part)
        distance, body = found.distance.copy(), found.body.copy()
        for place, kinds in allowed.items():
            column = found.places.index(place)
            left = self._measure(nodes, tool, kinds)
            distance[..., column], body[..., column] = left.distance[..., column], left.body[..., column]
        return replace(found, distance=distance, body=body)

    def _measure(self, nodes: Array, tool: Array, without: set[str]) -> Clearance:
        """Distances of an arm whose parts of some kinds are so thin that they are far from everything."""
        site, payload, tip = self.site, self.site.task.payload, self.site.truss.tip
        hubs = np.full(nodes.shape[-2], site.arm.hub.radius) - _THIN * ("hubs" in without)
        hubs[tip] = site.arm.hub.radius - _THIN * ("tool" in without)
        ball = (tool, payload.radius - _THIN * ("tool" in without)) if payload.mass else None
        near_tip = (site.truss.ends >= tip.start).any(axis=1)  # what ends at a hub that may touch is as near as the hub
        spared = ("members" in without or "hubs" in without) | (near_tip & ("tool" in without))
        radii = self._radii - _THIN * spared
        return arm_clearance(nodes, site.truss.ends, radii, hubs, *self._tank, ball)

    def among(self, nodes: Array, tool: Array) -> tuple[Array, Index]:
        """Least distance of the arm from itself and the mast, shape (...), m, and the pair of parts, shape (..., 2).

        Parts are members, then the mast, then the payload.
        """
        mast = nodes[..., self.site.truss.base, :].mean(axis=-2)[..., None, :] + self._mast
        return nearest_pair(self._pairs, np.concatenate([nodes, mast, tool[..., None, :]], axis=-2))

    def name_around(self, part: int) -> str:
        """Name of a part in `Clearance.body`: members, then nodes, then the payload."""
        return [*self.site.truss.member_names, *self.site.truss.nodes, "payload"][part]

    def name_among(self, part: int) -> str:
        """Name of a part in the pairs of `among`."""
        return [*self.site.truss.member_names, "mast", "payload"][part]
