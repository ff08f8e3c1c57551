"""What an arm must keep clear of, as rows for a solver: each near pair's gap and its derivative."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.tank import Tank
from vgtsim.geometry import (
    Obstacles,
    Profile,
    arm_clearance,
    enclosure_distance,
    make_profile,
    obstacles,
    segment_distance,
    self_clearance,
)
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_APART = 3  # modules nearer than this in the chain cannot touch inside their strokes; `least` looks at them all the same


@dataclass(frozen=True)
class Rows:
    """The pairs that are nearer than some reach.

    Attributes:
        config: Configuration of each pair, shape (R,).
        gap: Distance between the surfaces, shape (R,), m.
        gradient: Derivative of the gap by that configuration's inputs, shape (R, 3 A); empty when not asked for.
    """

    config: Index
    gap: Array
    gradient: Array


@dataclass(frozen=True)
class Body:
    """The arm as capsules: a segment between two points, and a radius.

    Attributes:
        ends: Points of each capsule, shape (M, 2); nodes first, then the tool point.
        radii: Shape (M,), m.
        module: Shape (M,).
        point_radii: Radius of the ball at each point, shape (N + 1,), m: the greatest of hub and members there.
    """

    ends: Index
    radii: Array
    module: Index
    point_radii: Array


def member_radii(manipulator: Manipulator, roles_and_sections: list[tuple[str, str]]) -> Array:
    """Radius of the capsule around each member.

    Args:
        manipulator: The arm.
        roles_and_sections: Role and section of each member.

    Returns:
        Shape (M,), m: of the tube, or of the barrel for a cylinder over its whole length.
    """
    return np.array(
        [
            manipulator.cylinders[section].barrel_diameter / 2
            if role == "actuator"
            else manipulator.tubes[section].outer_diameter / 2
            for role, section in roles_and_sections
        ]
    )


@dataclass(frozen=True)
class Surroundings:
    """Tank, equipment, waste, mast and the arm itself.

    Attributes:
        chain: The arm.
        tank: The tank.
        payload_radius: Of the ball about the tool point, m.
        mast_radius: Of the pipe above the arm's base, m.
    """

    chain: Chain
    tank: Tank
    payload_radius: float
    mast_radius: float

    @cached_property
    def profile(self) -> Profile:
        """Meridian of the tank."""
        return make_profile(self.tank.shell)

    @cached_property
    def obstacles(self) -> Obstacles:
        """Equipment and waste."""
        return obstacles(self.tank)

    @cached_property
    def body(self) -> Body:
        """Members, the plate's edges and the payload as capsules."""
        manipulator, truss = self.chain.manipulator, self.chain.truss
        count = len(truss.nodes)
        radii = member_radii(manipulator, [(item.role, item.section) for item in truss.members])
        last = len(manipulator.modules) - 1
        tip = range(count - 3, count)
        plate = [(tip[0], tip[1]), (tip[1], tip[2]), (tip[2], tip[0])]
        ends = np.array([*(item.ends for item in truss.members), *plate, (count, count)])
        radii = np.concatenate([radii, np.full(3, manipulator.tip_plate.thickness / 2), [self.payload_radius]])
        module = np.array([*(item.module for item in truss.members), *[last] * 4])
        point_radii = np.full(count + 1, manipulator.hub.radius)
        np.maximum.at(point_radii, ends.ravel(), np.repeat(radii, 2))
        return Body(ends, radii, module, point_radii)

    @cached_property
    def _pairs(self) -> tuple[Index, Index, Index, Index]:
        """Pairs of capsules that may meet (first, second), and pairs of module indices (first, second)."""
        module = self.body.module
        first, second = np.nonzero(module[None, :] - module[:, None] >= _APART)
        low, high = np.nonzero(np.subtract.outer(np.arange(module.max() + 1), np.arange(module.max() + 1)).T >= _APART)
        return first, second, low, high

    @cached_property
    def _cylinders(self) -> tuple[tuple[str, Array, float, Index], ...]:
        """Name, axis (2, 3), radius and the capsules that may meet it, for the equipment and the mast."""
        every = np.arange(len(self.body.ends))
        around = self.obstacles
        found = [(n, a, float(r), every) for n, a, r in zip(around.names, around.axes, around.radii, strict=True)]
        foot = self.chain.mount[:3, 3]
        head = np.array([foot[0], foot[1], max(self.profile.crown, foot[2])])
        found.append(("mast", np.stack([foot, head]), self.mast_radius, every[self.body.module >= 1]))
        return tuple(found)

    def points(self, q: Array) -> Array:
        """Nodes and then the tool point, in frame G, shape (W, N + 1, 3), m, for inputs of shape (W, A, 3)."""
        return np.concatenate([self.chain.nodes(q), self.chain.tool(q)[0][..., None, :]], axis=-2)

    def _points_and_slopes(self, q: Array) -> tuple[Array, Array]:
        nodes, J = self.chain.node_jacobian(q)
        tool = self.chain.tool(q)[0][..., None, :]
        slope = self.chain.jacobian(q)[..., None, :3, :]
        return np.concatenate([nodes, tool], axis=-2), np.concatenate([J, slope], axis=-3)

    def rows(self, q: Array, reach: float, slopes: bool = True) -> Rows:
        """Pairs nearer than a reach.

        Args:
            q: Inputs, shape (W, A, 3).
            reach: m.
            slopes: Whether the gradients are wanted.

        Returns:
            One row for each pair, in a fixed order.
        """
        points, J = self._points_and_slopes(q) if slopes else (self.points(q), None)
        parts = [self._shell_rows(points, reach), self._waste_rows(points, reach)]
        parts += [self._cylinder_rows(points, reach, item[1], item[2], item[3]) for item in self._cylinders]
        parts.append(self._self_rows(points, reach))
        config = np.concatenate([part[0] for part in parts])
        gap = np.concatenate([part[1] for part in parts])
        if J is None:
            return Rows(config, gap, np.zeros((len(gap), 0)))
        gradient = [_chain_rule(J, part[0], part[2], part[3]) for part in parts]
        return Rows(config, gap, np.concatenate(gradient))

    def _shell_rows(self, points: Array, reach: float) -> tuple[Index, Array, Index, Array]:
        """Config, gap, point indices (R, k) and the gap's derivative by those points (R, k, 3)."""
        distance, inward = enclosure_distance(self.tank, self.profile, points)
        gap = distance - self.body.point_radii
        gap[:, :3] = np.inf  # the mast flange does not move
        config, point = np.nonzero(gap < reach)
        return config, gap[config, point], point[:, None], inward[config, point][:, None, :]

    def _waste_rows(self, points: Array, reach: float) -> tuple[Index, Array, Index, Array]:
        gap = points[..., 2] - self.obstacles.waste_level - self.body.point_radii
        config, point = np.nonzero(gap < reach)
        up = np.broadcast_to([0.0, 0.0, 1.0], (len(point), 1, 3))
        return config, gap[config, point], point[:, None], up

    def _cylinder_rows(
        self, points: Array, reach: float, axis: Array, radius: float, capsules: Index
    ) -> tuple[Index, Array, Index, Array]:
        ends = self.body.ends[capsules]
        a, b = points[:, ends[:, 0]], points[:, ends[:, 1]]
        margin = self.body.radii[capsules] + radius + reach
        # a capsule farther than this from the axis as an endless line cannot be near it
        flat = np.minimum(np.hypot(*(a - axis[0])[..., :2].T), np.hypot(*(b - axis[0])[..., :2].T)).T
        config, near = np.nonzero(flat < margin + np.linalg.norm(b - a, axis=-1))
        a, b = a[config, near], b[config, near]
        distance, s, t = segment_distance(a, b, axis[0], axis[1])
        gap = distance - self.body.radii[capsules[near]] - radius
        keep = gap < reach
        apart = a + s[:, None] * (b - a) - axis[0] - t[:, None] * (axis[1] - axis[0])
        unit = apart / np.maximum(distance, 1e-9)[:, None]
        slope = np.stack([(1 - s)[:, None] * unit, s[:, None] * unit], axis=1)
        return config[keep], gap[keep], ends[near[keep]], slope[keep]

    def _self_rows(self, points: Array, reach: float) -> tuple[Index, Array, Index, Array]:
        first, second, config = self._near_pairs(points, reach)
        ends = np.concatenate([self.body.ends[first], self.body.ends[second]], axis=1)
        corner = points[config[:, None], ends]
        distance, s, t = segment_distance(corner[:, 0], corner[:, 1], corner[:, 2], corner[:, 3])
        gap = distance - self.body.radii[first] - self.body.radii[second]
        keep = gap < reach
        weight = np.stack([1 - s, s, t - 1, -t], axis=1)
        apart = np.einsum("rk,rkx->rx", weight, corner) / np.maximum(distance, 1e-9)[:, None]
        return config[keep], gap[keep], ends[keep], (weight[..., None] * apart[:, None, :])[keep]

    def _near_pairs(self, points: Array, reach: float) -> tuple[Index, Index, Index]:
        """Pairs of capsules of modules whose bounding balls come within reach: first, second, config."""
        first, second, low, high = self._pairs
        count = int(self.body.module.max()) + 1
        centre, size = np.empty((len(points), count, 3)), np.empty((len(points), count))
        for k in range(count):
            mine = points[:, np.unique(self.body.ends[self.body.module == k])]
            centre[:, k] = (mine.min(axis=1) + mine.max(axis=1)) / 2
            size[:, k] = np.linalg.norm(mine - centre[:, k, None], axis=-1).max(axis=-1)
        limit = 2 * float(self.body.radii.max()) + reach
        close = np.linalg.norm(centre[:, low] - centre[:, high], axis=-1) < size[:, low] + size[:, high] + limit
        config, pair = np.nonzero(close)
        if not len(config):
            empty = np.zeros(0, np.intp)
            return empty, empty, empty
        table = np.zeros((len(points), count, count), bool)
        table[config, low[pair], high[pair]] = True
        member_config, chosen = np.nonzero(table[:, self.body.module[first], self.body.module[second]])
        a, b = self.body.ends[first[chosen]], self.body.ends[second[chosen]]
        p = points[member_config[:, None], a]
        r = points[member_config[:, None], b]
        half = np.linalg.norm(p[:, 1] - p[:, 0], axis=-1) + np.linalg.norm(r[:, 1] - r[:, 0], axis=-1)
        near = np.linalg.norm(p.mean(axis=1) - r.mean(axis=1), axis=-1) < half / 2 + limit
        return first[chosen[near]], second[chosen[near]], member_config[near]

    def clearance(self, q: Array) -> tuple[Array, list[str]]:
        """Least clearance of every configuration, from everything and of the arm from itself.

        Args:
            q: Inputs, shape (W, A, 3).

        Returns:
            Shape (W,), m, and what is that near in each.
        """
        body, points = self.body, self.points(q)
        members = len(self.chain.truss.members)
        found = arm_clearance(
            points[:, :-1],
            body.ends[:members],
            body.radii[:members],
            self.chain.manipulator.hub.radius,
            self.tank,
            self.profile,
            self.obstacles,
            (points[:, -1], self.payload_radius),
        )
        own, _ = self_clearance(points, body.ends, body.radii, body.module)
        _, axis, radius, capsules = self._cylinders[-1]
        a, b = points[:, body.ends[capsules, 0]], points[:, body.ends[capsules, 1]]
        mast = np.min(segment_distance(a, b, axis[0], axis[1])[0] - body.radii[capsules] - radius, axis=1)
        columns = np.concatenate([found.distance, own[:, None], mast[:, None]], axis=1)
        names = (*found.places, "the arm itself", "mast")
        return columns.min(axis=1), [names[k] for k in columns.argmin(axis=1)]

    def least(self, q: Array) -> tuple[float, str]:
        """Least clearance of one configuration, m, and what is that near; q of shape (A, 3)."""
        distance, names = self.clearance(q[None])
        return float(distance[0]), names[0]


def _chain_rule(J: Array, config: Index, point: Index, slope: Array) -> Array:
    """Derivative of gaps by the inputs, shape (R, 3 A), from that by the points (R, k, 3)."""
    return np.einsum("rkx,rkxj->rj", slope, J[config[:, None], point])
