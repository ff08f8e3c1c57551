"""A batch of goals solved from given configurations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import GoalError
from vgtsim.positioning.newton import NewtonSettings, minimise
from vgtsim.positioning.objectives import StrokeBarrier
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.solution import Solution, join_solutions

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_NEAR = 0.1  # error of a start, m and rad, from which the way to the goal is gone first
_CLOSE = 1e-3  # error, m and rad, to which it is gone
_CACHED = 2**18  # numbers in the curvatures of the goals that are solved at a time: they stay in the processor's cache
_CHUNK = 256  # goals at a time, at most: beyond it a batch gains nothing more


def solve(problem: Problem, start: ArrayLike, settings: NewtonSettings | None = None) -> Solution:
    """Solve a batch of goals from inputs inside the strokes, shape (n,) for all goals or (B, n), in the null space.

    Goals far from their start are first met with the stroke barrier as objective, which keeps the way open, and then
    optimised. Near goals are met and optimised at once. Every iterate is inside the strokes. The tolerance of the
    settings is replaced by that of the goal rows.

    Raises:
        GoalError: There are more goal rows than variables.
        ObjectiveError: The objective is not finite.
        ValueError: A start is outside the strokes.

    Source: chapter 6. Differs: see `newton`.
    """
    count = problem.goal.count
    z = problem.variables(np.broadcast_to(np.asarray(start, float), (count, problem.chain.layout.inputs)))
    rows, free = len(problem.goal.names), z.shape[1] - len(problem.chain.layout.static)
    if rows > free:
        raise GoalError(problem.goal.names, 0.0, f"{rows} goal rows for {free} inputs that are left")
    how = replace(settings or NewtonSettings(), tolerance=problem.tolerance)
    if not isinstance(problem.objective, StrokeBarrier):
        z = _come_near(problem, z, how)
    chunk = min(_CHUNK, max(1, _CACHED // z.shape[1] ** 2))
    starts = range(0, count, chunk)
    whole = join_solutions([_solve_some(problem, z, np.arange(i, min(i + chunk, count)), how) for i in starts])
    return replace(whole, q=problem.inputs(whole.q), error=whole.error[:, :rows])


def _solve_some(problem: Problem, z: Array, which: Index, how: NewtonSettings) -> Solution:
    """Solve the goals that are solved at a time, from variables of all goals, shape (B, k)."""
    return minimise(
        lambda at, i: problem.model(at, which[i]),
        z[which],
        how,
        lambda at, i, y, by_length: problem.bend(at, which[i], y, by_length),
        (lambda at, i, value: problem.glance(at, which[i], value)) if problem.objective.dear else None,
    )


def _come_near(problem: Problem, z: Array, how: NewtonSettings) -> Array:
    """Variables from which every goal that can be met is near, shape (B, k)."""
    plain = replace(problem, objective=StrokeBarrier())
    far = np.flatnonzero(np.linalg.norm(plain.model(z, np.arange(len(z))).error, axis=1) > _NEAR)
    if len(far):
        z = np.array(z)
        coarse = replace(how, tolerance=_CLOSE, optimality=np.inf)
        z[far] = minimise(lambda at, i: plain.model(at, far[i]), z[far], coarse).q
    return z
