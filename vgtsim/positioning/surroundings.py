"""What an arm must keep clear of, as rows for a solver: each near pair's gap and its derivative."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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
from vgtsim.positioning.capsules import Capsules, make_capsules, near_pairs

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_STEP = 1e-6  # of the differences of the sag, in units of the inputs
_Part = tuple[
    Index, Array, Index, Array
]  # configuration, gap, points (R, k) and the gap's derivative by them (R, k, 3)


@dataclass(frozen=True)
class Rows:
    """The pairs that are nearer than some reach.

    Attributes:
        config: Configuration of each pair, shape (R,).
        gap: Distance between the surfaces, shape (R,), m.
        gradient: Derivative of the gap by that configuration's inputs, shape (R, n); no columns when not
            asked for.
    """

    config: Index
    gap: Array
    gradient: Array


@dataclass(frozen=True)
class Surroundings:
    """Tank, equipment, waste, mast and the arm itself.

    Attributes:
        chain: The arm.
        tank: The tank.
        payload_radius: Of the ball about the tool point, m.
        mast_radius: Of the pipe above the arm's base, m.
        sag: Displacements of the points of poses under load, from their nodes; absent for an arm that does not give.
    """

    chain: Chain
    tank: Tank
    payload_radius: float
    mast_radius: float
    sag: Callable[[Array], Array] | None = None

    @cached_property
    def profile(self) -> Profile:
        """Meridian of the tank."""
        return make_profile(self.tank.shell)

    @cached_property
    def obstacles(self) -> Obstacles:
        """Equipment and waste."""
        return obstacles(self.tank)

    @cached_property
    def capsules(self) -> Capsules:
        """The arm with its payload."""
        return make_capsules(self.chain, self.payload_radius)

    @cached_property
    def _mast(self) -> tuple[Array, Index]:
        """Axis of the mast, shape (2, 3), m, and the capsules that may meet it: not the first module's."""
        foot = self.chain.mount[:3, 3]
        head = np.array([foot[0], foot[1], max(self.profile.crown, foot[2])])
        return np.stack([foot, head]), np.flatnonzero(self.capsules.module >= 1)

    def points(self, q: Array) -> Array:
        """Nodes and then the tool point in frame G, shape (W, N + 1, 3), m; inputs of shape (W, n)."""
        nodes = self.chain.nodes(q)
        points = np.concatenate([nodes, self.chain.tool(q)[0][..., None, :]], axis=-2)
        return points if self.sag is None else points + self.sag(nodes)

    def rows(self, q: Array, reach: float, slopes: bool = True, payload: bool = True) -> Rows:
        """Pairs nearer than a reach.

        Args:
            q: Inputs, shape (W, n).
            reach: m.
            slopes: Whether the gradients are wanted.
            payload: Whether the payload's distance from what stands counts; from the arm it always does.

        Returns:
            One row for each pair, in a fixed order.
        """
        points = self.points(q)
        last = None if payload else -1
        every = np.arange(len(self.capsules.ends))[:last]
        parts = [self._shell(points[:, :last], reach), self._waste(points[:, :last], reach), self._own(points, reach)]
        for axis, radius in zip(self.obstacles.axes, self.obstacles.radii, strict=True):
            parts.append(self._cylinder(points, reach, axis, float(radius), every))
        axis, mine = self._mast
        parts.append(self._cylinder(points, reach, axis, self.mast_radius, mine[:last]))
        config = np.concatenate([part[0] for part in parts])
        gap = np.concatenate([part[1] for part in parts])
        if not slopes or not len(gap):
            return Rows(config, gap, np.zeros((len(gap), q.shape[1] if slopes else 0)))
        used = np.unique(config)
        J = self._slopes(q[used])
        at = np.searchsorted(used, config)
        lengths = np.cumsum([0, *(len(part[0]) for part in parts)])
        gradient = [
            np.einsum("rkx,rkxj->rj", part[3], J[at[low:high, None], part[2]])
            for part, low, high in zip(parts, lengths[:-1], lengths[1:], strict=True)
        ]
        return Rows(config, gap, np.concatenate(gradient))

    def _slopes(self, q: Array) -> Array:
        """Derivative of the points by the inputs, shape (W, N + 1, 3, n)."""
        tool = self.chain.jacobian(q)[..., None, :3, :]
        J = np.concatenate([self.chain.node_jacobian(q)[1], tool], axis=-3)
        return J if self.sag is None else J + self._sag_slopes(self.sag, q)

    def _sag_slopes(self, sag: Callable[[Array], Array], q: Array) -> Array:
        """By differences: a solver does not come to rest on slopes that leave the sag out."""
        near = q[:, None] + _STEP * np.eye(q.shape[1])
        change = sag(self.chain.nodes(near)) - sag(self.chain.nodes(q))[:, None]
        return np.moveaxis(change / _STEP, 1, -1)

    def _shell(self, points: Array, reach: float) -> _Part:
        """The tank is convex, so a capsule is nearest to it at an end; the mast flange does not move."""
        distance, inward = enclosure_distance(self.tank, self.profile, points[:, 3:])
        gap = distance - self.capsules.point_radii[3 : points.shape[1]]
        config, point = np.nonzero(gap < reach)
        return config, gap[config, point], point[:, None] + 3, inward[config, point][:, None, :]

    def _waste(self, points: Array, reach: float) -> _Part:
        gap = points[..., 2] - self.obstacles.waste_level - self.capsules.point_radii[: points.shape[1]]
        config, point = np.nonzero(gap < reach)
        up = np.broadcast_to([0.0, 0.0, 1.0], (len(point), 1, 3))
        return config, gap[config, point], point[:, None], up

    def _cylinder(self, points: Array, reach: float, axis: Array, radius: float, mine: Index) -> _Part:
        ends, radii = self.capsules.ends[mine], self.capsules.radii[mine]
        # a capsule that is farther from a vertical line through the axis than its own length cannot be near
        flat = np.hypot(points[..., 0] - axis[0, 0], points[..., 1] - axis[0, 1])[:, ends].min(axis=-1)
        config, near = np.nonzero(flat < self._longest + radii + radius + reach)
        a, b = points[config, ends[near, 0]], points[config, ends[near, 1]]
        distance, s, t = segment_distance(a, b, axis[0], axis[1])
        gap = distance - radii[near] - radius
        keep = gap < reach
        apart = a + s[:, None] * (b - a) - axis[0] - t[:, None] * (axis[1] - axis[0])
        unit = apart / np.maximum(distance, 1e-9)[:, None]
        slope = np.stack([(1 - s)[:, None] * unit, s[:, None] * unit], axis=1)
        return config[keep], gap[keep], ends[near[keep]], slope[keep]

    @cached_property
    def _longest(self) -> float:
        """Length of the longest member in any shape, m."""
        nodes = self.chain.nodes(self.chain.straight)
        ends = self.chain.truss.ends
        spans = np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=-1)
        return max(float(spans.max()), float(self.chain.stroke.max()))

    def _own(self, points: Array, reach: float) -> _Part:
        first, second, config = near_pairs(self.capsules, points, reach)
        ends = np.concatenate([self.capsules.ends[first], self.capsules.ends[second]], axis=1)
        corner = points[config[:, None], ends]
        distance, s, t = segment_distance(corner[:, 0], corner[:, 1], corner[:, 2], corner[:, 3])
        gap = distance - self.capsules.radii[first] - self.capsules.radii[second]
        keep = gap < reach
        weight = np.stack([1 - s, s, t - 1, -t], axis=1)
        unit = np.einsum("rk,rkx->rx", weight, corner) / np.maximum(distance, 1e-9)[:, None]
        slope = weight[..., None] * unit[:, None, :]
        return config[keep], gap[keep], ends[keep], slope[keep]

    def clearance(self, q: Array) -> tuple[Array, list[str]]:
        """Least clearance of every configuration, from everything and of the arm from itself.

        Args:
            q: Inputs, shape (W, n).

        Returns:
            Shape (W,), m, and what is that near in each.
        """
        capsules, points = self.capsules, self.points(q)
        members = len(self.chain.truss.members)
        found = arm_clearance(
            points[:, :-1],
            capsules.ends[:members],
            capsules.radii[:members],
            self.chain.manipulator.hub.radius,
            self.tank,
            self.profile,
            self.obstacles,
            (points[:, -1], self.payload_radius),
        )
        own, _ = self_clearance(points, capsules.ends, capsules.radii, capsules.module)
        axis, mine = self._mast
        a, b = points[:, capsules.ends[mine, 0]], points[:, capsules.ends[mine, 1]]
        mast = segment_distance(a, b, axis[0], axis[1])[0] - capsules.radii[mine] - self.mast_radius
        columns = np.concatenate(
            [found.distance, own[:, None], mast.min(axis=1, keepdims=True, initial=np.inf)], axis=1
        )
        names = (*found.places, "the arm itself", "mast")
        return columns.min(axis=1), [names[k] for k in columns.argmin(axis=1)]

    def least(self, q: Array) -> tuple[float, str]:
        """Least clearance of one configuration, m, and what is that near.

        Args:
            q: Inputs, shape (n,).

        Returns:
            Clearance and place.
        """
        distance, names = self.clearance(q[None])
        return float(distance[0]), names[0]
