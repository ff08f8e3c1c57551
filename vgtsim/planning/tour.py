"""The tour: for every leg the actuator lengths at every step of the simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vgtsim.arrays import Array
from vgtsim.constants import Method
from vgtsim.description import Goal
from vgtsim.digests import digest
from vgtsim.errors import ReachError, TrussError
from vgtsim.planning.carousel import Carousel
from vgtsim.planning.checks import check_passage, check_site
from vgtsim.planning.directrix import Leader, LeaderPair
from vgtsim.planning.insertion import Insertion
from vgtsim.planning.pace import choose_step, find_bounds
from vgtsim.planning.path import Path, plan_path, plan_stages
from vgtsim.planning.resolution import MARGIN, make_problem, usual_way
from vgtsim.planning.sampling import Ground
from vgtsim.planning.timing import make_limits, time_path
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import Keep, solve_by_method, tool_goal
from vgtsim.site import Site
from vgtsim.statics import settle, tool_point

_LOOKED = 61  # postures of a path in which a line must pass the arm
_AIMS = 6  # corrections of the aim for the sag of an elastic arm
_AIMED = 1e-4  # error of the settled tool that ends the corrections, m and rad: a tenth of the tracking limit


@dataclass(frozen=True)
class Leg:
    """The way to one goal; the clearance, m, is the least planned one, from the thing named `place`.

    Actuator lengths at every step, the first and last included, have shape (T, J), m. `q` are the inputs at the end,
    shape (n,), and `goal` the index of the goal in the scene. `feed`, shape (T,), m, lifts the mast above its working depth;
    without one the mast stays where it is. `turn`, shape (T,), rad, turns it likewise. `tool`, shape (T,), is the share of its
    power at which the tool removes waste; without one it rests. On the way in or out the arm follows a `leader`.
    From the row `bound` on it keeps to rows that the task asks for, so that no other way will do; without one there are none.
    `trail` are the ways of a mission that the arm went since the way in, with its mast as it is turned at the end.
    """

    name: str
    goal: int
    lengths: Array
    q: Array
    clearance: float
    place: str
    feed: Array | None = None
    turn: Array | None = None
    tool: Array | None = None
    leader: Leader | LeaderPair | None = None
    bound: int | None = None
    trail: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.lengths, self.q, self.feed, self.turn, self.tool):
            if array is not None:
                array.flags.writeable = False


@dataclass(frozen=True)
class Tour:
    """Timed lengths from the start inputs, shape (n,), to every goal in turn; the time step is in s.

    Each leg begins with the lengths, and with the place of the mast, at which the leg before it ended. Of a tour that was planned
    anew on its way, `planned` is the digest of the first plan; `blocked` says why there was no way on from its last leg.
    A mission has the `way` in that it found.
    """

    start: Array
    legs: tuple[Leg, ...]
    timestep: float
    bounds: Mapping[str, float] = field(default_factory=dict)
    planned: str = ""
    blocked: str = ""
    way: Insertion | None = None

    def __post_init__(self) -> None:
        self.start.flags.writeable = False

    @property
    def digest(self) -> str:
        """Digest of timed lengths, places of the mast and shares of the tool's power, the goals' indices and the time step."""
        if self.planned:
            return self.planned
        parts = []
        for leg in self.legs:
            parts += [str(leg.goal).encode(), leg.lengths.tobytes()]
            parts += [extra.tobytes() for extra in (leg.feed, leg.turn, leg.tool) if extra is not None]
        return digest(repr(float(self.timestep)).encode(), *parts)

    @property
    def duration(self) -> float:
        """Time in motion, holds not counted, s."""
        return self.timestep * sum(len(leg.lengths) - 1 for leg in self.legs)


def solve_first_goal(site: Site) -> Array:
    """Inputs at the first goal, shape (n,), without planning the way to it; the site is not checked, see `check_site`.

    Where an operator drives the arm, those of the start.

    Raises:
        ReachError: The goal cannot be met.
    """
    goals = site.task.motion.goals
    return configure(site, goals[0], site.start) if goals else site.start


def plan_tour(site: Site) -> Tour:
    """Plan the tour of a scene; the same scene gives the same tour, bit for bit.

    All goals are solved before the first path is planned, so that a goal out of reach is reported soon.

    Raises:
        DescriptionError: The scene cannot work, see `check_site`, or has no goals.
        ReachError: A goal cannot be met, or not by an arm that gives.
        TrussError: The arm does not settle at a goal.
        PathError: No clear path to a goal was found.
    """
    check_site(site)
    motion = site.task.motion
    if not motion.goals:
        raise site.scene.error(
            "motion.goals", "none: an operator drives the arm", "goals, between which a tour is planned"
        )
    return plan_goals(site, site.start)


def plan_goals(site: Site, start: Array, first: int = 0, timestep: float | None = None) -> Tour:
    """Plan the tour from a start, shape (n,), to the goals from the first on, with a time step, s, that is chosen or given.

    Raises:
        VgtError: As in `plan_tour`; the site is not checked.
    """
    motion = site.task.motion
    goals = motion.goals[first:]
    shapes = [start]
    for goal in goals:
        shapes.append(pose_at(site, goal, shapes[-1]))
    check_passage(site, np.array(shapes))
    corridor = Corridor(site.box, site.surroundings, site.clearance, subspace=site.subspace)
    limits = make_limits(site.chain, motion.rate_fraction, motion.acceleration)
    ends = zip(goals, shapes[:-1], shapes[1:], strict=True)
    carousel = Carousel(Ground(corridor))
    paths = [_find_paths(site, corridor, first, last, goal.name, carousel) for goal, first, last in ends]
    check_passage(site, np.concatenate([path.curve(np.linspace(0, 1, _LOOKED)) for leg in paths for path in leg]))
    ways = [[time_path(site.chain, path.curve, limits) for path in leg] for leg in paths]
    clearances = [path.clearance for leg in paths for path in leg]
    bounds = find_bounds(site, zip([way for leg in ways for way in leg], clearances, strict=True))
    timestep = timestep or choose_step(site, bounds)
    legs = []
    for index, (goal, parts, timed, last) in enumerate(zip(goals, paths, ways, shapes[1:], strict=True), start=first):
        nearest = min(parts, key=lambda path: path.clearance)
        lengths = [site.chain.lengths(way.inputs(timestep)) for way in timed]
        leg = Leg(
            name=goal.name,
            goal=index,
            lengths=np.concatenate([lengths[0], *(rows[1:] for rows in lengths[1:])]),
            q=last,
            clearance=nearest.clearance,
            place=nearest.place,
        )
        legs.append(leg)
    return Tour(start=start, legs=tuple(legs), timestep=timestep, bounds=bounds)


def pose_at(site: Site, goal: Goal, start: Array) -> Array:
    """Inputs with the tool of the arm, sagging or not, at a goal, shape (n,), sought from a start.

    Raises:
        ReachError: The goal cannot be met, or not by an arm that gives.
        TrussError: The arm does not settle at the goal.
    """
    q = configure(site, goal, start)
    return _aim_above(site, goal, q) if site.sags else q


def _find_paths(site: Site, corridor: Corridor, first: Array, last: Array, name: str, carousel: Carousel) -> list[Path]:
    """Paths to a goal, one after the other: one, or with anchoring one for each window of modules."""
    if site.task.motion.method is Method.ANCHORED:
        groups = None if site.reduction is None else site.reduction.gather(site.chain.layout.owner)
        return plan_stages(corridor, first, last, name, groups)
    return [plan_path(corridor, first, last, name, carousel)]


def configure(site: Site, goal: Goal, start: Array, aim: Array | None = None, keep: Keep | None = None) -> Array:
    """Inputs with the tool of an arm that does not sag at a goal, or at an aim in its place, shape (2, 3), sought from a start.

    Raises:
        ReachError: The goal cannot be met.
    """
    position, direction = (goal.position, goal.direction) if aim is None else aim
    problem = make_problem(site, tool_goal(position, direction), *usual_way(site), keep)
    return np.array(solve_by_method(goal.name, problem, start).q)


def _aim_above(site: Site, goal: Goal, q: Array) -> Array:
    """Inputs with which a sagging arm holds its tool at a goal: the aim is moved by the error that is left."""
    keep = Keep(site.surroundings, site.clearance + MARGIN / 2)
    left = _find_error(site, goal, q)
    aim = np.array([goal.position, goal.direction])
    for _ in range(_AIMS):
        if np.abs(left).max() < _AIMED:
            return q
        aim += left
        q = configure(site, goal, q, aim, keep)
        left = _find_error(site, goal, q)
    if np.abs(left).max() < _AIMED:
        return q
    short, turn = np.linalg.norm(left, axis=1)
    detail = f"sagging, after {_AIMS} corrections of the aim; direction off by {np.degrees(turn):.3g} degrees"
    raise ReachError(goal.name, float(short), (), detail)


def _find_error(site: Site, goal: Goal, q: Array) -> Array:
    """Goal less settled tool: position, m, and direction, shape (2, 3)."""
    elastic = site.held_model
    try:
        nodes = settle(elastic, site.chain.nodes(q))
    except TrussError as error:
        raise TrussError(error.rank, error.members, f"the arm at goal {goal.name!r}: {error.detail}") from None
    corner = nodes[site.truss.tip]
    normal = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    reached = [tool_point(elastic.loads, nodes), normal / np.linalg.norm(normal)]
    return np.array([goal.position, goal.direction]) - reached
