"""The iteration behind the solver: goal rows by penalty and Newton, everything else in their null space.

Each step solves the damped least-squares problem

    min over s of  ½ sᵀ H s + gᵀ s + |J s + e|² / (2 kappa),

with g and H the slope and Gauss-Newton matrix of the objective (stroke barrier and clearance hinges), e the goal's
error and J its Jacobian. As kappa falls the goal rows become exact and the objective is left with their null space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.strokes import StrokeBox, lengths_inside
from vgtsim.redundancy.surroundings import Surroundings

Array = NDArray[np.float64]

_KAPPAS = (1e-2, 1e-4, 1e-6)
_TURN = 0.15  # greatest change of u_x, u_y or d in one step: keeps the linear model honest
_HINGE_WEIGHT = 100.0  # against the barrier's, whose slope at 2 cm from the end of a stroke is 50 per metre


@dataclass(frozen=True)
class Problem:
    """What one descent works on.

    Attributes:
        chain: The arm.
        box: Actuator lengths allowed.
        position: Tool position wanted, in frame G, shape (3,), m.
        direction: Tool direction wanted, in frame G, shape (3,), unit.
        surroundings: What to keep clear of, or None.
        clearance: Clearance wanted, m.
        softness: Width over which the clearance hinge rises before the wanted clearance is reached, m.
    """

    chain: Chain
    box: StrokeBox
    position: Array
    direction: Array
    surroundings: Surroundings | None
    clearance: float
    softness: float

    def error(self, q: Array) -> Array:
        """Goal rows: position error, m, and direction error, rad, shape (5,).

        The direction rows are 2 tan(theta/2) along two axes across the wanted direction: theta to third order, and
        growing up to the opposite direction.
        """
        position, direction = self.chain.tool(q)
        across = self.axes @ direction
        turn = 2 * across / max(1 + self.direction @ direction, 1e-6)
        return np.concatenate([position - self.position, turn])

    def error_jacobian(self, q: Array) -> Array:
        """Derivative of the goal rows, shape (5, 3 A)."""
        direction = self.chain.tool(q)[1]
        J = self.chain.jacobian(q)
        rate = np.cross(J[3:].T, direction).T
        scale = max(1 + self.direction @ direction, 1e-6)
        turn = 2 * (self.axes @ rate) / scale
        turn -= 2 * np.outer(self.axes @ direction, self.direction @ rate) / scale**2
        return np.concatenate([J[:3], turn])

    @property
    def axes(self) -> Array:
        """Two unit vectors across the wanted direction, shape (2, 3)."""
        helper = np.eye(3)[np.argmin(np.abs(self.direction))]
        first = np.cross(self.direction, helper)
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(self.direction, first)])

    def objective(self, q: Array, length: Array) -> float:
        """Stroke barrier plus clearance hinges."""
        value = float(self.box.barrier(length))
        if self.surroundings is not None:
            rows = self.surroundings.rows(q[None], self.clearance + self.softness, slopes=False)
            value += 0.5 * _HINGE_WEIGHT * float(np.sum(((self.clearance - rows.gap) / self.softness + 1) ** 2))
        return value

    def slopes(self, q: Array) -> tuple[Array, Array]:
        """Slope, shape (3 A,), and Gauss-Newton matrix, shape (3 A, 3 A), of the objective."""
        length, blocks = self.chain.length_jacobian(q)
        first, second = self.box.slopes(length)
        size, count = q.size, len(q)
        g = np.einsum("aij,ai->aj", blocks, first).ravel()
        H = np.zeros((count, 3, count, 3))
        diagonal = np.arange(count)
        H[diagonal, :, diagonal, :] = np.einsum("aij,ai,aik->ajk", blocks, second, blocks)
        H = H.reshape(size, size)
        if self.surroundings is not None:
            rows = self.surroundings.rows(q[None], self.clearance + self.softness)
            excess = (self.clearance - rows.gap) / self.softness + 1
            g = g - _HINGE_WEIGHT / self.softness * excess @ rows.gradient
            H = H + _HINGE_WEIGHT / self.softness**2 * rows.gradient.T @ rows.gradient
        return g, H


@dataclass(frozen=True)
class Descent:
    """Where a descent ended.

    Attributes:
        q: Inputs, shape (A, 3).
        error: Goal rows left, shape (5,), m and rad.
        objective: Barrier and hinges there.
        iterations: Steps taken.
    """

    q: Array
    error: Array
    objective: float
    iterations: int


def descend(problem: Problem, start: Array, most: int, settle: float = 1e-3) -> Descent:
    """Descend from one configuration; every accepted iterate lies strictly inside the strokes.

    Args:
        problem: Goal, strokes and surroundings.
        start: Inputs inside the strokes, shape (A, 3).
        most: Greatest number of steps for each penalty.
        settle: A penalty is done when a step promises less than this decrease of the merit, relatively.

    Returns:
        The last iterate, polished on the goal rows.
    """
    q, count = np.array(start, float), 0
    for kappa in _KAPPAS:
        damping = 1e-3
        for _ in range(most):
            count += 1
            trial, promise, value, damping = _step(problem, q, kappa, damping)
            if trial is None:
                break
            q = trial
            if promise < settle * (1 + value):
                break
        if kappa == _KAPPAS[1] and np.linalg.norm(problem.error(q)) > 0.2:
            break  # the penalty is a thousand times the objective's slope by now: the goal is out of reach from here
    q, polish = _polish(problem, q)
    length = problem.chain.lengths(q)
    return Descent(q, problem.error(q), problem.objective(q, length), count + polish)


def _step(problem: Problem, q: Array, kappa: float, damping: float) -> tuple[Array | None, float, float, float]:
    """One damped step: the new inputs (None when no decrease is left), the decrease promised, merit, next damping."""
    e, J = problem.error(q), problem.error_jacobian(q)
    g, H = problem.slopes(q)
    slope = g + J.T @ e / kappa
    matrix = H + J.T @ J / kappa
    merit = problem.objective(q, problem.chain.lengths(q)) + e @ e / (2 * kappa)
    for _ in range(12):
        step = -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), slope)
        step = step.reshape(q.shape) * min(1.0, _TURN / max(float(np.max(np.abs(step))), 1e-300))
        promise = -float(slope @ step.ravel() + 0.5 * step.ravel() @ matrix @ step.ravel())
        trial = q + step
        length = lengths_inside(problem.chain, problem.box, trial)
        if length is not None:
            error = problem.error(trial)
            gain = merit - problem.objective(trial, length) - error @ error / (2 * kappa)
            if gain > 0.1 * promise:
                return trial, promise, merit, damping / 5 if gain > 0.6 * promise else damping
        damping *= 6
    return None, 0.0, merit, damping


def _polish(problem: Problem, q: Array) -> tuple[Array, int]:
    """Newton on the goal rows alone, each step the least in the metric of the objective, while it stays inside."""
    metric = problem.slopes(q)[1]
    metric = metric + 1e-9 * np.trace(metric) * np.eye(len(metric))
    error = problem.error(q)
    for count in range(8):
        size = np.linalg.norm(error)
        if size < 1e-13 or size > 0.05:
            return q, count
        J = problem.error_jacobian(q)
        spread = np.linalg.solve(metric, J.T)
        shift = spread @ np.linalg.lstsq(J @ spread, -error, rcond=1e-12)[0]
        trial = q + shift.reshape(q.shape)
        if lengths_inside(problem.chain, problem.box, trial) is None:
            return q, count
        after = problem.error(trial)
        if not np.linalg.norm(after) < size:
            return q, count
        q, error = trial, after
    return q, 8


def nearest(problem: Problem, start: Array, most: int) -> Descent:
    """The tool pose nearest to an unreachable goal, without regard to clearance.

    Args:
        problem: Goal and strokes.
        start: Inputs inside the strokes, shape (A, 3).
        most: Greatest number of steps for each penalty.

    Returns:
        Where the goal rows are least, a metre counting like a radian.
    """
    bare = Problem(problem.chain, problem.box, problem.position, problem.direction, None, 0.0, 1.0)
    q, count = np.array(start, float), 0
    for kappa in (1e-2, 1e-4, 1e-6):
        damping = 1e-3
        for _ in range(most):
            trial, promise, value, damping = _step(bare, q, kappa, damping)
            if trial is None:
                break
            q, count = trial, count + 1
            if promise < 1e-5 * (1 + value):
                break
    return Descent(q, bare.error(q), bare.objective(q, bare.chain.lengths(q)), count)
