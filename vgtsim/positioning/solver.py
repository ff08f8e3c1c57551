"""A configuration for a tool goal: by a named method, inside the strokes, and clear of everything where that is asked.

One entry, `solve_goal`. The first start is the present configuration swung to the goal's azimuth; where it does not lead
to the goal, or not clear of the surroundings, several others are tried at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.redundancy import Method
from vgtsim.errors import ReachError
from vgtsim.positioning.methods import Notes, Resolved, bring_starts_inside, resolve
from vgtsim.positioning.nearest import come_nearest
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.objectives import Clearance, WeightedSum
from vgtsim.positioning.positioning import Positioning
from vgtsim.positioning.restarts import choose_postures, make_postures
from vgtsim.positioning.seeds import make_seeds
from vgtsim.positioning.strokes import binding_actuators
from vgtsim.positioning.surroundings import Surroundings

Array = NDArray[np.float64]

_WITHIN_REACH = 1e-3  # error, m or rad, below which only the surroundings keep the arm from the goal
_POSTURES = 8  # of the table, tried when all else has failed
_INSIST = (10.0, 1000.0)  # weights of the clearance's hinges beside an objective that does not keep it


@dataclass(frozen=True)
class Keep:
    """A clearance that every configuration must keep.

    Attributes:
        surroundings: From what.
        clearance: How much, m.
    """

    surroundings: Surroundings
    clearance: float


@dataclass(frozen=True)
class GoalSolution:
    """A configuration that meets a goal.

    Attributes:
        q: Inputs, shape (n,).
        error: Goal rows, shape (m,), m and rad.
        value: Of the objective with the stroke barrier.
        iterations: Over all starts.
        optimal: Whether it is a local optimum to second order.
        stationarity: Slope left in the null space, relative.
        clearance: Least clearance, m; infinite when none is asked for.
        nearest: What is that near; empty when none is asked for.
        notes: What the method has to say of itself.
    """

    q: Array
    error: Array
    value: float
    iterations: int
    optimal: bool
    stationarity: float
    clearance: float
    nearest: str
    notes: Notes = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self.q.flags.writeable = False
        self.error.flags.writeable = False


def solve_goal(
    name: str,
    problem: Positioning,
    method: Method,
    start: ArrayLike,
    keep: Keep | None = None,
    settings: NewtonSettings | None = None,
) -> GoalSolution:
    """Find a configuration that meets a goal.

    Args:
        name: Of the goal, for errors.
        problem: One tool goal, strokes, objective; for the coupled method with its reduction.
        method: How redundancy is resolved.
        start: Present inputs, shape (n,).
        keep: Clearance asked for; the objective is made to keep it where it does not by itself.
        settings: Of the iteration.

    Returns:
        The best solution of the first group of starts that has any; its clearance is at least the one asked for.

    Raises:
        ReachError: No start leads to the goal, or none clear of the surroundings; it holds the shortfall and what binds.
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.

    Source: chapters 6 to 8; see `methods`.
    """
    how = settings or NewtonSettings()
    count, near, missed = 0, [], []
    for starts in _groups(problem, method, np.asarray(start, float)):
        try:
            found = resolve(problem, method, starts, how)
        except ReachError as error:  # of a curve, which knows no goal's name
            raise ReachError(name, error.shortfall, error.binding, error.detail) from None
        count += int(np.sum(found.positions.iterations))
        solved = [_solution(found, i, count, keep) for i in np.flatnonzero(found.positions.met)]
        if keep is not None:
            solved, steps = _insist(problem, method, solved, keep, how)
            count += steps
        clear = [item for item in solved if keep is None or item.clearance >= keep.clearance]
        if clear:
            return min(clear, key=lambda item: item.value)
        near += solved
        missed.append(found.positions.q[~found.positions.met])
    raise _reach_error(name, problem, near, np.concatenate(missed), keep, how.most)


def _groups(problem: Positioning, method: Method, start: Array) -> Iterator[Array]:
    """Starts inside the strokes, shape (S, n): the likely one, the other seeds, postures that come near the goal."""
    target = np.asarray(problem.goal.parts[0].target, float)
    seeds = make_seeds(problem.chain, start, target)
    yield bring_starts_inside(problem, seeds[:1])
    if method is Method.SHAPE:  # which starts from its curve
        return
    yield bring_starts_inside(problem, seeds[1:])
    table, first = make_postures(problem.chain, problem.box), np.zeros(1, int)
    postures = np.concatenate([choose_postures(problem, table, first, attempt) for attempt in range(_POSTURES)])
    yield bring_starts_inside(problem, postures)


def _solution(found: Resolved, i: np.intp, count: int, keep: Keep | None) -> GoalSolution:
    at = found.positions
    clearance, place = keep.surroundings.least(at.q[i]) if keep else (np.inf, "")
    return GoalSolution(
        np.array(at.q[i]),
        np.array(at.error[i]),
        float(at.value[i]),
        count,
        bool(at.optimal[i]),
        float(at.stationarity[i]),
        clearance,
        place,
        found.notes[i],
    )


def _insist(
    problem: Positioning, method: Method, solved: list[GoalSolution], keep: Keep, how: NewtonSettings
) -> tuple[list[GoalSolution], int]:
    """Where no solution keeps the clearance, those of an objective to which it is added; and the number of iterations."""
    steps = 0
    hinges = Clearance(keep.surroundings, keep.clearance, payload=False)
    for weight in _INSIST:
        if not solved or any(item.clearance >= keep.clearance for item in solved):
            break
        harder = replace(problem, objective=WeightedSum(((1.0, problem.objective), (weight, hinges))))
        found = resolve(harder, method, np.array([item.q for item in solved]), how)
        steps += int(np.sum(found.positions.iterations))
        before = solved[0].iterations
        solved = [_solution(found, i, before + steps, keep) for i in np.flatnonzero(found.positions.met)]
    return solved, steps


def _reach_error(
    name: str, problem: Positioning, near: list[GoalSolution], missed: Array, keep: Keep | None, most: int
) -> ReachError:
    """What keeps the arm from a goal: its strokes, or what stands about it."""
    shapes = [(item.clearance, item.nearest) for item in near]
    if not near:
        q, left = come_nearest(problem, missed, most)
        best = int(np.argmin(np.linalg.norm(left, axis=1)))
        if keep is None or np.linalg.norm(left[best]) > _WITHIN_REACH:
            shortfall, turn = float(np.linalg.norm(left[best, :3])), 2 * np.arctan(np.linalg.norm(left[best, 3:]) / 2)
            place = ", ".join(f"{x:.3f}" for x in problem.chain.tool(q[best])[0])
            detail = f"nearest at ({place}) m, direction off by {np.degrees(turn):.3g} degrees"
            return ReachError(name, shortfall, binding_actuators(problem.chain, problem.box, q[best]), detail)
        shapes = [keep.surroundings.least(q[best])]
    assert keep is not None  # or the goal would have been met
    clearance, place = max(shapes)
    detail = f"it is near enough, but every posture found there comes to {clearance:.3f} m of {place}"
    return ReachError(name, 0.0, (place,), f"{detail}, wanted {keep.clearance:.3f} m")
