"""Positioning an arm: goals, strokes, objective and order reduction put together for the batched method."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import GoalError, ObjectiveError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.curvature import lagrangian_curvature
from vgtsim.redundancy.goals import GoalSpace, evaluate
from vgtsim.redundancy.kernel import Kernel, State
from vgtsim.redundancy.newton import Found, Local, NewtonSettings, minimise
from vgtsim.redundancy.objectives import Configurations, Objective, StrokeBarrier, WeightedSum, block_diagonal
from vgtsim.redundancy.reduction import Reduction
from vgtsim.redundancy.strokes import StrokeBox, centre

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_NEAR = 0.1  # error of a start, m and rad, from which the way to the goal is gone first
_CLOSE = 1e-3  # error, m and rad, to which it is gone
_CACHED = 2**18  # numbers in the curvatures of the goals that are solved at a time: they stay in cache
_CHUNK = 256  # and the most goals


@dataclass(frozen=True)
class Positioning:
    """A batch of goals for one arm.

    Attributes:
        chain: The arm.
        box: Actuator lengths allowed: hard limits.
        goal: Rows.
        objective: What is made least in their null space.
        barrier: Weight of the stroke barrier beside the objective; it is what keeps optima off the ends of strokes.
        reduction: Order reduction, or absent.
    """

    chain: Chain
    box: StrokeBox
    goal: GoalSpace
    objective: Objective = field(default_factory=StrokeBarrier)
    barrier: float = 1e-3
    reduction: Reduction | None = None

    def inputs(self, z: Array) -> Array:
        """Inputs, shape (..., A, 3), of variables, shape (..., k)."""
        q = z if self.reduction is None else self.reduction.inputs(z)
        return q.reshape(*q.shape[:-1], -1, 3)

    def variables(self, q: Array) -> Array:
        """Variables, shape (..., k), of inputs, shape (..., A, 3)."""
        flat = q.reshape(*q.shape[:-2], -1)
        return flat if self.reduction is None else self.reduction.variables(flat)

    def local(self, z: Array, which: Index) -> Local:
        """Rows and objective about a batch of variables, shape (b, k), for goals of shape (b,)."""
        q = self.inputs(z)
        state = self.kernel.state(q)
        inside = state.assembles & (np.min(self.box.spare(state.length), axis=(1, 2)) > 0)
        if not np.all(inside):  # what stands in for the others is never looked at
            safe = self.kernel.state(self.middle[None])
            state = _either(inside, state, safe)
        error, J = evaluate(self.chain, self.goal, state, which)
        terms = self.guarded.terms(Configurations(self.chain, self.box, state.q, state.length, state.blocks, which))
        if not np.all(np.isfinite(terms.value)):
            raise ObjectiveError(self.objective.name, int(np.sum(~np.isfinite(terms.value))), "its value")
        curve = terms.dense if terms.blocks is None else block_diagonal(terms.blocks)
        if curve is None:
            curve = np.zeros((len(q), q[0].size, q[0].size))
        elif terms.blocks is not None and terms.dense is not None:
            curve += terms.dense
        if self.reduction is None:
            return Local(inside, error, J, terms.value, terms.slope, curve, terms.rough, terms.by_length)
        T = self.reduction.slope(z)
        Tt = np.swapaxes(T, 1, 2)
        rough = None if terms.rough is None else (Tt @ terms.rough[..., None])[..., 0]
        slope = (Tt @ terms.slope[..., None])[..., 0]
        return Local(inside, error, J @ T, terms.value, slope, Tt @ curve @ T, rough, terms.by_length)

    @cached_property
    def kernel(self) -> Kernel:
        """The arm, ready for batches."""
        return Kernel(self.chain)

    @cached_property
    def middle(self) -> Array:
        """Inputs with every actuator at mid-stroke, shape (A, 3)."""
        return centre(self.chain, self.box)

    @cached_property
    def guarded(self) -> Objective:
        """The objective with the stroke barrier beside it."""
        if isinstance(self.objective, StrokeBarrier) or self.barrier == 0:
            return self.objective
        return WeightedSum(((1.0, self.objective), (self.barrier, StrokeBarrier())))

    def bend(self, z: Array, which: Index, multipliers: Array, by_length: Array | None) -> Array:
        """Curvature that the local model leaves out, shape (b, k, k), for multipliers of shape (b, m)."""
        state = self.kernel.state(self.inputs(z))
        weights = np.zeros_like(state.q) if by_length is None else by_length
        found = lagrangian_curvature(self.kernel, self.goal, state, which, multipliers, weights)
        if self.reduction is None:
            return found
        T = self.reduction.slope(z)
        return np.swapaxes(T, 1, 2) @ found @ T


@dataclass(frozen=True)
class Positions:
    """Solutions of a batch of goals.

    Attributes:
        q: Inputs, shape (B, A, 3).
        error: Goal rows, shape (B, m), m and rad.
        value: Objective with the barrier, shape (B,).
        iterations: Shape (B,).
        met: Whether all rows are within tolerance, shape (B,).
        stationarity: Slope left in the null space, relative, shape (B,).
        promise: Fall of the objective still to be had by a null-space step, shape (B,).
        optimal: Whether `met` and the promise is below the setting, shape (B,).
    """

    q: Array
    error: Array
    value: Array
    iterations: NDArray[np.intp]
    met: NDArray[np.bool_]
    stationarity: Array
    promise: Array
    optimal: NDArray[np.bool_]


def solve(problem: Positioning, start: ArrayLike, settings: NewtonSettings | None = None) -> Positions:
    """Solve a batch of goals from given configurations by the null-space method.

    Goals that are far from their start are first met with the stroke barrier as objective, which keeps the way open,
    and then optimised; near ones are met and optimised at once.

    Args:
        problem: Goals, limits, objective.
        start: Inputs inside the strokes, shape (A, 3) for all goals or (B, A, 3).
        settings: How; the tolerance is that of the goal rows.

    Returns:
        The solutions, optimal or not; every iterate was inside the strokes.

    Raises:
        GoalError: There are more goal rows than variables.
        ObjectiveError: The objective is not finite.
        ValueError: A start is outside the strokes.

    Source: chapter 6. Differs: see `newton`.
    """
    how = settings or NewtonSettings()
    count = problem.goal.count
    q = np.broadcast_to(np.asarray(start, float), (count, *problem.chain.straight.shape))
    z = problem.variables(q)
    rows = len(problem.goal.names)
    if rows > z.shape[1]:
        detail = f"{rows} goal rows for {z.shape[1]} inputs that are left"
        raise GoalError(problem.goal.names, 0.0, detail)
    how = NewtonSettings(problem.goal.tolerance, how.optimality, how.most, how.turn, how.limit)
    if not isinstance(problem.objective, StrokeBarrier):
        z = _come_near(problem, z, how)
    parts: list[Found] = []
    chunk = min(_CHUNK, max(1, _CACHED // z.shape[1] ** 2))
    for first in range(0, count, chunk):
        which = np.arange(first, min(first + chunk, count))

        def local(z: Array, i: Index, which: Index = which) -> Local:
            return problem.local(z, which[i])

        def bend(z: Array, i: Index, y: Array, memo: Array | None, which: Index = which) -> Array:
            return problem.bend(z, which[i], y, memo)

        parts.append(minimise(local, z[which], how, bend))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    return Positions(
        problem.inputs(joined("z")),
        np.concatenate([part.local.error for part in parts]),
        np.concatenate([part.local.value for part in parts]),
        np.concatenate([part.iterations for part in parts]),
        np.concatenate([part.met for part in parts]),
        joined("stationarity"),
        joined("promise"),
        np.concatenate([part.optimal for part in parts]),
    )


def _come_near(problem: Positioning, z: Array, how: NewtonSettings) -> Array:
    """Variables from which every goal that can be met is near, shape (B, k)."""
    every = np.arange(len(z))
    plain = replace(problem, objective=StrokeBarrier())
    far = np.flatnonzero(np.linalg.norm(plain.local(z, every).error, axis=1) > _NEAR)
    if len(far):
        tolerances = NewtonSettings(_CLOSE, np.inf, how.most, how.turn, how.limit)
        z = np.array(z)
        z[far] = minimise(lambda at, i: plain.local(at, far[i]), z[far], tolerances).z
    return z


def assembles(chain: Chain, box: StrokeBox, q: Array) -> NDArray[np.bool_]:
    """Which configurations assemble inside the box, shape (b,), of inputs of shape (b, A, 3)."""
    state = Kernel(chain).state(q)
    return state.assembles & (np.min(box.spare(state.length), axis=(1, 2)) > 0)


def _either(inside: NDArray[np.bool_], state: State, other: State) -> State:
    """The one where a configuration is inside, the other elsewhere."""
    pairs = [(getattr(state, item.name), getattr(other, item.name)) for item in fields(State)]
    values: list[Any] = [np.where(inside.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs]
    return State(*values)
