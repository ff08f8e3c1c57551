"""One goal by one of the dissertation's methods, from several configurations at once: the only dispatch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.redundancy import Method
from vgtsim.positioning.anchoring import anchor_successively
from vgtsim.positioning.batch import solve
from vgtsim.positioning.goals import Direction, Position
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.shape import solve_shapes
from vgtsim.positioning.solution import Notes, Solution, join_solutions

Array = NDArray[np.float64]

_FREE = 3  # modules free at a time in successive anchoring: nine inputs for five goal rows


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
    free = min(_FREE, len(problem.chain.layout.names))
    stages = [0] * len(found.q)
    for i in np.flatnonzero(found.met):
        cycle = anchor_successively(problem, found.q[i], free, settings)
        stages[i] = cycle.stages
        found.put(np.array([i]), cycle.solution)
        found.iterations[i] = cycle.solution.iterations[0]
    return replace(found, notes=_column([{"stages": count} for count in stages]))


def _by_shape(problem: Problem) -> Solution:
    place, along = problem.goal.parts
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
