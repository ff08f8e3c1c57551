"""The problem of positioning: a batch of goals for one arm, its strokes, objective and method, and what it keeps clear of."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.constants import Method
from vgtsim.errors import ObjectiveError
from vgtsim.kinematics import Chain, State
from vgtsim.positioning import rows
from vgtsim.positioning.course import STEP
from vgtsim.positioning.goals import GoalSpace, measure, tabulate
from vgtsim.positioning.newton import Course, Quadratic
from vgtsim.positioning.objectives import Configurations, Objective, StrokeBarrier, WeightedSum
from vgtsim.positioning.reduction import Reduction
from vgtsim.positioning.strokes import StrokeBox
from vgtsim.positioning.surroundings import Surroundings

_STATIC = 1e-10  # error of a static leg's length, m: a tenth of what the chain allows


@dataclass(frozen=True)
class Keep:
    """Surroundings and the clearance, m, that every configuration must keep from them."""

    surroundings: Surroundings
    clearance: float


@dataclass(frozen=True)
class Problem:
    """A batch of goals for one arm, with its strokes as hard limits.

    The objective is made least in the null space of the goal rows. The stroke barrier has the weight `barrier` beside
    it: it keeps optima off the ends of strokes. Method and surroundings are for `solve_by_method`: `solve` goes by the null
    space whatever the method, and looks at no surroundings.
    """

    box: StrokeBox
    goal: GoalSpace
    objective: Objective = field(default_factory=StrokeBarrier)
    barrier: float = 1e-3
    reduction: Reduction | None = None
    method: Method = Method.NULLSPACE
    keep: Keep | None = None

    @property
    def chain(self) -> Chain:
        """The arm."""
        return self.box.chain

    def inputs(self, z: Array) -> Array:
        """Inputs, shape (..., n), of variables, shape (..., k)."""
        return z if self.reduction is None else self.reduction.inputs(z)

    def variables(self, q: Array) -> Array:
        """Variables, shape (..., k), of inputs, shape (..., n)."""
        return q if self.reduction is None else self.reduction.variables(q)

    @property
    def tolerance(self) -> Array:
        """Of all rows, those of the goal and then one for each static leg, shape (m + S,), m and rad."""
        static = len(self.chain.layout.static)
        return np.concatenate([self.goal.tolerance, np.full(static, _STATIC)]) if static else self.goal.tolerance

    @cached_property
    def _table(self) -> rows.Table:
        return tabulate(self.chain, self.goal)

    @cached_property
    def course(self) -> Course | None:
        """What one compiled call needs to solve the goals; absent where it cannot, see `course`."""
        squares, body = self.objective.squares(self.box), self.box.body
        if squares is None or body is None or self.reduction is not None:
            return None
        weight, meant = squares
        if weight and not np.isfinite(meant).all():  # the general way names the objective
            return None
        weights = np.array([1.0 if isinstance(self.objective, StrokeBarrier) else self.barrier, weight])
        sizes = self.goal.width, self.chain.layout.inputs, len(self.box.least)
        return Course((self._table, tuple(body), weights, meant), sizes)

    @cached_property
    def guarded(self) -> Objective:
        """The objective with the stroke barrier beside it."""
        if isinstance(self.objective, StrokeBarrier) or self.barrier == 0:
            return self.objective
        return WeightedSum(((1.0, self.objective), (self.barrier, StrokeBarrier())))

    def model(self, z: Array, which: Index) -> Quadratic:
        """Rows and objective about variables, shape (b, k), for goals of shape (b,)."""
        good, at = self._at(z, which)
        error, J = self._rows(at)
        terms = self.guarded.terms(at)
        self._require_finite(terms.value)
        curve = np.zeros((*at.q.shape, at.q.shape[1])) if terms.curve is None else terms.curve
        if len(self.chain.layout.static):
            static = at.state.leg_slopes[:, len(self.box.least) :]
            J = np.concatenate([J, static], axis=1)
            # changes no step that keeps static legs their length, and without it nothing would curve across them
            stiff = float(np.mean(2 / self.box.half**2))  # as the stroke barrier at mid-stroke, 1/m²
            curve = curve + stiff * np.swapaxes(static, 1, 2) @ static
        slope, rough = terms.slope, terms.rough
        if self.reduction is not None:
            T = self.reduction.slope(z)
            Tt = np.swapaxes(T, 1, 2)
            J, curve, slope = J @ T, Tt @ curve @ T, (Tt @ slope[..., None])[..., 0]
            rough = None if rough is None else (Tt @ rough[..., None])[..., 0]
        return Quadratic(
            inside=good,
            error=error,
            J=J,
            value=terms.value,
            slope=slope,
            curve=curve,
            rough=rough,
            by_length=terms.by_length,
        )

    def glance(self, z: Array, which: Index, value: bool) -> tuple[Mask, Array, Array]:
        """Of `model` only `inside`, `error` and, where it is wanted, `value`."""
        good, at = self._at(z, which)
        values = self.guarded.values(at) if value else np.zeros(len(z))
        self._require_finite(values)
        return good, self._rows(at, slopes=False)[0], values

    def _at(self, z: Array, which: Index) -> tuple[Mask, Configurations]:
        """Which variables are inside all limits, shape (b,), and the configurations."""
        state = self.chain.state(self.inputs(z))
        at = Configurations(self.box, state, which)
        good = state.assembles & (at.strokes[0] > 0)
        if good.all():
            return good, at
        # mid-stroke stands in for the others, whose numbers are never used
        sound = self.chain.state(np.where(good[:, None], state.q, self.box.middle))
        return good, Configurations(self.box, sound, which)

    def _rows(self, at: Configurations, slopes: bool = True) -> tuple[Array, Array]:
        """Errors of the goal rows and then of static legs, shape (b, m + S), and the derivatives of the former."""
        error, J = measure(self._table, at.state, at.which, slopes)
        if len(self.chain.layout.static):
            error = np.concatenate([error, at.state.legs[:, len(self.box.least) :] - self.chain.layout.static], axis=1)
        return error, J

    def _require_finite(self, value: Array) -> None:
        if not np.all(np.isfinite(value)):
            raise ObjectiveError(self.objective.name, int(np.sum(~np.isfinite(value))), "its value")

    def curvature(self, z: Array, which: Index, multipliers: Array, by_length: Array | None) -> Array:
        """Curvature of the Lagrangian that the model leaves out, shape (b, k, k), for multipliers of shape (b, m)."""
        state = self.chain.state(self.inputs(z))
        count = len(self.goal.names)
        weights = np.zeros((len(z), len(self.box.least))) if by_length is None else by_length
        weights = np.concatenate([weights, multipliers[:, count:]], axis=1)
        found = lagrangian_curvature(self._table, state, which, multipliers[:, :count].copy(), weights)
        found += self.objective.curvature(Configurations(self.box, state, which))
        if self.reduction is None:
            return found
        T = self.reduction.slope(z)
        return np.swapaxes(T, 1, 2) @ found @ T


def lagrangian_curvature(
    table: rows.Table, state: State, which: Index, multipliers: Array, length_slope: Array
) -> Array:
    """Second derivative, shape (b, n, n), of goal rows and leg lengths, weighted: what Gauss and Newton leave out.

    Rows have weights of shape (b, m); lengths of shape (b, J), or (b, J + S) with static legs. Direction rows and turns
    are exact where they are met. Between two modules it is a closed form: an input i nearer the base turns the velocity
    v_j of an input j farther out, so it is omega_i x v_j. Within a module it is a difference of closed-form first
    derivatives, all modules moved at once.
    """
    owner, (batch, count) = state.chain.layout.owner, state.q.shape
    place = np.arange(count) - np.searchsorted(owner, owner)  # among the module's own inputs
    total, raw = np.zeros((2, batch, count, count))
    rows.curve_between(which, multipliers, owner, total, raw, table, state.motion)
    steps = STEP * (place == np.arange(place.max() + 1)[:, None])
    moved = state.chain.state((state.q + steps[:, None]).reshape(-1, count))
    first, there = (_gradient(table, at, multipliers, length_slope, which) for at in (state, moved))
    rows.curve_within(first, there.reshape(-1, batch, count), STEP, owner, place, raw, total)
    return total


def _gradient(table: rows.Table, state: State, multipliers: Array, length_slope: Array, which: Index) -> Array:
    """First derivative of the weighted rows and lengths by the inputs; goals, shape (b,), repeat along the batch."""
    times = len(state.q) // len(which)
    slope = state.pull(np.tile(length_slope, (times, 1)))
    rows.pull_rows(np.tile(which, times), np.tile(multipliers, (times, 1)), slope, table, state.motion)
    return slope
