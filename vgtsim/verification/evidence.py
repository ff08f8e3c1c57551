"""What a run's log and its site say, worked out once for all checks: motion, forces, strength, tool, clearance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.geometry import RISER, Clearance, find_nearest
from vgtsim.kinematics import move_points
from vgtsim.log import LogStretch, Outline, RunLog, outline
from vgtsim.proximity import Proximity
from vgtsim.site import Site
from vgtsim.statics import (
    Envelope,
    MemberForces,
    NodeMotion,
    Ratings,
    Utilisation,
    find_envelope,
    motion_from_log,
    rate,
    solve_members,
    utilise,
)
from vgtsim.touches import Touches, find_touches

_BESIDE = 3  # records on either side of one that its acceleration is made of, see `motion_from_log`
_CASE_POSES = 1000  # recorded poses held against the load cases, evenly spread over the run


class PlannedLeader(Protocol):
    """The path that an arm follows on its way in or out: greatest planned deviation from it, m, and the least possible one, m."""

    @property
    def deviation(self) -> float:
        """Greatest planned distance of the arm's axis from the path, m."""
        ...

    @property
    def bound(self) -> float:
        """Least distance that any arm with these straight sections can keep, m."""
        ...

    def measure(self, points: Array) -> Array:
        """Distances of points of frame G, shape (..., 3), m, from the path, shape (...), m."""
        ...


class PlannedLeg(Protocol):
    """Lengths of the cylinders on the way to the goal of an index, at every step, shape (S, J), m.

    Where they change, the feed, m, the turn of the mast, rad, and the share of the tool's power stand beside them, shape (S,).
    The arm may follow a leader.
    """

    @property
    def goal(self) -> int:
        """Index of the goal that the leg leads to."""
        ...

    @property
    def lengths(self) -> Array:
        """Shape (S, J), m."""
        ...

    @property
    def feed(self) -> Array | None:
        """Height of the mast above its working depth, shape (S,), m; None where it stays."""
        ...

    @property
    def turn(self) -> Array | None:
        """Turn of the mast about its axis, shape (S,), rad; None where it stays."""
        ...

    @property
    def tool(self) -> Array | None:
        """Share of the tool's power, shape (S,); None where the tool is off."""
        ...

    @property
    def leader(self) -> PlannedLeader | None:
        """The path that the arm follows; None on the way to a goal."""
        ...


class PlannedTour(Protocol):
    """What the commands of a log are held against: legs in their order, with the time step, s."""

    @property
    def legs(self) -> Sequence[PlannedLeg]:
        """In their order."""
        ...

    @property
    def timestep(self) -> float:
        """Time between two rows of lengths, s."""
        ...

    @property
    def digest(self) -> str:
        """Of the whole programme."""
        ...


@dataclass(frozen=True, eq=False)
class Evidence:
    """A run and everything that several checks read out of it; T records, M members. Vectors are in frame G.

    The tour is the planned one, where it is known. Of a long run the log is that of a stretch, which is given, as is the
    outline of the whole run.
    """

    site: Site
    log: RunLog
    tour: PlannedTour | None = None
    stretch: LogStretch | None = None
    whole: Outline | None = None

    @cached_property
    def outline(self) -> Outline:
        """The little that is known of the whole run."""
        return self.whole or outline(self.log)

    @property
    def wide(self) -> RunLog:
        """The log with records on either side, for differences of records."""
        return self.stretch.wide if self.stretch else self.log

    @property
    def first(self) -> int:
        """Number in the run of the log's first record."""
        return self.stretch.first if self.stretch else 0

    @property
    def step(self) -> float:
        """Step of the plant, s."""
        return self.log.performance.get("timestep_s", self.site.timestep)

    def _differentiate(self, values: Array) -> NodeMotion:
        """Velocities and accelerations of points in wide records, shape (T', P, 3), m, at the log's: of the plant's steps."""
        found = motion_from_log(self.wide.time, values, self.step)
        inner = self.stretch.inner if self.stretch else slice(None)
        return NodeMotion(found.velocity[inner], found.acceleration[inner])

    def within(self, records: Index) -> Index:
        """Those of some records of the run that are in the log, counted from its first, shape (S,)."""
        inside = records - self.first
        return inside[(inside >= 0) & (inside < len(self.log.time))]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the members."""
        return self.site.truss.member_names

    @property
    def actuator_names(self) -> list[str]:
        """Names of the actuators, shape (J,)."""
        return [self.site.truss.members[i].name for i in self.site.truss.actuated]

    @cached_property
    def motion(self) -> NodeMotion:
        """Velocities and accelerations of the nodes; NaN where they are unknown."""
        found = self._differentiate(self.wide.nodes)
        return NodeMotion(found.velocity, self.log.acceleration) if self.log.acceleration.size else found

    def carry(self, nodes: Array, rows: slice | Index = slice(None)) -> Array:
        """Nodes under a mast that is not moved, shape (S, N, 3), m, where the mast of some records carries them."""
        return move_points(self.site.chain, nodes, self.log.height[rows], self.log.turned[rows])

    @cached_property
    def feed_acceleration(self) -> Array:
        """Of the mast, upward, from that of the hubs at its flange, shape (T,), m/s²."""
        return self.motion.acceleration[:, self.site.truss.base, 2].mean(axis=1)

    @cached_property
    def turn_acceleration(self) -> Array:
        """Of the mast about its axis, likewise, shape (T,), rad/s²."""
        base = self.site.truss.base
        arm = self.log.nodes[:, base, :2] - self.site.chain.mount[:2, 3]
        pull = self.motion.acceleration[:, base, :2]
        across = arm[..., 0] * pull[..., 1] - arm[..., 1] * pull[..., 0]
        return (across / np.sum(arm**2, axis=-1)).mean(axis=1)

    @cached_property
    def riser_reaction(self) -> Array:
        """Force and moment of arm and mast on the riser, which the dome must not carry, shape (T, 6), N and N·m.

        About the tank's axis at the crown, in frame G.
        """
        force, moment = -self.log.mast_reaction[:, :3], -self.log.mast_reaction[:, 3:]
        lever = np.zeros((self.log.count, 3))
        lever[:, 2] = self.log.height - self.site.task.mast.pivot_depth
        weight = np.array([0.0, 0.0, -self.site.mast.mass * self.site.gravity])
        return np.concatenate([force + weight, moment + np.cross(lever, force)], axis=1)

    @cached_property
    def speeds(self) -> Array:
        """Speeds of the cylinders in the step that led to each record, from differenced lengths, shape (T, J), m/s.

        MuJoCo's speeds, which the log has, are those.
        """
        return self._differentiate(self.wide.actual[..., None]).velocity[..., 0]

    def find_pull(self, pull: Array) -> Array:
        """Pull of cylinders by the oil's in wide records, shape (T', J), N, and the damper beside the oil, at the log's.

        The damper resists stretching as the members' do, over which the oil's pull changes: the two are in one place.
        """
        # the least that is stable
        damper = self.site.damper if self.site.task.simulation.damping_ratio else self.step / 2
        inner = self.stretch.inner if self.stretch else slice(None)
        return pull[inner] + damper * self._differentiate(pull[..., None]).velocity[..., 0]

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the members from hub to hub, shape (T, M), m."""
        return self.site.truss.lengths(self.log.nodes)

    @cached_property
    def gaps(self) -> Array:
        """Distance of each member's ends from its hubs, the greater of the two, shape (T, M), m."""
        return np.linalg.norm(self.log.ends - self.log.nodes[:, self.site.truss.ends], axis=-1).max(axis=-1)

    @cached_property
    def axial(self) -> Array:
        """Measured axial forces at the near ends, tension positive, shape (T, M), N."""
        return self.log.axial(self.site.truss.ends)

    @cached_property
    def shear(self) -> Array:
        """Measured forces across the members at the near ends, shape (T, M, 3), N."""
        return self.log.shear()

    @cached_property
    def moving(self) -> MemberForces:
        """Expected forces with inertia, from the method of joints; NaN where the motion is unknown."""
        return self._solve(slice(None), self.motion)

    def _solve(self, rows: slice | Index, motion: NodeMotion | None) -> MemberForces:
        """Forces in some records from weight, motion and contact; at rest without a motion."""
        model, nodes, touches = self.site.load_model, self.log.nodes[rows], self.touches
        if touches is None:
            return solve_members(model, nodes, motion)
        return solve_members(model, nodes, motion, touches.forces[rows], touches.shares[:, rows])

    @cached_property
    def touches(self) -> Touches | None:
        """Contact forces on nodes, members and mast; None where nothing touched."""
        return find_touches(self.site, self.site.load_model, self.log)

    @cached_property
    def settled(self) -> Index:
        """Records at rest, shape (S,)."""
        settled = np.flatnonzero(self.outline.settled)
        if self.rings:  # accelerations beside a record that is not settled are partly those of the motion to or from it
            settled = settled[np.isin(settled - _BESIDE, settled) & np.isin(settled + _BESIDE, settled)]
        return self.within(settled)

    @cached_property
    def resting(self) -> MemberForces:
        """Expected forces of the settled records alone: at rest, or with the inertia of an elastic arm's ringing."""
        return self.moving.at(self.settled) if self.rings else self._solve(self.settled, None)

    def expect(self, *, settled: bool) -> tuple[Index, MemberForces]:
        """Settled or all records, and the forces expected in them."""
        return (self.settled, self.resting) if settled else (np.arange(len(self.log.time)), self.moving)

    @property
    def rings(self) -> bool:
        """Whether the arm still rings a little when it counts as settled: an elastic one does, and one on servos."""
        simulation = self.site.task.simulation
        return simulation.members == "elastic" or simulation.drive == "servo"

    @cached_property
    def ratings(self) -> Ratings:
        """Allowable forces, shapes (T, M)."""
        return rate(self.site.sections, self.lengths, self.site.task.limits.safety_factor)

    @cached_property
    def use(self) -> Utilisation:
        """Demand over strength under the measured forces, shapes (T, M).

        The force varies along a member by its own weight and inertia, which the expected forces give.
        """
        expected, pinned = self.moving, self.site.truss.ring_actuators.ravel()
        off, moment = self.axial - expected.near_axial, expected.near_moment.copy()
        moment[:, pinned] = self.log.member_moment[:, pinned]
        changed = {"bar": expected.bar + off, "near_axial": self.axial, "far_axial": expected.far_axial + off}
        return utilise(self.ratings, replace(expected, **changed, near_moment=moment))

    @cached_property
    def case_records(self) -> Index:
        """Records whose poses are held against the load cases."""
        count = len(self.outline.time)
        return self.within(np.unique(np.linspace(0, count - 1, min(count, _CASE_POSES)).astype(int)))

    @cached_property
    def envelope(self) -> Envelope:
        """Worst of the load cases in every recorded pose."""
        task, nodes = self.site.task, self.log.nodes[self.case_records]
        return find_envelope(self.site.case_model, self.site.sections, nodes, task.loads, task.limits.safety_factor)

    @cached_property
    def tool(self) -> tuple[Array, Array]:
        """Tool point, m, and outward unit normal of the plane through the tip nodes, shapes (T, 3)."""
        corner = self.log.nodes[:, self.site.truss.tip]
        normal = np.cross(corner[:, 0] - corner[:, 2], corner[:, 1] - corner[:, 2])
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        return corner.mean(axis=1) + self.site.arm.tip_plate.tool_offset * normal, normal

    @cached_property
    def proximity(self) -> Proximity:
        """Measures the arm's distances."""
        return Proximity(self.site)

    @cached_property
    def around(self) -> Clearance:
        """Distances of the arm from tank, riser, equipment and waste at every record; what may touch is left out.

        So is what has not appeared yet, and the riser of an arm that is fed through it, whose distance is `bore`.
        """
        found = self.proximity.leave_out(self._apart(), self.log.time)
        if self.site.task.mast.feed is None:
            return found
        return replace(found, distance=np.where(np.array(found.places) == RISER, np.inf, found.distance))

    def _apart(self) -> Clearance:
        """Distances from everything that may not be touched; stretch by stretch in which the waste is not cut."""
        measure, nodes, tool, bed = self.proximity.apart, self.log.nodes, self.tool[0], self.log.bed
        if not bed.size or self.site.diggings is None:
            return measure(nodes, tool)
        edges = [0, *(np.flatnonzero((np.diff(bed, axis=0) != 0).any(axis=1)) + 1).tolist(), len(bed)]
        parts = [measure(nodes[a:b], tool[a:b], bed[a]) for a, b in pairwise(edges) if a < b]
        distance, body = (np.concatenate([getattr(part, name) for part in parts]) for name in ("distance", "body"))
        return replace(parts[0], distance=distance, body=body)

    @cached_property
    def bore(self) -> Array:
        """Distance of each module from the riser, shape (T, K), m; no more than the tank is high."""
        # the waste does not count
        distance, places = self.proximity.by_module(self.log.nodes, self.tool[0], together=True)
        return np.minimum(distance[..., places.index(RISER)], self.site.tank.shell.crown)

    @cached_property
    def among(self) -> tuple[Array, Index]:
        """Least distance of the arm from itself and the mast, shape (T,), m, and the pair of parts, shape (T, 2)."""
        return self.proximity.among(self.log.nodes, self.tool[0])

    @cached_property
    def clearance(self) -> Array:
        """Least distance of the arm from anything, shape (T,), m."""
        return np.minimum(self.around.least, self.among[0])

    @cached_property
    def tool_errors(self) -> tuple[Array, Array]:
        """Distance, m, and angle, rad, of the tool from the goal approached or held, shapes (T,); NaN without a goal."""
        log = self.log
        if not self.site.stages:
            return np.full(len(log.time), np.nan), np.full(len(log.time), np.nan)
        wanted = self.site.stage_poses[log.goal]
        distance, angle = self._compare_tool(wanted[:, :3], wanted[:, 3:])
        distance[log.goal < 0] = angle[log.goal < 0] = np.nan
        return distance, angle

    @cached_property
    def path_errors(self) -> tuple[Array, Array]:
        """Distance, m, and angle, rad, of the tool from the nearest points of its path, shapes (T,); NaN without a path."""
        wanted = np.full((self.log.count, 6), np.nan)
        for goal, stretches in enumerate(self.site.stretches):
            rows = np.flatnonzero(self.log.goal == goal)
            if stretches and len(rows):
                wanted[rows] = find_nearest(stretches, self.tool[0][rows])
        return self._compare_tool(wanted[:, :3], wanted[:, 3:])

    @cached_property
    def target_errors(self) -> tuple[Array, Array]:
        """Distance, m, and angle, rad, of the tool from an operator's target, shapes (T,)."""
        return self._compare_tool(self.log.target[:, :3], self.log.target[:, 3:])

    def _compare_tool(self, wanted: Array, aimed: Array) -> tuple[Array, Array]:
        """Distance, m, and angle, rad, of the tool from positions and directions, shape (T, 3)."""
        position, direction = self.tool
        distance = np.linalg.norm(position - wanted, axis=-1)
        angle = np.arctan2(np.linalg.norm(np.cross(direction, aimed), axis=-1), np.sum(direction * aimed, axis=-1))
        return distance, angle
