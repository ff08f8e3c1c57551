"""A mission planned: its steps as legs of one tour, from above the riser and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import (
    AddStep,
    CutStep,
    FollowStep,
    Goal,
    HoldStep,
    InsertStep,
    MissionStep,
    MoveStep,
    RasterPiece,
    RasterStep,
    ToolPath,
    begins_inside,
)
from vgtsim.errors import PathError
from vgtsim.planning.carousel import Carousel
from vgtsim.planning.checks import check_passage, check_site
from vgtsim.planning.curve import reverse_curve
from vgtsim.planning.cutting import check_cuts, foresee_cut, plan_cut
from vgtsim.planning.directrix import Leader
from vgtsim.planning.entry import Entry, check_entry
from vgtsim.planning.following import Followed, follow_path
from vgtsim.planning.insertion import Insertion, make_leader, plan_insertion, time_way
from vgtsim.planning.pace import choose_step, find_bounds
from vgtsim.planning.path import Path, plan_path
from vgtsim.planning.programme import ProgrammeRows, join_rows, read_height
from vgtsim.planning.resolution import aim_tool, make_objective, make_problem, usual_way
from vgtsim.planning.sampling import Ground
from vgtsim.planning.timing import TimedPath, make_limits, time_path, time_turn
from vgtsim.planning.tour import Leg, Tour, pose_at
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import Nearness, Problem, solve_by_method
from vgtsim.site import Site

_LOOKED = 0.25  # s between postures whose passage is looked at: a module bends by less than 2 degrees in it
_JUDGED = 1000  # instants of a raster at which clearance is measured
_AGAIN = 241  # postures of a way at which it is measured anew, as many as of one that is planned
_SMOOTH = ("mid_stroke",)  # objective of postures along a path: hinges would let them jump
_SWEPT = 0.1  # m that the farthest point of an arm goes between two turns of the mast at which clearance is measured


@dataclass(frozen=True)
class LegPart:
    """A part of a leg, run from rest to rest, with its least clearance, m, from a place.

    `rows` gives it for a time step, s; the mast is turned by an angle, rad, if that does not change. A way that
    bears on the step is `timed`. On the way in or out the arm follows a `leader`. What is `bound` the task asks for as it is.
    """

    clearance: float
    place: str
    rows: Callable[[float], ProgrammeRows]
    turn: float
    timed: TimedPath | None = None
    leader: Leader | None = None
    bound: bool = False


@dataclass
class MissionPlan:
    """What is planned so far: where the arm is, with the mast at a feed, m, and the pieces of each leg.

    `trail` are the ways that the arm went with its mast as it is turned.
    """

    site: Site
    here: Array
    height: float = 0.0
    way: Insertion | None = None
    pieces: list[list[LegPart]] = field(default_factory=list)
    ends: list[Array] = field(default_factory=list)
    trails: list[tuple[Path, ...]] = field(default_factory=list)
    trail: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.heights = self.site.begun
        self._enter(self.site)

    def _enter(self, site: Site) -> None:
        """Go on at a site, whose waste may be lower than before."""
        motion = site.task.motion
        self.site = site
        self.corridor = Corridor(site.box, site.surroundings, site.clearance, subspace=site.subspace)
        self.carousel = Carousel(Ground(self.corridor))
        self.limits = make_limits(site.chain, motion.rate_fraction, motion.acceleration)

    def lower(self, heights: Array) -> None:
        """Go on over waste of some heights in the site's diggings, shape (P,), m."""
        self.heights = heights
        self._enter(self.site.lower_waste(heights))

    def add(self, step: MissionStep) -> None:
        """Plan one step."""
        if isinstance(step, FollowStep):
            self.lay(self.approach(step))
            self.add_path()
        else:
            self.lay(self.take(step))

    def lay(self, leg: list[LegPart]) -> None:
        """Add a leg, which ends where the arm is now."""
        self.pieces.append(leg)
        self.ends.append(self.here)
        self.trails.append(tuple(self.trail))

    def approach(self, step: FollowStep) -> list[LegPart]:
        """The way to the begin of a path."""
        self.run = self._follow(step.path)
        return self._go(self.run[0].q[0], f"the beginning of {step.path.name}")

    def add_path(self) -> None:
        """Add the leg along a path whose begin was come to."""
        run, piece = self.run
        self.here = run.q[-1]
        self.lay([piece])

    def check_lines(self) -> list[tuple[TimedPath, float]]:
        """Ways that bear on the time step, with their clearances, m; through all of them the line passes, see `check_passage`."""
        timed = [(piece.timed, piece.clearance) for leg in self.pieces for piece in leg if piece.timed is not None]
        for path, _ in timed:
            check_passage(self.site, path.inputs(_LOOKED))
        return timed

    def take(self, step: MissionStep) -> list[LegPart]:
        """Pieces of one step, from where the arm is; afterwards it is at their end."""
        goals = {goal.name: goal for goal in self.site.task.motion.goals}
        if isinstance(step, InsertStep | AddStep):
            self.way = self.way or plan_insertion(self.site)
            self.trail.clear()
            return [self._feed(self.way)]
        if isinstance(step, MoveStep):
            turned = self.site.turn_mast(self.site.turn if step.turn is None else step.turn)
            there = pose_at(turned, goals[step.goal], self.here)
            return self._come(there, step.goal, turned)
        if isinstance(step, RasterStep):
            return self.raster(step, self.site.chain.tool(self.here))
        if isinstance(step, CutStep):
            return self._cut(step)
        if isinstance(step, HoldStep):
            return [self._stand(step.time)]
        straight = self.site.turn_mast(0.0)
        self.way = self.way or plan_insertion(straight)
        there = self.height or np.array_equal(self.here, self.way.ends[1])
        pieces = [] if there and not self.site.turn else self._return(self.way.ends[1], straight)
        return [*pieces, self._feed(self.way.reverse())]

    def _return(self, there: Array, straight: Site) -> list[LegPart]:
        """Go to the end of the way in, inputs of shape (n,), with the mast straight; where no way is found, as the arm came."""
        try:
            return self._come(there, "the way out", straight)
        except PathError:
            if self.site.turn or not self.trail or not np.allclose(self.trail[0].curve(0.0), there):
                raise
        pieces = []
        for path in reversed(self.trail.copy()):
            end = path.curve(1.0)
            if self.site.until:  # something has appeared since
                path = self._look_again(path)
            if not np.allclose(self.here, end):  # rows of the tool lie between
                pieces += self._go(end, "the way out")
            back = time_path(self.site.chain, reverse_curve(path.curve), self.limits)
            pieces.append(self._run(path.clearance, path.place, back))
            self.here = path.curve(0.0)
        return pieces

    def _look_again(self, path: Path) -> Path:
        """A way that the arm came, measured anew."""
        gap, place = self.site.surroundings.least(path.curve(np.linspace(0.0, 1.0, _AGAIN)))
        if gap < self.site.clearance:
            raise PathError("the way out", gap, place)
        return replace(path, clearance=gap, place=place)

    def _come(self, there: Array, name: str, site: Site) -> list[LegPart]:
        """Go to inputs, shape (n,), with the mast turned as it is at a site; it turns before the way or after it."""
        if site.turn == self.site.turn:
            return self._go(there, name)
        before, here = self.site, self.here
        try:
            swung = self._swing(site, name)
            return [swung, *self._go(there, name)]
        except PathError as error:
            self.here = here
            self._enter(before)
            try:
                pieces = self._go(there, name)
                return [*pieces, self._swing(site, name)]
            except PathError as other:
                raise max(error, other, key=lambda item: item.clearance) from None

    def _swing(self, site: Site, name: str) -> LegPart:
        """Turn the mast to where it is at a site, while the arm keeps its shape."""
        first, last, chain = self.site.turn, site.turn, self.site.chain
        slew = site.task.mast.turn
        assert slew is not None  # of a scene with such a step
        out = np.linalg.norm(chain.nodes(self.here)[:, :2] - chain.mount[:2, 3], axis=1).max()
        count = int(np.ceil(abs(last - first) * out / _SWEPT)) + 1
        sites = [replace(self.site, turn=float(turn)) for turn in np.linspace(first, last, count + 1)]
        gap, place = min(item.surroundings.least(self.here) for item in sites)
        if gap < site.clearance:
            turned = f"{place}, while the mast turns from {np.degrees(first):.3g} to {np.degrees(last):.3g} degrees"
            raise PathError(name, gap, turned)
        self._enter(site)
        self.trail.clear()
        return self._run(gap, place, time_turn(self.here, first, last, slew))

    def _stand(self, time: float) -> LegPart:
        length, height = self.site.chain.lengths(self.here), self.height
        if height:
            gaps = Entry(self.site).gaps(self.here[None], np.array([height])).least()
            place = min(gaps, key=lambda name: gaps[name])
            gap = gaps[place]
        else:
            gap, place = self.site.surroundings.least(self.here)

        def rows(timestep: float) -> ProgrammeRows:
            count = max(2, round(time / timestep) + 1)
            return ProgrammeRows(np.tile(length, (count, 1)), np.full(count, height) if height else None)

        return replace(self._make_piece(gap, place, rows), bound=True)

    def _make_piece(
        self, clearance: float, place: str, rows: Callable[[float], ProgrammeRows], timed: TimedPath | None = None
    ) -> LegPart:
        return LegPart(clearance=clearance, place=place, rows=rows, turn=self.site.turn, timed=timed)

    def _feed(self, way: Insertion) -> LegPart:
        self.here, self.height = way.ends[1], read_height(way.feed([1.0]))
        place = min(way.gaps, key=lambda name: way.gaps[name])
        piece = self._run(way.gaps[place], place, time_way(self.site, way))
        return replace(piece, leader=make_leader(self.site, way), bound=True)

    def _run(self, clearance: float, place: str, timed: TimedPath) -> LegPart:
        chain = self.site.chain

        def rows(timestep: float) -> ProgrammeRows:
            return ProgrammeRows(chain.lengths(timed.inputs(timestep)), *timed.mast(timestep))

        return self._make_piece(clearance, place, rows, timed)

    def _go(self, there: Array, name: str) -> list[LegPart]:
        path = plan_path(self.corridor, self.here, there, name, self.carousel)
        self.here = there
        self.trail.append(path)
        return [self._run(path.clearance, path.place, time_path(self.site.chain, path.curve, self.limits))]

    def raster(self, step: RasterStep, tool: tuple[Array, Array]) -> list[LegPart]:
        """Rows from a tool point, shape (3,), m, with a direction, shape (3,)."""
        motion, (position, direction) = self.site.task.motion, tool
        path = ToolPath(
            name="raster",
            start=tuple(position.tolist()),
            direction=tuple(direction.tolist()),
            tolerance=step.tolerance,
            rate_fraction=motion.rate_fraction,
            acceleration=motion.acceleration,
            pieces=(RasterPiece(shape="raster", width=step.width, depth=step.depth, rows=step.rows),),
        )
        middle = position + (np.array(step.width) + step.depth) / 2
        pieces, rows = self._run_rows(path, middle, free=step.direction == "free")
        return [*pieces, rows]

    def _cut(self, step: CutStep) -> list[LegPart]:
        """Rows over a patch, with rests in which the tool comes to power; what is planned after them knows what they leave."""
        site, motion = self.site, self.site.task.motion
        assert self.heights is not None  # of a scene with such a step
        index = next(i for i, item in enumerate(site.task.mission) if item is step)
        cut = plan_cut(site, index, step, self.heights)
        path = cut.make_path(site.chain.tool(self.here)[1], motion.rate_fraction, motion.acceleration)
        pieces, rows = self._run_rows(path, cut.middle, free=step.direction == "free")

        def run(timestep: float) -> ProgrammeRows:
            lengths, share = cut.add_rests(rows.rows(timestep).lengths, timestep)
            return ProgrammeRows(lengths, tool=share)

        lengths, share = cut.add_rests(rows.rows(site.timestep).lengths, site.timestep)
        self.lower(foresee_cut(site, lengths, share, site.timestep, self.heights))
        return [*pieces, replace(rows, rows=run)]

    def _run_rows(self, path: ToolPath, middle: Array, *, free: bool) -> tuple[list[LegPart], LegPart]:
        """The way to the begin of rows, and the rows, near a posture that is clear of everything at their middle, (3,), m.

        A tool that is `free` points anywhere meanwhile.
        """
        if free:
            problem = make_problem(self.site, aim_tool(middle, None), *usual_way(self.site))
            clear = np.array(solve_by_method("rows", problem, self.here).q)
        else:
            goal = Goal(name="rows", position=tuple(middle.tolist()), direction=path.direction)
            clear = pose_at(self.site, goal, self.here)
        run, piece = self._follow(path, clear, free=free)
        pieces = self._go(run.q[0], f"the first row of {path.name}")
        self.here = run.q[-1]
        return pieces, piece

    def _follow(self, path: ToolPath, clear: Array | None = None, *, free: bool = False) -> tuple[Followed, LegPart]:
        """A path of the tool, from the posture near the present one in which the arm can follow it, inside the scene's rates.

        With a clear posture, shape (n,), all postures stay as near to it as they can.
        """
        site, motion = self.site, self.site.task.motion
        goal = aim_tool(path.start, None if free else path.direction)
        slow = {name: min(getattr(path, name), getattr(motion, name)) for name in ("rate_fraction", "acceleration")}
        path = path.model_copy(update=slow)
        near = make_objective(site, goal, _SMOOTH) if clear is None else Nearness(site.chain.lengths(clear))
        problem = Problem(box=site.box, goal=goal, objective=near)
        run = follow_path(problem, path, self.here if clear is None else clear, site.timestep, site.subspace, free=free)
        start = run.q[0]
        gap, place = site.surroundings.least(run.q[:: max(1, len(run.q) // _JUDGED)])
        if gap < site.clearance:
            raise PathError(path.name, gap, place)
        check_passage(site, run.q[:: max(1, round(_LOOKED / site.timestep))])

        def rows(timestep: float) -> ProgrammeRows:
            if timestep == site.timestep:
                return ProgrammeRows(run.lengths)
            return ProgrammeRows(follow_path(problem, path, start, timestep, site.subspace, free=free).lengths)

        return run, replace(self._make_piece(gap, place, rows), bound=True)


def plan_mission(site: Site, way: Insertion | None = None) -> Tour:
    """Plan the mission of a scene, a leg for each step; the same scene gives the same legs, bit for bit.

    A way in that is known is taken; on one of a part of the arm, the steps may begin with that part in the clamp.

    Raises:
        DescriptionError: The scene cannot work, see `check_site`, or the arm cannot come through the riser, see `check_entry`.
        PathError: There is no way in, or no clear path between two steps.
        ReachError: A goal cannot be met.
        FollowError: The posture would jump on a path.
    """
    return carry_out(site, way)[0]


def carry_out(site: Site, way: Insertion | None) -> tuple[Tour, Array | None]:
    """A mission's tour, and heights of the waste that it will leave in the diggings, shape (P,), m, if it cuts any."""
    steps = site.task.mission
    check_site(site)
    if way is not None:
        begun = int(isinstance(next(iter(steps)), HoldStep))
        plan = MissionPlan(site=site, here=way.ends[begun], height=float(way.feed(float(begun))), way=way)
    elif begins_inside(steps):
        plan = MissionPlan(site=site, here=site.start)
    else:
        check_entry(site)
        check_passage(site, site.chain.stowed[None])
        plan = MissionPlan(site=site, here=site.chain.stowed)
    check_cuts(site)
    start = np.array(plan.here)
    for step in steps:
        plan.add(step)
    bounds = find_bounds(site, plan.check_lines())
    timestep = choose_step(site, bounds)
    legs = tuple(make_leg(site, index, plan, index, timestep) for index in range(len(plan.pieces)))
    return Tour(start=start, legs=legs, timestep=timestep, bounds=bounds, way=plan.way), plan.heights


def make_leg(site: Site, stage: int, plan: MissionPlan, index: int, timestep: float) -> Leg:
    """The leg of an index in a plan, which is that of a stage of the run."""
    pieces = plan.pieces[index]
    nearest = min(pieces, key=lambda piece: piece.clearance)
    parts = [(piece.rows(timestep), piece.turn) for piece in pieces]
    return Leg(
        name=site.stages[stage].name,
        goal=stage,
        q=plan.ends[index],
        clearance=nearest.clearance,
        place=nearest.place,
        **join_rows(parts)._asdict(),
        leader=find_leader(pieces),
        bound=sum(len(part.lengths) - 1 for part, _ in parts[:-1]) if pieces[-1].bound else None,
        trail=plan.trails[index],
    )


def find_leader(pieces: Sequence[LegPart]) -> Leader | None:
    """What an arm follows on some parts of a leg."""
    return next((piece.leader for piece in pieces if piece.leader is not None), None)
