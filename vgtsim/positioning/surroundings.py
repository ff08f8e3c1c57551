"""The distance of an arm from everything that it must keep clear of, with derivatives for a solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry import (
    MemberPairs,
    Obstacles,
    Profile,
    arm_clearance,
    enclosure_depth,
    enclosure_distance,
    make_profile,
    member_balls,
    near_members,
    nearest_pair,
    obstacles,
    pair_members,
    segment_distance,
)
from vgtsim.kinematics import Chain, State
from vgtsim.kinematics.inertia import member_radii

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_STEP = 1e-6  # of the differences of the sag, in units of the inputs
_TOUCHING = 1e-9  # m: below this distance two axes have no direction from one to the other
_APART = 3  # modules nearer than this along the arm cannot touch while their lengths are inside the strokes


@dataclass(frozen=True)
class NearPairs:
    """R pairs of bodies nearer than some reach: configurations and gaps, m, shape (R,), with gradients, shape (R, n).

    A gradient is by the inputs of the pair's configuration; it has no columns when it was not asked for.
    """

    config: Index
    gap: Array
    gradient: Array


@dataclass(frozen=True)
class _Gaps:
    """R pairs: configuration, gap, m, the k points of the arm on which it depends, and its slope, (R, k, 3)."""

    config: Index
    gap: Array
    points: Index
    slope: Array


@dataclass(frozen=True)
class _Pillars:
    """C upright cylinders, equipment and then the mast: axes, shape (C, 2, 3), m, and radii, shape (C,), m.

    `meets` tells which capsules may meet which cylinder, shape (C, M): the first module hangs from the mast.
    """

    axes: Array
    radii: Array
    meets: Mask


@dataclass(frozen=True)
class Surroundings:
    """Tank, equipment, waste, mast and the arm itself.

    Attributes:
        payload_radius: Of the ball about the tool point, m.
        mast_radius: Of the pipe above the arm's base, m.
        sag: From nodes, shape (..., N, 3), m, to displacements of nodes and tool point under load, shape (..., N + 1,
            3), m; absent for an arm that does not give.
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
    def unloaded(self) -> Surroundings:
        """The same for the shape that the arm has without load."""
        return self if self.sag is None else replace(self, sag=None)

    @cached_property
    def _pillars(self) -> _Pillars:
        foot = self.chain.mount[:3, 3]
        head = np.array([foot[0], foot[1], max(self.profile.crown, foot[2])])
        count = len(self.obstacles.radii)
        meets = np.ones((count + 1, len(self.capsules.ends)), bool)
        meets[-1] = self.capsules.module >= 1
        axes = np.concatenate([self.obstacles.axes, [[foot, head]]])
        return _Pillars(axes, np.append(self.obstacles.radii, self.mast_radius), meets)

    def points(self, q: Array) -> Array:
        """Nodes and then the tool point in frame G, shape (W, N + 1, 3), m; inputs of shape (W, n)."""
        nodes = self.chain.nodes(q)
        points = np.concatenate([nodes, self.chain.tool(q)[0][..., None, :]], axis=-2)
        return points if self.sag is None else points + self.sag(nodes)

    def _points(self, state: State) -> Array:
        points = np.concatenate([state.nodes, state.tool[0][:, None]], axis=1)
        return points if self.sag is None else points + self.sag(state.nodes)

    def rows(self, q: Array | State, reach: float, slopes: bool = True, payload: bool = True) -> NearPairs:
        """Pairs nearer than a reach, m, of inputs of shape (W, n) or of assembled kinematics, in a fixed order.

        `slopes` asks for gradients. `payload` tells whether the payload's distance from tank, equipment, waste and mast
        counts; its distance from the arm always does.
        """
        state = q if isinstance(q, State) else self.chain.state(q)
        points = self._points(state)
        fixed = points if payload else points[:, :-1]  # the tool point is the last one
        parts = [self._shell(fixed, reach), self._waste(fixed, reach), *self._members(points, reach, payload)]
        config = np.concatenate([part.config for part in parts])
        gap = np.concatenate([part.gap for part in parts])
        if not slopes or not len(gap):
            return NearPairs(config, gap, np.zeros((len(gap), state.q.shape[1] if slopes else 0)))
        J = np.concatenate([state.node_jacobian, state.tool_jacobian[:, None, :3]], axis=1)
        if self.sag is not None:  # only of configurations that are near something: sag costs a solve for each input
            used = np.unique(config)
            J[used] += self._sag_slopes(self.sag, state.q[used])
        found = (part for part in parts if len(part.config))
        gradient = [np.einsum("rkx,rkxj->rj", part.slope, J[part.config[:, None], part.points]) for part in found]
        return NearPairs(config, gap, np.concatenate(gradient))

    def _sag_slopes(self, sag: Callable[[Array], Array], q: Array) -> Array:
        """By differences: a solver does not come to rest on slopes that leave the sag out."""
        near = q[:, None] + _STEP * np.eye(q.shape[1])
        change = sag(self.chain.nodes(near)) - sag(self.chain.nodes(q))[:, None]
        return np.moveaxis(change / _STEP, 1, -1)

    def _shell(self, points: Array, reach: float) -> _Gaps:
        """The tank is convex, so a capsule is nearest to it at an end; the mast flange's 3 nodes do not move."""
        moving = points[:, 3:]
        gap = enclosure_depth(self.tank, self.profile, moving)[0] - self.capsules.point_radii[3 : points.shape[1]]
        config, point = np.nonzero(gap < reach)
        inward = np.zeros((0, 3))
        if len(config):  # of the few near points alone: the gradient is half of the work
            inward = enclosure_distance(self.tank, self.profile, moving[config, point])[1]
        return _Gaps(config, gap[config, point], point[:, None] + 3, inward[:, None, :])

    def _waste(self, points: Array, reach: float) -> _Gaps:
        gap = points[..., 2] - self.obstacles.waste_level - self.capsules.point_radii[: points.shape[1]]
        config, point = np.nonzero(gap < reach)
        up = np.broadcast_to([0.0, 0.0, 1.0], (len(point), 1, 3))
        return _Gaps(config, gap[config, point], point[:, None], up)

    def _members(self, points: Array, reach: float, payload: bool) -> tuple[_Gaps, _Gaps]:
        """Capsules near upright cylinders, and capsules near one another: all measured in one call."""
        capsules, pillars = self.capsules, self._pillars
        ends, radii = capsules.ends, capsules.radii
        balls = member_balls(ends, points)
        away = balls.middle[:, None, :, :2] - pillars.axes[:, 0, None, :2]
        room = balls.half[:, None] + (radii + pillars.radii[:, None] + reach)
        # a ball about a capsule that is beside the whole upright line is beside the cylinder
        near = (away[..., 0] ** 2 + away[..., 1] ** 2 < room**2) & pillars.meets
        config, pillar, capsule = np.nonzero(near if payload else near[..., :-1])  # the payload is the last capsule
        mine, (first, second) = near_members(capsules.far_pairs, points, balls, reach)
        split = len(config)
        whole, one = np.concatenate([config, mine]), np.concatenate([capsule, first])
        a0, a1 = balls.first[whole, one], balls.last[whole, one]
        b0 = np.concatenate([pillars.axes[pillar, 0], balls.first[mine, second]])
        b1 = np.concatenate([pillars.axes[pillar, 1], balls.last[mine, second]])
        distance, s, t = segment_distance(a0, a1, b0, b1)
        gap = distance - radii[one] - np.concatenate([pillars.radii[pillar], radii[second]])
        keep = np.flatnonzero(gap < reach)
        split = int(np.searchsorted(keep, split))
        apart = a0[keep] - b0[keep] + s[keep, None] * (a1 - a0)[keep] - t[keep, None] * (b1 - b0)[keep]
        unit = apart / np.maximum(distance[keep], _TOUCHING)[:, None]
        by_first = np.stack([1 - s[keep], s[keep]], axis=1)[..., None] * unit[:, None]
        by_second = np.stack([t[keep] - 1, -t[keep]], axis=1)[..., None] * unit[:, None]
        alone, own = keep[:split], keep[split:]
        both = np.concatenate([ends[one[own]], ends[second[own - len(config)]]], axis=1)
        slope = np.concatenate([by_first[split:], by_second[split:]], axis=1)
        standing = _Gaps(whole[alone], gap[alone], ends[one[alone]], by_first[:split])
        return standing, _Gaps(whole[own], gap[own], both, slope)

    def clearance(self, q: Array) -> tuple[Array, list[str]]:
        """Least clearance, shape (W,), m, of inputs of shape (W, n), and the names of the nearest bodies.

        It counts the distance from everything and of the arm from itself.
        """
        capsules, points = self.capsules, self.points(q)
        members = len(self.chain.truss.members)
        around = arm_clearance(
            points[:, :-1],
            capsules.ends[:members],
            capsules.radii[:members],
            self.chain.manipulator.hub.radius,
            self.tank,
            self.profile,
            self.obstacles,
            (points[:, -1], self.payload_radius),
        )
        own, _ = nearest_pair(capsules.judged_pairs, points)
        columns = np.concatenate([around.distance, own[:, None], self._from_mast(points)[:, None]], axis=1)
        names = (*around.places, "the arm itself", "mast")
        return columns.min(axis=1), [names[k] for k in columns.argmin(axis=1)]

    def _from_mast(self, points: Array) -> Array:
        """Least distance of all but the first module from the mast, shape (W,), m."""
        pillars, capsules = self._pillars, self.capsules
        mine = np.flatnonzero(pillars.meets[-1])
        a, b = points[:, capsules.ends[mine, 0]], points[:, capsules.ends[mine, 1]]
        distance = segment_distance(a, b, pillars.axes[-1, 0], pillars.axes[-1, 1])[0]
        return np.min(distance - capsules.radii[mine] - self.mast_radius, axis=1, initial=np.inf)

    def least(self, q: Array) -> tuple[float, str]:
        """Least clearance, m, of one configuration of shape (n,), and what is that near."""
        distance, names = self.clearance(q[None])
        return float(distance[0]), names[0]


@dataclass(frozen=True)
class Capsules:
    """Members, the edges of the tip plate and the payload as M capsules.

    Attributes:
        ends: Points of each, shape (M, 2): nodes by index, the tool point after the last node.
        radii: Shape (M,), m; a cylinder has the radius of its barrel over its whole length.
        module: Module of each, shape (M,).
        point_radii: Radius of a ball about each point that holds hub and capsule ends, shape (N + 1,), m.
    """

    ends: Index
    radii: Array
    module: Index
    point_radii: Array

    @cached_property
    def far_pairs(self) -> MemberPairs:
        """Pairs that a plan keeps apart."""
        return pair_members(self.ends, self.radii, self.module, _APART)

    @cached_property
    def judged_pairs(self) -> MemberPairs:
        """Pairs whose clearance is judged: all but those of neighbours, as the verification does."""
        return pair_members(self.ends, self.radii, self.module, 2)


def make_capsules(chain: Chain, payload_radius: float) -> Capsules:
    """Wrap an arm and the payload, a ball about the tool point."""
    manipulator, truss = chain.manipulator, chain.truss
    tool, last = len(truss.nodes), len(manipulator.modules) - 1
    plate = [(tool - 3, tool - 2), (tool - 2, tool - 1), (tool - 1, tool - 3)]
    ends = np.array([*(member.ends for member in truss.members), *plate, (tool, tool)])
    thickness = np.full(3, manipulator.tip_plate.thickness / 2)
    radii = np.concatenate([member_radii(manipulator, truss), thickness, [payload_radius]])
    module = np.array([*(member.module for member in truss.members), *[last] * 4])
    point_radii = np.full(tool + 1, manipulator.hub.radius)
    np.maximum.at(point_radii, ends.ravel(), np.repeat(radii, 2))
    return Capsules(ends, radii, module, point_radii)
