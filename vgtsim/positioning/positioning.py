"""Positioning an arm: goals, strokes, objective and order reduction put together for the batched method."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import GoalError, ObjectiveError
from vgtsim.kinematics.chain import Chain
from vgtsim.positioning.curvature import lagrangian_curvature
from vgtsim.positioning.goals import GoalSpace, evaluate
from vgtsim.positioning.hinges import hinge_curvature
from vgtsim.positioning.kernel import Kernel
from vgtsim.positioning.newton import Found, Local, NewtonSettings, minimise
from vgtsim.positioning.objectives import Configurations, Objective, StrokeBarrier, WeightedSum
from vgtsim.positioning.reduction import Reduction
from vgtsim.positioning.strokes import StrokeBox, centre, inside

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_NEAR = 0.1  # error of a start, m and rad, from which the way to the goal is gone first
_CLOSE = 1e-3  # error, m and rad, to which it is gone
_STATIC = 1e-10  # error of a static leg's length, m: a tenth of what the chain allows
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
        """Inputs, shape (..., n), of variables, shape (..., k)."""
        return z if self.reduction is None else self.reduction.inputs(z)

    def variables(self, q: Array) -> Array:
        """Variables, shape (..., k), of inputs, shape (..., n)."""
        return q if self.reduction is None else self.reduction.variables(q)

    @property
    def tolerance(self) -> Array:
        """Of all rows, those of the goal and then one for each static leg, shape (m + S,), m and rad."""
        return np.concatenate([self.goal.tolerance, np.full(len(self.kernel.static), _STATIC)])

    def local(self, z: Array, which: Index) -> Local:
        """Rows and objective about a batch of variables, shape (b, k), for goals of shape (b,)."""
        state = self.kernel.state(self.inputs(z))
        count = self.chain.layout.actuators
        spare = np.min(self.box.spare(state.legs[:, :count]), axis=1)
        good = state.assembles & (spare > 0)
        if not np.all(good):  # what stands in for the others is never looked at
            state = self.kernel.state(np.where(good[:, None], state.q, self.middle))
        error, J = evaluate(self.chain, self.goal, state, which)
        terms = self.guarded.terms(Configurations(self.kernel, self.box, state, which))
        if not np.all(np.isfinite(terms.value)):
            raise ObjectiveError(self.objective.name, int(np.sum(~np.isfinite(terms.value))), "its value")
        curve = terms.dense if terms.blocks is None else self.kernel.spread(terms.blocks)
        if curve is None:
            curve = np.zeros((*state.q.shape, state.q.shape[1]))
        elif terms.blocks is not None and terms.dense is not None:
            curve += terms.dense
        if len(self.kernel.static):
            rows = self.kernel.dense(state.blocks)[:, count:]
            error = np.concatenate([error, state.legs[:, count:] - self.kernel.static], axis=1)
            J = np.concatenate([J, rows], axis=1)
            # changes no step that keeps static legs their length, and without it nothing would curve across them
            curve = curve + self._stiff * np.swapaxes(rows, 1, 2) @ rows
        if self.reduction is None:
            return Local(good, error, J, terms.value, terms.slope, curve, terms.rough, terms.by_length)
        T = self.reduction.slope(z)
        Tt = np.swapaxes(T, 1, 2)
        rough = None if terms.rough is None else (Tt @ terms.rough[..., None])[..., 0]
        slope = (Tt @ terms.slope[..., None])[..., 0]
        return Local(good, error, J @ T, terms.value, slope, Tt @ curve @ T, rough, terms.by_length)

    @property
    def _stiff(self) -> float:
        """Curvature of the stroke barrier at mid-stroke, 1/m²."""
        return float(np.mean(8 / (self.box.greatest - self.box.least) ** 2))

    @cached_property
    def kernel(self) -> Kernel:
        """The arm, ready for batches."""
        return Kernel(self.chain)

    @cached_property
    def middle(self) -> Array:
        """Inputs with every actuator at mid-stroke, shape (n,)."""
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
        rows = len(self.goal.names)
        weights = np.zeros((len(z), self.chain.layout.actuators)) if by_length is None else by_length
        weights = np.concatenate([weights, multipliers[:, rows:]], axis=1)
        found = lagrangian_curvature(self.kernel, self.goal, state, which, multipliers[:, :rows], weights)
        found += hinge_curvature(self.objective, Configurations(self.kernel, self.box, state, which))
        if self.reduction is None:
            return found
        T = self.reduction.slope(z)
        return np.swapaxes(T, 1, 2) @ found @ T


@dataclass(frozen=True)
class Positions:
    """Solutions of a batch of goals.

    Attributes:
        q: Inputs, shape (B, n).
        error: Goal rows, shape (B, m), m and rad.
        value: Objective with the barrier, shape (B,).
        iterations: Shape (B,).
        met: Whether all rows are within tolerance, shape (B,).
        stationarity: Slope left in the null space, relative, shape (B,).
        promise: Fall of the objective still to be had by a null-space step, shape (B,).
        optimal: Whether `met`, the promise is below the setting and the curvature definite: a local minimum, shape (B,).
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
        start: Inputs inside the strokes, shape (n,) for all goals or (B, n).
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
    rows, free = len(problem.goal.names), z.shape[1] - len(problem.kernel.static)
    if rows > free:
        detail = f"{rows} goal rows for {free} inputs that are left"
        raise GoalError(problem.goal.names, 0.0, detail)
    how = NewtonSettings(problem.tolerance, how.optimality, how.most, how.turn, how.limit)
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
        np.concatenate([part.local.error[:, :rows] for part in parts]),
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
    """Which configurations assemble inside the box, shape (b,), of inputs of shape (b, n)."""
    return inside(Kernel(chain), box, q)
