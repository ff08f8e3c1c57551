"""How near an arm in given postures comes to the tank with all that is in it, to the mast and to itself.

From tank, riser and waste a cylinder is a rod from end to end and a barrel from its eye to its mouth, as in the riser's bore
the arm has some centimetres; from the arm itself it is as thick as its barrel everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.description import Tank
from vgtsim.geometry import (
    Clearance,
    MemberPairs,
    Obstacles,
    Profile,
    Walls,
    arm_clearance,
    copy_row,
    make_profile,
    make_walls,
    nearest_pair,
    obstacles,
    pair_members,
    wall_clearance,
)
from vgtsim.kinematics import member_radii
from vgtsim.site import Site

_THIN = 1e4  # m; more than any tank


@dataclass(frozen=True)
class _Shape:
    """A part of an arm: nodes by index, capsules between them and then barrels, each between two points of its own.

    Attributes:
        ends: Points of each capsule, members and then barrels, shape (M + C, 2): nodes, then eyes and mouths in pairs.
        radii: Shape (M + C,), m; `owners` are the members that the capsules are parts of.
        cylinders: Nodes of each cylinder, shape (C, 2); `eyes` and `mouths` are distances from the first, shape (C,), m.
    """

    nodes: Index
    ends: Index
    radii: Array
    owners: Index
    cylinders: Index
    eyes: Array
    mouths: Array

    def place(self, nodes: Array) -> Array:
        """Points of the part, shape (..., P, 3), m, of an arm with nodes of shape (..., N, 3), m."""
        flat = by_rows(nodes.reshape(-1, *nodes.shape[-2:]))
        points = np.empty((len(flat), len(self.nodes) + 2 * len(self.cylinders), 3))
        _place_points(flat, self.nodes, self.cylinders, self.eyes, self.mouths, points)
        return points.reshape(*nodes.shape[:-2], -1, 3)


@compiled
def _place_points(nodes: Array, which: Index, cylinders: Index, eyes: Array, mouths: Array, points: Array) -> None:
    """Write some nodes, shape (T, N, 3), m, and then the eyes and mouths of cylinders, in pairs, into shape (T, P, 3)."""
    for t in range(len(nodes)):
        for i in range(len(which)):
            copy_row(nodes[t, which[i]], points[t, i])
        for c in range(len(cylinders)):
            near, far, length = nodes[t, cylinders[c, 0]], nodes[t, cylinders[c, 1]], 0.0
            for k in range(3):
                length += (far[k] - near[k]) ** 2
            length, eye = np.sqrt(length), len(which) + 2 * c
            for k in range(3):
                along = (far[k] - near[k]) / length
                points[t, eye, k], points[t, eye + 1, k] = near[k] + eyes[c] * along, near[k] + mouths[c] * along


@compiled
def _are_within(
    nodes: Array, tool: Array, which: Index, cylinders: Index, eyes: Array, mouths: Array, before: Array, room: float
) -> bool:
    """Whether the points of one arm, and then its tool point, are no farther than a room, m, from where they were, (P, 3)."""
    points = np.empty((1, len(before), 3))
    _place_points(nodes.reshape((1, *nodes.shape)), which, cylinders, eyes, mouths, points)
    copy_row(tool, points[0, len(before) - 1])
    for i in range(len(before)):
        square = 0.0
        for k in range(3):
            square += (points[0, i, k] - before[i, k]) ** 2
        if square > room * room:
            return False
    return True


@dataclass(frozen=True, eq=False)
class Proximity:
    """Measures distances of a site's arm; nodes have shape (..., N, 3) and tool points shape (..., 3), m, in frame G."""

    site: Site

    @cached_property
    def _radii(self) -> Array:
        return member_radii(self.site.chain)

    def _shape(self, which: Index, nodes: Index) -> _Shape:
        """The part of some members and nodes."""
        arm, truss = self.site.arm, self.site.truss
        driven = np.array([truss.members[i].role == "actuator" for i in which], bool)
        tubes = [arm.cylinders[truss.members[i].section] for i in which[driven]]
        radii = np.array(self._radii[which])
        barrels, radii[driven] = radii[driven], [tube.rod / 2 for tube in tubes]
        pairs = len(nodes) + np.arange(2 * len(tubes)).reshape(-1, 2)
        return _Shape(
            nodes=nodes,
            ends=np.concatenate([np.searchsorted(nodes, truss.ends[which]), pairs]),
            radii=np.concatenate([radii, barrels]),
            owners=np.concatenate([which, which[driven]]),
            cylinders=truss.ends[which[driven]],
            eyes=np.array([tube.eye for tube in tubes]),
            mouths=np.array([tube.barrel_length for tube in tubes]),
        )

    @cached_property
    def _whole(self) -> _Shape:
        truss = self.site.truss
        return self._shape(np.arange(len(truss.members)), np.arange(len(truss.nodes)))

    @cached_property
    def _modules(self) -> tuple[_Shape, ...]:
        truss, parts = self.site.truss, []
        for k in range(len(self.site.arm.modules)):
            which = np.flatnonzero(truss.module == k)
            mine = np.concatenate([truss.ends[which].ravel(), np.flatnonzero(truss.node_module == k)])
            parts.append(self._shape(which, np.unique(mine)))
        return tuple(parts)

    @cached_property
    def _tank(self) -> tuple[Tank, Profile, Obstacles]:
        tank, bed = self.site.tank, self.site.bed
        around = obstacles(tank)
        return tank, make_profile(tank.shell), around if bed is None else replace(around, bed=bed)

    @cached_property
    def _walls(self) -> Walls:
        return make_walls(*self._tank)

    def _place_waste(self, heights: Array | None) -> Walls:
        """The walls with waste of some heights."""
        if heights is None or self.site.diggings is None:
            return self._walls
        tank, profile, around = self._tank
        return make_walls(tank, profile, replace(around, bed=self.site.diggings.cut_bed(heights)))

    @cached_property
    def _pairs(self) -> MemberPairs:
        """Pairs of members of the arm, mast and payload; the mast counts as before the first module, the payload in the last."""
        site, count = self.site, len(self.site.truss.nodes)
        ends = np.concatenate([site.truss.ends, [[count, count + 1], [count + 2, count + 2]]])
        radii = np.append(self._radii, [site.mast.outer_diameter / 2, site.task.payload.radius])
        return pair_members(ends, radii, np.append(site.truss.module, [-1, len(site.arm.modules) - 1]), 2)

    @cached_property
    def _mast(self) -> Array:
        """Heights of the ends of the mast's capsule above the arm's base face, as displacements, shape (2, 3), m."""
        return np.outer([self.site.mast.outer_diameter / 2, self.site.mast.length], [0, 0, 1])

    def points(self, nodes: Array, tool: Array) -> Array:
        """Nodes, eyes and mouths of cylinders, and the tool point, shape (..., P, 3), m: all between them goes no farther."""
        return np.concatenate([self._whole.place(nodes), tool[..., None, :]], axis=-2)

    def stays(self, nodes: Array, tool: Array, places: Array, room: float) -> bool:
        """Whether none of the `points` of one posture is farther than a room, m, from places, shape (P, 3), m."""
        shape = self._whole
        return _are_within(nodes, tool, shape.nodes, shape.cylinders, shape.eyes, shape.mouths, places, room)

    def around(self, nodes: Array, tool: Array, heights: Array | None = None) -> Clearance:
        """Distances of the arm from tank, riser, equipment and waste, whose heights are given where it is cut, shape (P,), m."""
        return self._measure(nodes, tool, frozenset(), heights)

    def apart(self, nodes: Array, tool: Array, heights: Array | None = None) -> Clearance:
        """As `around`, but for the parts that may touch a place, which are not measured from it."""
        found, site = self.around(nodes, tool, heights), self.site
        allowed: dict[str, set[str]] = {}
        for rule in site.task.contacts:
            allowed.setdefault(rule.place, set()).add(rule.part)
        distance, body = found.distance.copy(), found.body.copy()
        for place, kinds in allowed.items():
            column = found.places.index(place)
            left = self._measure(nodes, tool, frozenset(kinds), heights)
            distance[..., column], body[..., column] = left.distance[..., column], left.body[..., column]
        return replace(found, distance=distance, body=body)

    def _measure(self, nodes: Array, tool: Array, without: frozenset[str], heights: Array | None) -> Clearance:
        """Distances of an arm whose parts of some kinds are so thin that they are far from everything."""
        radii, parts = self._outline(without)
        balls = self.points(nodes, tool)
        if not self.site.task.payload.mass:
            balls = balls[..., :-1, :]
        walls, names = self._place_waste(heights), self._tank[2].names
        found = wall_clearance(balls, self._whole.ends, radii, walls, names)
        return replace(found, body=parts[found.body])

    def _outline(self, without: frozenset[str]) -> tuple[Array, Index]:
        """Radii of capsules and balls, shape (M + C + N, ...), m, see `_measure`, and the part of the arm that each is."""
        if (made := self._outlines.get(without)) is not None:
            return made
        site, payload, tip = self.site, self.site.task.payload, self.site.truss.tip
        shape, count = self._whole, len(self.site.truss.nodes)
        balls = np.zeros(count + 2 * len(shape.cylinders))  # eyes and mouths are points inside barrels
        balls[:count] = site.arm.hub.radius - _THIN * ("hubs" in without)
        balls[tip] = site.arm.hub.radius - _THIN * ("tool" in without)
        near_tip = (site.truss.ends >= tip.start).any(axis=1)  # what ends at a hub that may touch is as near as the hub
        spared = ("members" in without or "hubs" in without) | (near_tip & ("tool" in without))
        balls[count:] -= _THIN * spared.any()
        ball = [payload.radius - _THIN * ("tool" in without)] if payload.mass else []
        radii = np.concatenate([shape.radii - _THIN * spared[shape.owners], balls, ball])
        parts = [shape.owners, len(self._radii) + np.arange(count), np.full(len(balls) - count, -1)]
        made = radii, np.concatenate([*parts, [len(self._radii) + count]])
        self._outlines[without] = made
        return made

    @cached_property
    def _outlines(self) -> dict[frozenset[str], tuple[Array, Index]]:
        return {}

    def leave_out(self, found: Clearance, time: Array | float) -> Clearance:
        """Distances at times of the run, shape (...), s, of which those from things that had not appeared yet are infinite."""
        appearances = self.site.tank.appearances
        if not appearances:
            return found
        since = np.array([appearances.get(place, 0.0) for place in found.places])
        there = since <= np.asarray(time)[..., None]
        return replace(found, distance=np.where(there, found.distance, np.inf))

    def by_module(self, nodes: Array, tool: Array, together: bool = False) -> tuple[Array, tuple[str, ...]]:
        """Distances of each module from tank, riser, equipment and waste, shape (..., K, P), m, and the names of the places.

        If of each module's distances from the waste only the least of the whole batch counts, `together`, others may be less
        than they are, but not less than the least.
        """
        around = self._tank[2]
        flat, tools = nodes.reshape(-1, *nodes.shape[-2:]), tool.reshape(-1, 3)
        measure = self._measure_lowest if together and around.bed is not None else self._measure_module
        found = [measure(k, flat, tools, around) for k in range(len(self._modules))]
        distance = np.stack([item.distance for item in found], axis=-2)
        return distance.reshape(*nodes.shape[:-2], *distance.shape[-2:]), found[0].places

    def _measure_module(self, k: int, nodes: Array, tool: Array, around: Obstacles) -> Clearance:
        """Distances of a module in arms of nodes, shape (B, N, 3), m, and tool points, shape (B, 3), m."""
        site, shape = self.site, self._modules[k]
        tank, profile, _ = self._tank
        points = shape.place(nodes)
        balls = np.zeros(points.shape[-2])
        balls[: len(shape.nodes)] = site.arm.hub.radius
        ball = (tool, site.task.payload.radius) if k == len(self._modules) - 1 else None
        return arm_clearance(points, shape.ends, shape.radii, balls, tank, profile, around, ball)

    def _measure_lowest(self, k: int, nodes: Array, tool: Array, around: Obstacles) -> Clearance:
        """The same, from uneven waste only where it can be the least of the batch.

        That costs much from afar; waste that is level at its highest is at most as far, and tells which postures can be it.
        """
        assert around.bed is not None
        found = self._measure_module(
            k, nodes, tool, replace(around, bed=None, waste_level=float(around.bed.heights.max()))
        )
        waste = found.distance[:, -1]
        lowest = np.argmin(waste, keepdims=True)
        enough = self._measure_module(k, nodes[lowest], tool[lowest], around).distance[0, -1]
        rows = np.flatnonzero(waste <= enough)
        waste[rows] = self._measure_module(k, nodes[rows], tool[rows], around).distance[:, -1]
        return found

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
