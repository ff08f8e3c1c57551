"""The distance of an arm from everything that it must keep clear of, with derivatives for a solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.description import Tank
from vgtsim.geometry import (
    ArmInTank,
    Bed,
    MemberPairs,
    NearRows,
    Obstacles,
    Profile,
    arm_clearance,
    carry,
    find_near,
    flag_clear,
    make_profile,
    make_walls,
    nearest_pair,
    obstacles,
    pair_members,
    segment_distance,
)
from vgtsim.geometry.gaps import BED, PILLAR, SOLID, TANK, WASTE
from vgtsim.kinematics import Chain, State, member_radii

_STEP = 1e-6  # of the differences of the sag, in units of the inputs
_ROOM = 16  # near pairs of a configuration that room is made for at first
_APART = 3  # modules nearer than this along the arm cannot touch while their lengths are inside the strokes


@dataclass(frozen=True)
class NearPairs:
    """R pairs of bodies nearer than some reach: configurations and gaps, m, shape (R,), with gradients, shape (R, n).

    A gradient is by the inputs of the pair's configuration; it has no columns when it was not asked for. `bodies`, shape
    (R, 3), are for `Surroundings.name_pair`.
    """

    config: Index
    gap: Array
    gradient: Array
    bodies: Index


@dataclass(frozen=True)
class LeastGap:
    """The least gap of an arm: its size, m, its two bodies, and points between which it is, on the arm first, shape (2, 3), m."""

    gap: float
    bodies: str
    ends: Array


@dataclass(frozen=True)
class _Pillars:
    """C cylinders, equipment and then the mast: axes, shape (C, 2, 3), m, and radii, shape (C,), m.

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
        bed: Surface of the waste, where it is not that of the tank's description.
    """

    chain: Chain
    tank: Tank
    payload_radius: float
    mast_radius: float
    sag: Callable[[Array], Array] | None = None
    bed: Bed | None = None

    @cached_property
    def profile(self) -> Profile:
        """Meridian of the tank."""
        return make_profile(self.tank.shell)

    @cached_property
    def obstacles(self) -> Obstacles:
        """Equipment and waste."""
        around = obstacles(self.tank)
        return around if self.bed is None else replace(around, bed=self.bed)

    @cached_property
    def _bodies(self) -> ArmInTank:
        """The arm and the tank, with the mast as one more obstacle."""
        pillars, capsules = self._pillars, self.capsules
        around = replace(self.obstacles, axes=pillars.axes, radii=pillars.radii)
        walls = make_walls(self.tank, self.profile, around)
        return ArmInTank(walls, capsules.far_pairs, pillars.meets, capsules.point_radii)

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

    @property
    def mast_axis(self) -> Array:
        """Foot and head of the mast's axis in frame G, shape (2, 3), m."""
        return self._pillars.axes[-1]

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
        config, gap, bodies, held, slope = self._near(points, reach, payload)
        gradient = np.empty((len(gap), state.q.shape[1] if slopes else 0))
        if slopes and len(gap):
            J = np.concatenate([state.node_jacobian, state.tool_jacobian[:, None, :3]], axis=1)
            if self.sag is not None:  # only of configurations that are near something: sag costs a solve for each input
                used = np.unique(config)
                J[used] += self._sag_slopes(self.sag, state.q[used])
            carry(config, held, slope, J, gradient)
        return NearPairs(config, gap, gradient, bodies)

    def clear(self, state: State, reach: float, all_of_them: bool = False) -> Mask:
        """Which assembled configurations keep a distance, m, from everything, shape (W,).

        If all of them must, none is looked at after the first that does not.
        """
        points, clear = self._points(state), np.empty(len(state.q), bool)
        flag_clear(self._bodies, points, reach, all_of_them, clear)
        return clear

    def _near(self, points: Array, reach: float, payload: bool) -> NearRows:
        room = _ROOM * len(points)
        while True:
            rows = NearRows.make(room)
            count = find_near(self._bodies, points, reach, payload, rows)
            if count <= room:
                return rows.first(count)
            room = count

    def find_nearest(self, points: Array, reach: float) -> LeastGap | None:
        """The least gap at points, nodes and then the tool point, shape (N + 1, 3), m, without sag; none beyond a reach, m."""
        _, gap, bodies, held, slope = self._near(points[None], reach, payload=True)
        if not len(gap):
            return None
        k, capsules = int(np.argmin(gap)), self.capsules
        body = bodies[k, 1]
        radius = (capsules.point_radii if bodies[k, 0] in (TANK, WASTE) else capsules.radii)[body]
        mine = held[k, :2][held[k, :2] >= 0]  # of two parts of the arm the others are those of the second one
        lead = slope[k, : len(mine)]
        part = np.linalg.norm(lead, axis=1)
        axis, away = part @ points[mine] / part.sum(), lead.sum(axis=0) / part.sum()
        ends = axis - np.array([[radius], [radius + gap[k]]]) * away
        return LeastGap(float(gap[k]), self.name_pair(bodies[k]), ends)

    def name_pair(self, bodies: Index) -> str:
        """Names of two near bodies, shape (3,), see `NearPairs.bodies`."""
        kind, first, second = bodies.tolist()
        if kind in (TANK, WASTE):
            return f"{[*self.chain.truss.nodes, 'payload'][first]} to {'tank' if kind == TANK else 'waste'}"
        parts = [*self.chain.truss.member_names, *["tip plate"] * 3, "payload"]
        if kind == BED:
            return f"{parts[first]} to waste"
        count = len(self.obstacles.radii)
        if kind == SOLID:
            return f"{parts[first]} to {self.obstacles.names[count + second]}"
        other = [*self.obstacles.names[:count], "mast"][second] if kind == PILLAR else parts[second]
        return f"{parts[first]} to {other}"

    def _sag_slopes(self, sag: Callable[[Array], Array], q: Array) -> Array:
        """By differences: a solver does not come to rest on slopes that leave the sag out."""
        near = q[:, None] + _STEP * np.eye(q.shape[1])
        change = sag(self.chain.nodes(near)) - sag(self.chain.nodes(q))[:, None]
        return np.moveaxis(change / _STEP, 1, -1)

    def clearance(self, q: Array, together: bool = False) -> tuple[Array, list[str]]:
        """Least clearance, shape (W,), m, of inputs of shape (W, n), and the names of the nearest bodies.

        It counts the distance from everything and of the arm from itself. If only the least of all counts, `together`, others
        may be given too great.
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
            together,
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
        """Least clearance, m, of a configuration, shape (n,), or of several, (W, n), and what is that near."""
        distance, names = self.clearance(np.atleast_2d(q), together=True)
        worst = int(np.argmin(distance))
        return float(distance[worst]), names[worst]


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
    radii = np.concatenate([member_radii(chain), thickness, [payload_radius]])
    module = np.array([*(member.module for member in truss.members), *[last] * 4])
    point_radii = np.full(tool + 1, manipulator.hub.radius)
    np.maximum.at(point_radii, ends.ravel(), np.repeat(radii, 2))
    return Capsules(ends, radii, module, point_radii)
