"""A tool path as actuator lengths in time, inside the rates and accelerations of the cylinders.

Each piece is solved goal by goal, each goal from the one before. Then the number of goals is doubled until the spline
through them keeps the tool on the path between goals too. The error falls with the sixth power of the distance between
goals where the posture is a smooth function of the goal. It does not fall where the posture jumps. Each piece is run
from rest to rest, so a corner of the path asks no infinite acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import ToolPath
from vgtsim.errors import FollowError, ReachError
from vgtsim.geometry import Stretch, make_stretches
from vgtsim.kinematics import Chain, Subspace
from vgtsim.planning.curve import Curve, make_curve
from vgtsim.planning.resolution import aim_tool, make_objective
from vgtsim.planning.timing import SpeedLimits, make_limits, time_lengths
from vgtsim.positioning import (
    NewtonSettings,
    Problem,
    Solution,
    binding_actuators,
    inside,
    join_solutions,
    solve,
    solve_anywhere,
    tool_goal,
)
from vgtsim.site import Place

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


_FIRST = 17  # goals of a piece that are solved one after the other, so that each start is near its goal
_MOST = 2049  # 17 goals doubled seven times: a piece that still leaves the path then has a jump
_BETWEEN = 8  # places between two goals at which the deviation is measured
_STEADY = 0.998  # of the speed asked for: a slower motion has other steps, which may be a little faster
_JUDGED = 1000  # instants at which clearance is measured
_SOLVING = NewtonSettings(optimality=1e-12, most=300)  # a looser optimum shows as noise in the accelerations


@dataclass(frozen=True)
class Followed:
    """A path as it is run.

    Attributes:
        time: Shape (T,), s.
        q: Inputs, shape (T, n).
        lengths: Actuator lengths, shape (T, J), m.
        stretch: Index into `names` at each instant, shape (T,).
        deviation: Greatest distance of the tool from the path, at goals and between them, m.
        turn: Greatest angle between the tool's direction and the path's, rad.
        goals: Number of goals solved.
        iterations: Number of iterations over all goals.
        optimal: Share of the goals that are local optima to second order.
    """

    time: Array
    q: Array
    lengths: Array
    stretch: Index
    names: tuple[str, ...]
    limits: SpeedLimits
    deviation: float
    turn: float
    goals: int
    iterations: int
    optimal: float

    @property
    def rates(self) -> Array:
        """Differences of the lengths over the step, shape (T - 1, J), m/s."""
        return np.diff(self.lengths, axis=0) / (self.time[1] - self.time[0])

    @property
    def accelerations(self) -> Array:
        """Second differences over the squared step, shape (T - 2, J), m/s²."""
        return np.diff(self.lengths, n=2, axis=0) / (self.time[1] - self.time[0]) ** 2


def follow_request(place: Place, path: ToolPath, objectives: tuple[str, ...]) -> Followed:
    """Follow a path from the start of a site, or of a straight arm alone, by names of objectives (`name` or `name:weight`).

    Raises:
        DescriptionError: An objective is not known, or needs a scene; or the path is none.
        GoalError: The arm has too few actuators for a point and a direction.
        ReachError: A goal is not met inside the strokes.
        FollowError: The posture jumps.
    """
    goal = tool_goal(path.start, path.direction)
    objective = make_objective(place, goal, objectives)
    problem = Problem(box=place.box, goal=goal, objective=objective, reduction=place.reduction)
    return follow_path(problem, path, place.start, place.timestep, place.subspace)


def follow_path(
    problem: Problem, path: ToolPath, start: Array, timestep: float, space: Subspace, *, free: bool = False
) -> Followed:
    """Solve a path from inputs of shape (n,) and time it, within its tolerance and inside all rates and accelerations.

    The problem's goal is replaced. The inputs stay in a subspace, that of the problem's reduction. The time step is in s.
    A tool that is `free` follows the path's points and points anywhere.

    Raises:
        DescriptionError: The path is none.
        ReachError: A goal is not met inside the strokes.
        FollowError: The posture jumps.
    """
    chain = problem.chain
    stretches, limits = make_stretches(path), make_limits(chain, path.rate_fraction, path.acceleration)
    here, lengths, which, off, solved = start, [np.empty((0, chain.layout.actuators))], [], [], []
    for i, stretch in enumerate(stretches):
        curve, found = _solve(problem, space, stretch, here, path.tolerance, first=i == 0, free=free)
        count = _BETWEEN * (len(found.q) - 1) + 1
        ahead = None if free else stretch.directions(count)
        off.append(_off(chain, curve(np.linspace(0.0, 1.0, count)), stretch.points(count), ahead))
        rows = _timed(chain, curve, limits, timestep, path.speed)
        lengths.append(rows if i == 0 else rows[1:])
        which += [i] * len(lengths[-1])
        solved.append(found)
        here = found.q[-1]
    whole, (deviation, turn) = np.concatenate(lengths), np.max(off, axis=0).tolist()
    return Followed(
        time=np.asarray(timestep * np.arange(len(whole)), float),
        q=chain.inputs_from_lengths(whole),
        lengths=whole,
        stretch=np.array(which),
        names=tuple(stretch.name for stretch in stretches),
        limits=limits,
        deviation=deviation,
        turn=turn,
        goals=sum(len(found.q) for found in solved),
        iterations=sum(int(found.iterations.sum()) for found in solved),
        optimal=float(np.mean(np.concatenate([found.optimal for found in solved]))),
    )


def report(place: Place, followed: Followed) -> dict[str, str | float | int]:
    """Figures of a followed path by name and unit; the clearance is measured only at a site.

    Rates and accelerations are differences of the lengths as they are run.
    """
    chain = place.chain
    rate = float(np.max(np.abs(followed.rates) / followed.limits.rate))
    way = np.linalg.norm(np.diff(chain.tool(followed.q)[0], axis=0), axis=1)
    spare = np.minimum(followed.lengths - chain.stroke[0], chain.stroke[1] - followed.lengths)
    found: dict[str, str | float | int] = {
        "duration, s": float(followed.time[-1]),
        "length of the tool's way, m": float(way.sum()),
        "greatest speed of the tool, m/s": float(way.max() / followed.time[1]),
        "greatest rate over its limit": rate,
        "greatest acceleration, m/s^2": float(np.max(np.abs(followed.accelerations))),
        "limit of acceleration, m/s^2": followed.limits.acceleration,
        "greatest deviation of the tool, m": followed.deviation,
        "greatest deviation of its direction, rad": followed.turn,
        "least distance to the end of a stroke, m": float(spare.min()),
        "goals": followed.goals,
        "iterations": followed.iterations,
        "goals that are local optima, %": 100 * followed.optimal,
    }
    if place.surroundings:
        looked = followed.q[:: max(1, len(followed.q) // _JUDGED)]
        found["least clearance, m"], found["nearest"] = place.surroundings.least(looked)
    return found


def _solve(
    problem: Problem, space: Subspace, stretch: Stretch, start: Array, tolerance: float, *, first: bool, free: bool
) -> tuple[BSpline | Curve, Solution]:
    """Inputs over the parameter 0 to 1, and the goals they go through, in order."""
    points, directions = stretch.points(_FIRST), stretch.directions(_FIRST)
    parts, here = [], start
    for k in range(_FIRST):
        single = replace(problem, goal=aim_tool(points[k], None if free else directions[k]))
        found = solve_anywhere(single, here, _SOLVING) if first and k == 0 else solve(single, here, _SOLVING)
        _refuse(problem, stretch, found, np.array([k]), _FIRST)
        parts.append(found)
        here = found.q[0]
    every = join_solutions(parts)
    while True:
        count = len(every.q)
        curve = make_curve(space, every.q)
        twice = 2 * count - 1
        middle = np.arange(1, twice, 2)
        guess = curve(np.linspace(0.0, 1.0, twice)[middle])
        ahead = None if free else stretch.directions(twice)[middle]
        off = max(_off(problem.chain, guess, stretch.points(twice)[middle], ahead))
        if off <= tolerance:
            return curve, every
        if twice > _MOST:
            raise FollowError(stretch.name, off, tolerance, count)
        between = (every.q[1:] + every.q[:-1]) / 2
        guess = np.where(inside(problem.box, guess)[:, None], guess, between)
        goal = aim_tool(stretch.points(twice)[middle], ahead)
        found = solve(replace(problem, goal=goal), guess, _SOLVING)
        _refuse(problem, stretch, found, middle, twice)
        order = np.argsort(np.concatenate([np.arange(0, twice, 2), middle]))
        every = join_solutions([every, found]).pick(order)


def _refuse(problem: Problem, stretch: Stretch, found: Solution, which: Index, count: int) -> None:
    for i in np.flatnonzero(~found.met)[:1]:
        name = f"{stretch.name} at {which[i] / (count - 1):.0%} of the way"
        short = float(np.linalg.norm(found.error[i, :3]))
        raise ReachError(name, short, binding_actuators(problem.box, found.q[i]))


def _off(chain: Chain, q: Array, points: Array, directions: Array | None) -> tuple[float, float]:
    """Greatest distance of the tool, m, and of its direction, rad, from where they should be, if that counts."""
    position, direction = chain.tool(q)
    directions = direction if directions is None else directions
    sine = np.linalg.norm(np.cross(direction, directions), axis=-1)
    angle = np.arctan2(sine, np.sum(direction * directions, axis=-1))
    return float(np.max(np.linalg.norm(position - points, axis=-1))), float(np.max(angle))


def _timed(chain: Chain, curve: BSpline | Curve, limits: SpeedLimits, timestep: float, speed: float | None) -> Array:
    """Lengths at every step, shape (n, 3 A), m; slowed as a whole where the tool would be faster than it may."""
    rows = time_lengths(chain, curve, limits, timestep)
    if speed is None:
        return rows
    q = chain.inputs_from_lengths(rows)
    fastest = float(np.max(np.linalg.norm(np.diff(chain.tool(q)[0], axis=0), axis=1))) / timestep
    part = min(1.0, _STEADY * speed / max(fastest, 1e-12))
    return time_lengths(chain, curve, SpeedLimits(part * limits.rate, part**2 * limits.acceleration), timestep)
