"""Goals solved from given configurations: in the null space of the whole arm, or window by window (sections 6.3 and 7.2.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.errors import GoalError
from vgtsim.positioning.newton import NewtonSettings, minimise
from vgtsim.positioning.objectives import StrokeBarrier
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.reduction import anchor
from vgtsim.positioning.solution import Solution, join_solutions, make_column

ANCHOR_FREE = 3  # modules free at a time in successive anchoring: nine inputs for five goal rows
_FALL = 1e-9  # of the objective in a whole cycle, of 1 + |objective|, that is not worth another cycle
_STAGES = 200  # at most, of one goal
_NEAR = 0.1  # error of a start, m and rad, from which the way to the goal is gone first
_CLOSE = 1e-3  # error, m and rad, to which it is gone
_CACHED = 2**18  # numbers in the curvatures of the goals that are solved at a time: they stay in the processor's cache
_CHUNK = 256  # goals at a time, at most: beyond it a batch gains nothing more


def solve(problem: Problem, start: ArrayLike, settings: NewtonSettings | None = None) -> Solution:
    """Solve a batch of goals in the null space from inputs inside the strokes, shape (n,) for all goals or (B, n).

    A single goal is solved from each of several starts. Goals far from their start are first met with the stroke barrier as
    objective, which keeps the way open, and then optimised. Near goals are met and optimised at once. Every iterate is inside
    the strokes. The tolerance of the settings is replaced by that of the goal rows.

    Raises:
        GoalError: There are more goal rows than variables.
        ObjectiveError: The objective is not finite.
        ValueError: A start is outside the strokes.

    Source: chapter 6. Differs: see `newton`.
    """
    count = max(problem.goal.count, len(np.atleast_2d(start)))
    q = np.empty((count, problem.chain.layout.inputs))
    q[:] = start
    z = problem.variables(q)
    width, free = problem.goal.width, z.shape[1] - len(problem.chain.layout.static)
    if width > free:
        raise GoalError(problem.goal.names, 0.0, f"{width} goal rows for {free} inputs that are left")
    how = replace(settings or NewtonSettings(), tolerance=problem.tolerance)
    if not isinstance(problem.objective, StrokeBarrier):
        z = _come_near(problem, z, how)
    chunk, parts = min(_CHUNK, max(1, _CACHED // z.shape[1] ** 2)), []
    for i in range(0, count, chunk):
        goals = np.arange(i, min(i + chunk, count))
        found = minimise(
            problem.model,
            z[goals],
            how,
            goals=goals,
            curvature=problem.curvature,
            glance=problem.glance,
            dear=problem.objective.dear,
            course=problem.course,
        )
        parts.append(found)
    whole = parts[0] if len(parts) == 1 else join_solutions(parts)
    if problem.course is not None:
        return whole
    return replace(whole, q=problem.inputs(whole.q), error=whole.error[:, :width])


def _come_near(problem: Problem, z: Array, how: NewtonSettings) -> Array:
    """Variables from which every goal that can be met is near, shape (B, k)."""
    plain = replace(problem, objective=StrokeBarrier())
    far = np.flatnonzero(np.linalg.norm(plain.model(z, np.arange(len(z))).error, axis=1) > _NEAR)
    if len(far):
        z = np.array(z)
        coarse = replace(how, tolerance=_CLOSE, optimality=np.inf)
        z[far] = minimise(plain.model, z[far], coarse, goals=far).q
    return z


def solve_anchored(problem: Problem, starts: Array, settings: NewtonSettings) -> Solution:
    """Solve one goal from each of several starts, shape (S, n), by successive anchoring from where it is met first.

    Raises:
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.
    """
    found = solve(problem, starts, replace(settings, optimality=np.inf))
    free = min(ANCHOR_FREE, int(_find_groups(problem).max()) + 1)
    stages = [0] * len(found.q)
    for i in np.flatnonzero(found.met):
        last = anchor_successively(problem, found.q[i], free, settings)
        stages[i] = last.notes["stages"]
        found.put(np.array([i]), last)
        found.iterations[i] = last.iterations[0]
    return replace(found, notes=make_column([{"stages": count} for count in stages]))


def _find_groups(problem: Problem) -> Index:
    """Number of each input's module, or group of coupled modules, shape (n,)."""
    owner = problem.chain.layout.owner
    return owner if problem.reduction is None else problem.reduction.gather(owner)


def anchor_successively(
    problem: Problem, start: ArrayLike, free: int, settings: NewtonSettings | None = None
) -> Solution:
    """Solve one goal from inputs of shape (n,) with a moving window of `free` modules until no window improves it.

    Modules that the problem couples count as one, and stay coupled in every stage. The end is stationary in every window, and
    in the whole arm when the windows' null spaces together span that of the arm.

    The solution is a batch of one, and its notes are the number of `stages`. From stage to stage the objective never rises.

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
    q, values = feasible.q[0], [float(feasible.value[0])]  # after each stage
    for stage in range(_STAGES):
        fixed = ~np.isin(owner, (stage + np.arange(free)) % count)
        found = solve(replace(problem, reduction=anchor(q, fixed, problem.reduction)), q, how)
        better = found.met[0] and found.value[0] < values[-1]
        q = found.q[0] if better else q
        values.append(float(found.value[0]) if better else values[-1])
        if stage >= count and values[-1 - count] - values[-1] <= _FALL * (1 + abs(values[-1])):
            break
    return replace(solve(problem, q, replace(how, most=0)), notes={"stages": len(values) - 1})
