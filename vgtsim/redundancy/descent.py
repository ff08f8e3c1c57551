"""The iteration behind the solver: goal rows by penalty and Newton, everything else in their null space.

Each step solves the damped least-squares problem

    min over s of  ½ sᵀ H s + gᵀ s + |J s + e|² / (2 kappa),

with g and H the slope and Gauss-Newton matrix of the objective, e the goal's error and J its Jacobian. As
kappa falls the goal rows become exact and the objective is left with their null space.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from vgtsim.redundancy.problem import Problem
from vgtsim.redundancy.strokes import lengths_inside

Array = NDArray[np.float64]

_KAPPAS = (1e-2, 1e-4, 1e-6)
_TURN = 0.15  # greatest change of u_x, u_y or d in one step: keeps the linear model honest
_DAMPING = 1e-3
_SETTLED = 1e-3  # a penalty is done when a step promises less than this part of the merit
_STUCK = 0.2  # goal error, m or rad, that the second penalty would not leave of a goal within reach


@dataclass(frozen=True)
class Iterate:
    """A configuration inside the strokes.

    Attributes:
        q: Inputs, shape (A, 3).
        error: Goal rows, shape (5,), m and rad.
        objective: What is made small in their null space.
    """

    q: Array
    error: Array
    objective: float

    def merit(self, kappa: float) -> float:
        """Objective with the penalty on the goal rows."""
        return self.objective + float(self.error @ self.error) / (2 * kappa)


def descend(problem: Problem, start: Array, most: int) -> tuple[Iterate, int]:
    """Descend from one configuration; every accepted iterate lies strictly inside the strokes.

    Args:
        problem: Goal, strokes and surroundings.
        start: Inputs inside the strokes, shape (A, 3).
        most: Greatest number of steps for each penalty.

    Returns:
        The last iterate, polished on the goal rows, and the number of steps.
    """
    at, count = evaluate(problem, start), 0
    for kappa in _KAPPAS:
        at, steps = _minimise(problem, at, kappa, most, _SETTLED)
        count += steps
        if kappa < _KAPPAS[0] and np.linalg.norm(at.error) > _STUCK:
            return at, count
    return _polish(problem, at), count


def nearest(problem: Problem, start: Array, most: int) -> Iterate:
    """The tool pose nearest to an unreachable goal, without regard to clearance.

    Args:
        problem: Goal and strokes.
        start: Inputs inside the strokes, shape (A, 3).
        most: Greatest number of steps for each penalty.

    Returns:
        Where the goal rows are least, a metre counting like a radian.
    """
    bare = replace(problem, surroundings=None, sideways=0.0)
    at = evaluate(bare, start)
    for kappa in _KAPPAS:
        at, _ = _minimise(bare, at, kappa, most, 1e-2 * _SETTLED)
    return at


def evaluate(problem: Problem, q: Array) -> Iterate:
    """Goal rows and objective of a configuration inside the strokes, shape (A, 3)."""
    return Iterate(q, problem.error(q), problem.objective(q, problem.chain.lengths(q)))


def _minimise(problem: Problem, at: Iterate, kappa: float, most: int, settled: float) -> tuple[Iterate, int]:
    """Damped steps at one penalty until no decrease is left, and their number."""
    damping = _DAMPING
    for count in range(most):
        J = problem.error_jacobian(at.q)
        g, H = problem.slopes(at.q)
        slope, matrix = g + J.T @ at.error / kappa, H + J.T @ J / kappa
        scale = np.diag(np.diag(matrix))
        for _ in range(12):
            step = -np.linalg.solve(matrix + damping * scale, slope)
            step *= min(1.0, _TURN / max(float(np.max(np.abs(step))), 1e-300))
            promise = -float(slope @ step + 0.5 * step @ matrix @ step)
            trial = _evaluate_inside(problem, at.q + step.reshape(at.q.shape))
            gain = at.merit(kappa) - trial.merit(kappa) if trial else -np.inf
            if trial and gain > 0.1 * promise:
                break
            damping *= 6
        else:
            return at, count
        damping = damping / 5 if gain > 0.6 * promise else damping
        at = trial
        if promise < settled * (1 + at.merit(kappa)):
            return at, count + 1
    return at, most


def _evaluate_inside(problem: Problem, q: Array) -> Iterate | None:
    length = lengths_inside(problem.chain, problem.box, q)
    return None if length is None else Iterate(q, problem.error(q), problem.objective(q, length))


def _polish(problem: Problem, at: Iterate) -> Iterate:
    """Newton on the goal rows alone, each step the least in the objective's metric, while it stays inside."""
    metric = problem.slopes(at.q)[1]
    metric = metric + 1e-9 * np.trace(metric) * np.eye(len(metric))
    for _ in range(8):
        size = np.linalg.norm(at.error)
        if not 1e-13 < size < _STUCK:
            break
        J = problem.error_jacobian(at.q)
        spread = np.linalg.solve(metric, J.T)
        shift = cast(Array, spread @ np.linalg.lstsq(J @ spread, -at.error, rcond=1e-12)[0])
        trial = _evaluate_inside(problem, at.q + shift.reshape(at.q.shape))
        if trial is None or not np.linalg.norm(trial.error) < size:
            break
        at = trial
    return at
