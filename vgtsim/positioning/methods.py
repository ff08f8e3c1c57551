"""One goal by one of the dissertation's methods, from several configurations at once: the only dispatch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index
from vgtsim.constants import Method
from vgtsim.errors import GoalError
from vgtsim.positioning.goals import Direction, Position
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.problem import Problem, solve
from vgtsim.positioning.reduction import anchor
from vgtsim.positioning.shape import solve_shapes
from vgtsim.positioning.solution import Notes, Solution, join_solutions

ANCHOR_FREE = 3  # modules free at a time in successive anchoring: nine inputs for five goal rows
_FALL = 1e-9  # of the objective in a whole cycle, of 1 + |objective|, that is not worth another cycle
_STAGES = 200  # at most, of one goal


def solve_by(method: Method, problem: Problem, starts: Array, settings: NewtonSettings) -> Solution:
    """Solve one tool goal by one method from inputs inside the strokes, shape (S, n).

    There is one solution for each start, met or not. Shape control makes its own starts: there is one solution for each
    curve, the least objective first.

    Raises:
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.
        ReachError: Shape control finds no curve.

    Source: chapters 6, 7.2, 7.3 and 7.4.
    """
    if method is Method.SHAPE:
        return _by_shape(problem)
    several = replace(problem, goal=problem.goal.repeat(len(starts)))
    if method is Method.ANCHORED:
        return _by_anchoring(problem, solve(several, starts, replace(settings, optimality=np.inf)), settings)
    return solve(several, starts, settings)


def _by_anchoring(problem: Problem, found: Solution, settings: NewtonSettings) -> Solution:
    """Successive anchoring from each configuration that meets the goal (section 7.2.1)."""
    free = min(ANCHOR_FREE, int(_find_groups(problem).max()) + 1)
    stages = [0] * len(found.q)
    for i in np.flatnonzero(found.met):
        cycle = anchor_successively(problem, found.q[i], free, settings)
        stages[i] = cycle.stages
        found.put(np.array([i]), cycle.solution)
        found.iterations[i] = cycle.solution.iterations[0]
    return replace(found, notes=_column([{"stages": count} for count in stages]))


def _find_groups(problem: Problem) -> Index:
    """Number of each input's module, or group of coupled modules, shape (n,)."""
    owner = problem.chain.layout.owner
    return owner if problem.reduction is None else problem.reduction.gather(owner)


def _by_shape(problem: Problem) -> Solution:
    place, along = problem.goal.groups
    assert isinstance(place, Position) and isinstance(along, Direction)  # noqa: PT018  # a tool goal's
    shapes = solve_shapes(problem.box, place.target, along.target, problem.objective)
    whole = join_solutions([item.solution for item in shapes])
    notes: list[Notes] = [
        {"tangent magnitudes, m": str(np.round(item.magnitudes, 3)), "fit beyond strokes, m": item.overrun}
        for item in shapes
    ]
    return replace(whole, value=np.array([item.value for item in shapes]), notes=_column(notes))


def _column(notes: list[Notes]) -> NDArray[np.object_]:
    column = np.empty(len(notes), object)
    column[:] = notes
    return column


@dataclass(frozen=True)
class Cycle:
    """How a cycle of anchored solutions went.

    Attributes:
        solution: Of one goal, at the end of the last stage.
        values: Objective after each stage; it never rises once the goal is met.
        converged: Whether a whole cycle passed without a fall.
    """

    solution: Solution
    values: tuple[float, ...]
    stages: int
    converged: bool


def anchor_successively(problem: Problem, start: ArrayLike, free: int, settings: NewtonSettings | None = None) -> Cycle:
    """Solve one goal from inputs of shape (n,) with a moving window of `free` modules until no window improves it.

    Modules that the problem couples count as one, and stay coupled in every stage.

    The end is stationary in every window, and in the whole arm when the windows' null spaces together span that of the
    arm.

    Raises:
        GoalError: The free inputs are not more than the goal rows, or the goal is not met even with all inputs free.

    Source: section 7.2.1.
    """
    rows, owner = len(problem.tolerance), _find_groups(problem)
    count = int(owner.max()) + 1
    fewest = min(int(np.isin(owner, (k + np.arange(free)) % count).sum()) for k in range(count))
    if not rows < fewest or free > count:
        raise GoalError(problem.goal.names, 0.0, f"{rows} goal rows for {fewest} free inputs of {len(owner)}")
    how = settings or NewtonSettings()
    feasible = solve(problem, start, replace(how, optimality=np.inf))  # any solution will do to begin with
    if not feasible.met[0]:
        raise GoalError(problem.goal.names, float(np.abs(feasible.error).max()), "not met even with all inputs free")
    q, values, converged = feasible.q[0], [float(feasible.value[0])], False
    for stage in range(_STAGES):
        fixed = ~np.isin(owner, (stage + np.arange(free)) % count)
        found = solve(replace(problem, reduction=anchor(q, fixed, problem.reduction)), q, how)
        if found.met[0] and found.value[0] < values[-1]:
            q = found.q[0]
        values.append(min(values[-1], float(found.value[0])) if found.met[0] else values[-1])
        converged = stage >= count and values[-1 - count] - values[-1] <= _FALL * (1 + abs(values[-1]))
        if converged:
            break
    return Cycle(solve(problem, q, replace(how, most=0)), tuple(values), len(values) - 1, converged)
