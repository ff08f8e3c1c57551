"""A mission planned: its steps as legs of one tour, from above the riser and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import RasterPiece, ToolPath
from vgtsim.description.mission import HoldStep, InsertStep, MissionStep, MoveStep, RasterStep
from vgtsim.errors import PathError
from vgtsim.planning.carousel import Carousel
from vgtsim.planning.checks import check_site
from vgtsim.planning.entry_checks import check_entry
from vgtsim.planning.following import follow
from vgtsim.planning.insertion import Insertion, plan_insertion, time_way
from vgtsim.planning.pace import choose_step, find_bounds
from vgtsim.planning.passage import check_passage
from vgtsim.planning.path import plan_path
from vgtsim.planning.resolution import goal_keep, make_objective
from vgtsim.planning.sampling import Ground
from vgtsim.planning.timing import TimedPath, make_limits, time_path
from vgtsim.planning.tour import Leg, Tour, plan_tour, pose_at
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import Problem, tool_goal
from vgtsim.site import Site

Array = NDArray[np.float64]

_LOOKED = 0.25  # s between postures whose passage is looked at: a module bends by less than 2 degrees in it
_JUDGED = 1000  # instants of a raster at which clearance is measured
_SMOOTH = ("mid_stroke",)  # objective of postures along rows: hinges would let them jump


Rows = Callable[[float], tuple[Array, Array | None]]


@dataclass(frozen=True)
class _Piece:
    """A part of a leg, run from rest to rest, with its least clearance, m, from a place.

    `rows` gives, for a time step, s, actuator lengths, shape (T, J), m, and feed, shape (T,), m, if the mast moves. A way that
    bears on the step is `timed`.
    """

    clearance: float
    place: str
    rows: Rows
    timed: TimedPath | None = None


@dataclass
class _Plan:
    """What is planned so far: where the arm is, inside or above the riser, and the pieces of each leg."""

    site: Site
    here: Array
    way: Insertion | None = None
    pieces: list[list[_Piece]] = field(default_factory=list)
    ends: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        site, motion = self.site, self.site.task.motion
        self.keep = goal_keep(site)
        self.corridor = Corridor(site.box, site.surroundings, site.clearance, subspace=site.subspace)
        self.carousel = Carousel(Ground(self.corridor))
        self.limits = make_limits(site.chain, motion.rate_fraction, motion.acceleration)

    def add(self, step: MissionStep) -> None:
        """Plan one step."""
        self.pieces.append(list(self._take(step)))
        self.ends.append(self.here)

    def _take(self, step: MissionStep) -> list[_Piece]:
        goals = {goal.name: goal for goal in self.site.task.motion.goals}
        if isinstance(step, InsertStep):
            self.way = self.way or plan_insertion(self.site)
            self.here = self.way.ends[1]
            return [self._feed(self.way)]
        if isinstance(step, MoveStep):
            return self._go(pose_at(self.site, goals[step.goal], self.here, self.keep), step.goal)
        if isinstance(step, RasterStep):
            return self._raster(step)
        if isinstance(step, HoldStep):
            gap, place = self.site.surroundings.least(self.here)
            length = self.site.chain.lengths(self.here)
            return [_Piece(gap, place, lambda dt: (np.tile(length, (max(2, round(step.time / dt) + 1), 1)), None))]
        assert self.way is not None  # the order of the steps is that of the description
        pieces = self._go(self.way.ends[1], "the way out")
        self.here = self.way.ends[0]
        return [*pieces, self._feed(self.way.reverse())]

    def _feed(self, way: Insertion) -> _Piece:
        place = min(way.gaps, key=lambda name: way.gaps[name])
        return self._run(way.gaps[place], place, time_way(self.site, way))

    def _run(self, clearance: float, place: str, timed: TimedPath) -> _Piece:
        chain = self.site.chain
        return _Piece(clearance, place, lambda dt: (chain.lengths(timed.inputs(dt)), timed.feeds(dt)), timed)

    def _go(self, there: Array, name: str) -> list[_Piece]:
        path = plan_path(self.corridor, self.here, there, name, self.carousel)
        self.here = there
        return [self._run(path.clearance, path.place, time_path(self.site.chain, path.curve, self.limits))]

    def _raster(self, step: RasterStep) -> list[_Piece]:
        """Rows from where the tool is; the arm first takes the posture in which it can follow them."""
        site, motion = self.site, self.site.task.motion
        position, direction = site.chain.tool(self.here)
        path = ToolPath(
            name="raster",
            start=tuple(position.tolist()),
            direction=tuple(direction.tolist()),
            tolerance=step.tolerance,
            rate_fraction=motion.rate_fraction,
            acceleration=motion.acceleration,
            pieces=(RasterPiece(shape="raster", width=step.width, depth=step.depth, rows=step.rows),),
        )
        goal = tool_goal(path.start, path.direction)
        problem = Problem(site.box, goal, make_objective(site, goal, _SMOOTH))
        run = follow(problem, path, self.here, site.timestep, site.subspace)
        start, pieces = run.q[0], self._go(run.q[0], "the first row of the raster")
        gaps, places = site.surroundings.clearance(run.q[:: max(1, len(run.q) // _JUDGED)])
        worst = int(np.argmin(gaps))
        if gaps[worst] < site.clearance:
            raise PathError("the raster", float(gaps[worst]), places[worst])
        self.here = run.q[-1]

        def rows(timestep: float) -> tuple[Array, None]:
            return (
                run if timestep == site.timestep else follow(problem, path, start, timestep, site.subspace)
            ).lengths, None

        return [*pieces, _Piece(float(gaps[worst]), places[worst], rows)]


def plan_mission(site: Site) -> Tour:
    """Plan the mission of a scene, a leg for each step; the same scene gives the same legs, bit for bit.

    Raises:
        DescriptionError: The scene cannot work, see `check_site`, or the arm cannot come through the riser, see `check_entry`.
        PathError: There is no way in, or no clear path between two steps.
        ReachError: A goal cannot be met.
        FollowError: The posture would jump on a raster.
    """
    check_site(site)
    check_entry(site)
    plan = _Plan(site, site.chain.stowed)
    for step in site.task.mission:
        plan.add(step)
    timed = [(piece.timed, piece.clearance) for leg in plan.pieces for piece in leg if piece.timed is not None]
    for way, _ in timed:
        check_passage(site, way.inputs(_LOOKED))
    bounds = find_bounds(site, timed)
    timestep = choose_step(site, bounds)
    legs = []
    for index, (stage, pieces, end) in enumerate(zip(site.task.stages, plan.pieces, plan.ends, strict=True)):
        nearest = min(pieces, key=lambda piece: piece.clearance)
        lengths, feed = _join([piece.rows(timestep) for piece in pieces])
        leg = Leg(
            name=stage.name,
            goal=index,
            lengths=lengths,
            q=end,
            clearance=nearest.clearance,
            place=nearest.place,
            feed=feed,
        )
        legs.append(leg)
    return Tour(np.array(site.chain.stowed), tuple(legs), timestep, bounds)


def _join(parts: list[tuple[Array, Array | None]]) -> tuple[Array, Array | None]:
    """Lengths and feeds of the parts of a leg one after the other; the mast stands at its working depth in a part without."""
    lengths = [rows if i == 0 else rows[1:] for i, (rows, _) in enumerate(parts)]
    feeds = [np.zeros(len(rows)) if feed is None else feed for rows, feed in parts]
    moved = any(feed is not None for _, feed in parts)
    return np.concatenate(lengths), np.concatenate([feeds[0], *(feed[1:] for feed in feeds[1:])]) if moved else None


def plan_site(site: Site) -> Tour:
    """Plan what a scene asks for: its mission, or the tour of its goals; see `plan_mission` and `plan_tour`."""
    return plan_mission(site) if site.task.mission else plan_tour(site)
