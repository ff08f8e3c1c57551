"""Successive anchoring: the optimum of the whole arm by a cycle of optima with most inputs held (section 7.2.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import GoalError
from vgtsim.positioning.batch import solve
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.reduction import anchor
from vgtsim.positioning.solution import Solution

Array = NDArray[np.float64]


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


def anchor_successively(
    problem: Problem,
    start: ArrayLike,
    free: int,
    settings: NewtonSettings | None = None,
    fall: float = 1e-9,
    most: int = 200,
) -> Cycle:
    """Solve one goal from inputs of shape (n,) with a moving window of `free` modules until no window improves it.

    The end is stationary in every window, and in the whole arm when the windows' null spaces together span that of the
    arm. Stages end when a whole cycle lowers the objective by less than `fall` of 1 + |objective|, or after `most`
    stages.

    Raises:
        GoalError: The free inputs are not more than the goal rows, or the goal is not met even with all inputs free.

    Source: section 7.2.1.
    """
    rows, owner = len(problem.tolerance), problem.chain.layout.owner
    count = int(owner.max()) + 1
    fewest = min(int(np.isin(owner, (k + np.arange(free)) % count).sum()) for k in range(count))
    if not rows < fewest or free > count:
        raise GoalError(problem.goal.names, 0.0, f"{rows} goal rows for {fewest} free inputs of {len(owner)}")
    how = settings or NewtonSettings()
    whole = replace(problem, reduction=None)
    feasible = solve(whole, start, replace(how, optimality=np.inf))  # any solution will do to begin with
    if not feasible.met[0]:
        raise GoalError(problem.goal.names, float(np.abs(feasible.error).max()), "not met even with all inputs free")
    q, values, converged = feasible.q[0], [float(feasible.value[0])], False
    for stage in range(most):
        fixed = ~np.isin(owner, (stage + np.arange(free)) % count)
        found = solve(replace(problem, reduction=anchor(q, fixed)), q, how)
        if found.met[0] and found.value[0] < values[-1]:
            q = found.q[0]
        values.append(min(values[-1], float(found.value[0])) if found.met[0] else values[-1])
        converged = stage >= count and values[-1 - count] - values[-1] <= fall * (1 + abs(values[-1]))
        if converged:
            break
    return Cycle(solve(whole, q, replace(how, most=0)), tuple(values), len(values) - 1, converged)
