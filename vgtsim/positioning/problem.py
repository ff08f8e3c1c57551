"""The problem of positioning: a batch of goals for one arm, its strokes, an objective and perhaps fewer variables."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import ObjectiveError
from vgtsim.kinematics import Chain
from vgtsim.positioning.curvature import lagrangian_curvature
from vgtsim.positioning.goals import GoalSpace, evaluate
from vgtsim.positioning.kkt import Quadratic
from vgtsim.positioning.objectives import Configurations, Objective, StrokeBarrier, Terms, WeightedSum
from vgtsim.positioning.reduction import Reduction
from vgtsim.positioning.strokes import StrokeBox

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_STATIC = 1e-10  # error of a static leg's length, m: a tenth of what the chain allows


@dataclass(frozen=True)
class Problem:
    """A batch of goals for one arm, with its strokes as hard limits.

    The objective is made least in the null space of the goal rows. The stroke barrier has the weight `barrier` beside
    it: it keeps optima off the ends of strokes.
    """

    box: StrokeBox
    goal: GoalSpace
    objective: Objective = field(default_factory=StrokeBarrier)
    barrier: float = 1e-3
    reduction: Reduction | None = None

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
        return np.concatenate([self.goal.tolerance, np.full(len(self.chain.layout.static), _STATIC)])

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
        curve = self._known_curvature(at, terms)
        if len(self.chain.layout.static):
            rows = at.state.leg_slopes[:, len(self.box.least) :]
            J = np.concatenate([J, rows], axis=1)
            # changes no step that keeps static legs their length, and without it nothing would curve across them
            curve = curve + self._stiff * np.swapaxes(rows, 1, 2) @ rows
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
        return good, self._rows(at)[0], values

    def _at(self, z: Array, which: Index) -> tuple[Mask, Configurations]:
        """Which variables are inside all limits, shape (b,), and the configurations."""
        state = self.chain.state(self.inputs(z))
        good = state.assembles & (np.min(self.box.spare(self.box.lengths(state.legs)), axis=1) > 0)
        if not np.all(good):  # mid-stroke stands in for the others, whose numbers are never used
            state = self.chain.state(np.where(good[:, None], state.q, self.box.middle))
        return good, Configurations(self.box, state, which)

    def _rows(self, at: Configurations) -> tuple[Array, Array]:
        """Errors of the goal rows and then of static legs, shape (b, m + S), and the derivatives of the former."""
        error, J = evaluate(self.chain, self.goal, at.state, at.which)
        if len(self.chain.layout.static):
            error = np.concatenate([error, at.state.legs[:, len(self.box.least) :] - self.chain.layout.static], axis=1)
        return error, J

    def _require_finite(self, value: Array) -> None:
        if not np.all(np.isfinite(value)):
            raise ObjectiveError(self.objective.name, int(np.sum(~np.isfinite(value))), "its value")

    def _known_curvature(self, at: Configurations, terms: Terms) -> Array:
        """Curvature of the objective, shape (b, n, n)."""
        if terms.blocks is None:
            return np.zeros((*at.q.shape, at.q.shape[1])) if terms.dense is None else terms.dense
        curve = at.state.spread(terms.blocks)
        if terms.dense is not None:
            curve += terms.dense
        return curve

    @property
    def _stiff(self) -> float:
        """Curvature of the stroke barrier at mid-stroke, 1/m²."""
        return float(np.mean(2 / self.box.half**2))

    def bend(self, z: Array, which: Index, multipliers: Array, by_length: Array | None) -> Array:
        """Curvature of the Lagrangian that the model leaves out, shape (b, k, k), for multipliers of shape (b, m)."""
        state = self.chain.state(self.inputs(z))
        rows = len(self.goal.names)
        weights = np.zeros((len(z), len(self.box.least))) if by_length is None else by_length
        weights = np.concatenate([weights, multipliers[:, rows:]], axis=1)
        found = lagrangian_curvature(self.goal, state, which, multipliers[:, :rows], weights)
        found += self.objective.bend(Configurations(self.box, state, which))
        if self.reduction is None:
            return found
        T = self.reduction.slope(z)
        return np.swapaxes(T, 1, 2) @ found @ T
