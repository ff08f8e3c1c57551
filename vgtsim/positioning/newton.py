"""The batched null-space method: Newton on the goal rows and on the objective within their null space, at once.

For every goal of a batch each iteration takes the step that solves

    min over s of  ½ sᵀ H s + gᵀ s   subject to   J s = -e,

with e the goal's error, J its Jacobian, g and H slope and curvature of the objective. It is the particular solution of
least curvature plus the best homogeneous one (end of section 6.3): the goal and the optimum are approached together.

Near a goal an iteration is one factorisation that serves several steps: after Newton's own step the same equations are
solved again for the error and slope found there (V. E. Shamanskii's method), as long as steps shrink fast.

Step control: a step changes no input by more than `turn`; it is cut to a third until the point is inside the strokes
and |e| times twice the multipliers' size plus the objective has fallen. Where a goal is met and stationary but the
curvature in the null space is not positive, the point is a saddle: the way goes on along the least curvature.

How well goal rows are conditioned is told at the end of this file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index, Mask
from vgtsim.positioning import descent, elimination
from vgtsim.positioning.course import pursue
from vgtsim.positioning.descent import Point, Rules, Ways
from vgtsim.positioning.solution import Solution

CONDITION_LIMIT = 1e5  # section 6.2.1: past it the smallest singular values are given up
_TURN = 0.15  # greatest change of a variable, rad or m, in one step


@dataclass(frozen=True)
class Quadratic:
    """Goal rows and objective about a batch of points.

    Attributes:
        inside: Whether a point is inside all hard limits, shape (b,); of a point outside nothing else counts.
        error: Shape (b, m), in units of the rows.
        J: Derivative of the error, shape (b, m, k).
        value: Objective, shape (b,).
        slope: Shape (b, k).
        curve: Known curvature, positive semidefinite, shape (b, k, k).
        rough: Part of the slope whose curvature is to be learned from its changes, shape (b, k), or absent.
        by_length: Derivative of the objective by the actuator lengths, shape (b, J), or absent.
    """

    inside: Mask
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array | None = None
    by_length: Array | None = None

    @property
    def point(self) -> Point:
        """All of it as compiled functions take it."""
        own = (getattr(self, item.name) for item in fields(self))
        parts: tuple[Any, ...] = tuple(np.empty((len(self.error), 0)) if part is None else stored(part) for part in own)
        return Point(*parts)


@dataclass(frozen=True)
class NewtonSettings:
    """How the iteration runs.

    Attributes:
        tolerance: Greatest error of each row, shape (m,), or one for all.
        optimality: Greatest fall of the objective that a null-space step may still promise, of 1 + |objective|.
        most: Greatest number of iterations.
    """

    tolerance: Array | float = 1e-9
    optimality: float = 1e-6
    most: int = 80


@dataclass(frozen=True)
class Course:
    """What one compiled call needs to solve goals of a plain problem, see `course`.

    Attributes:
        tables: Goal rows, body, weights and lengths, as `pursue` takes them.
        sizes: Numbers of goal rows, inputs and actuators.
    """

    tables: tuple[Any, ...]
    sizes: tuple[int, int, int]

    def make_room(self, count: int) -> Point:
        """Points that are not evaluated yet."""
        m, n, J = self.sizes
        return Point(
            inside=np.empty(count, bool),
            error=np.empty((count, m)),
            J=np.empty((count, m, n)),
            value=np.empty(count),
            slope=np.empty((count, n)),
            curve=np.empty((count, n, n)),
            rough=np.empty((count, 0)),
            by_length=np.empty((count, J)),
        )


Evaluate = Callable[[Array, Index], Quadratic]
Glance = Callable[[Array, Index, bool], tuple[Mask, Array, Array]]
Curvature = Callable[[Array, Index, Array, Array | None], Array]


def minimise(
    evaluate: Evaluate,
    start: Array,
    settings: NewtonSettings | None = None,
    curvature: Curvature | None = None,
    glance: Glance | None = None,
    dear: bool = False,
    course: Course | None = None,
    goals: Index | None = None,
) -> Solution:
    """Meet every goal of a batch from variables of shape (B, k), and make its objective least in the null space.

    Args:
        evaluate: From variables, shape (b, k), and their goals, shape (b,), to the quadratic model there.
        curvature: From variables, goals, multipliers of the goal rows, shape (b, m), and `by_length` to the curvature of the
            Lagrangian that the model leaves out, shape (b, k, k). It is worked out near a goal and kept for a few
            steps.
        glance: From variables, goals and whether values are wanted to `inside`, `error` and `value` alone: cheaper.
        dear: Whether slopes cost so much more than values that trial steps that have been cut, most of which are cut
            again, are judged by a glance.
        course: Of a plain problem: all but the way from a saddle is then one compiled call.
        goals: Number of each row's goal, shape (B,), by which the functions and the course know it; of the row when absent.

    Raises:
        ValueError: A start is outside the hard limits.
    """
    how, z, every = settings or NewtonSettings(), np.array(start, float, order="C"), np.arange(len(start))
    goals = every if goals is None else goals
    at = evaluate(z.copy(), goals).point if course is None else course.make_room(len(z))  # it is written to
    J, curve, by_length = at.J, at.curve, at.by_length
    rows, learns = J.shape[1], at.rough.shape[1] > 0
    bends = curvature is not None and not learns
    ways = _begin_ways(z, rows)
    factors = np.empty(curve.shape), np.empty(J.shape), np.empty((len(z), rows, rows))
    learned, bent = (np.zeros(curve.shape if wanted else (0, *curve.shape[1:])) for wanted in (learns, bends))
    rules = _make_rules(how, rows, dear=dear and glance is not None, bends=bends)
    kept = tuple(rules), tuple(ways), tuple(at), factors, (learned, bent)
    which, there = every, at
    while True:
        if course is None:
            descent.carry_all_on(which, tuple(there), *kept)
        else:
            pursue(which, goals, course.tables, *kept)
        if not at.inside.all():
            raise ValueError(f"start {int(np.argmin(at.inside))} is outside the strokes")
        pending = np.flatnonzero(ways.marks[:, descent.WANT])
        if not len(pending):
            return _conclude(at, ways, rules)
        wants = ways.marks[pending, descent.WANT]
        want = wants.max()
        which = pending if wants.min() == want else pending[wants == want]
        if want == descent.BEND:
            assert curvature is not None
            bent[which] = curvature(
                z[which], goals[which], ways.y[which], by_length[which] if by_length.shape[1] else None
            )
        elif want == descent.DOWNHILL:
            ways.step[which] = downhill(curve[which] + bent[which], J[which], at.slope[which])
        elif want == descent.MODEL or glance is None:
            there = evaluate(ways.trial[which], goals[which]).point
        else:
            inside, error_there, values = glance(ways.trial[which], goals[which], want == descent.GLANCE)
            there = at._replace(inside=stored(inside), error=stored(error_there), value=stored(values))


def _conclude(at: Point, ways: Ways, rules: Rules) -> Solution:
    """The solution of goals that have all come to an end."""
    stationarity, met = np.empty(len(ways.z)), np.empty(len(ways.z), bool)
    elimination.judge_goals(at.J, at.slope, at.error, rules.limit, rules.tolerance, stationarity, met)
    return Solution(
        q=ways.z,
        error=at.error,
        value=at.value,
        iterations=ways.marks[:, descent.MOVES].copy(),
        met=met,
        stationarity=stationarity,
        optimal=ways.marks[:, descent.OPTIMAL] > 0,
    )


def _make_rules(how: NewtonSettings, rows: int, *, dear: bool, bends: bool) -> Rules:
    return Rules(
        tolerance=np.full(rows, how.tolerance),
        optimality=float(how.optimality),
        most=int(how.most),
        turn=_TURN,
        limit=CONDITION_LIMIT,
        dear=dear,
        bends=bends,
    )


def _begin_ways(z: Array, rows: int) -> Ways:
    """Ways of goals that are not begun yet, from variables z, shape (B, k), see `descent`."""
    marks, numbers = np.zeros((len(z), descent.DONE + 1), np.intp), np.zeros((len(z), descent.SIZE + 1))
    marks[:, descent.AGE], marks[:, descent.DEFINITE] = descent.KEPT, 1
    numbers[:, descent.PROMISE] = np.inf
    trial, step, main = (np.empty(z.shape) for _ in range(3))
    return Ways(marks=marks, numbers=numbers, z=z, trial=trial, step=step, main=main, y=np.empty((len(z), rows)))


def downhill(W: Array, J: Array, slope: Array) -> Array:
    """Directions, shape (b, k), of least curvature in the null space of J, along which the objective does not rise.

    W, shape (b, k, k), is not positive there; J has shape (b, m, k), the slope (b, k). The greatest change of a
    variable is 1.
    """
    keep = np.eye(W.shape[1]) - np.linalg.pinv(J) @ J
    direction = np.linalg.eigh(keep @ W @ keep)[1][:, :, 0]  # the rows' own directions have the eigenvalue zero
    rise = np.sum(slope * direction, axis=1)
    scale = np.where(rise > 0, -1.0, 1.0) / np.max(np.abs(direction), axis=1)
    return direction * scale[:, None]


def stored(array: NDArray[Any]) -> NDArray[Any]:
    """The array, or a copy of it that is stored by rows and may be written to."""
    return array if array.flags.c_contiguous and array.flags.writeable else np.array(array, order="C")


def condition_numbers(jacobian: ArrayLike) -> Array:
    """Greatest over least singular value (6.32), shape (...), of Jacobians (..., m, n); infinite below rank m."""
    values = np.linalg.svd(np.asarray(jacobian, float), compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(values[..., -1] > 0, values[..., 0] / values[..., -1], inf)


def lost_directions(jacobian: ArrayLike, names: tuple[str, ...], limit: float = CONDITION_LIMIT) -> tuple[str, ...]:
    """Goal directions that a configuration cannot follow, from a Jacobian of shape (m, n) and the names of its rows.

    Singular values below the greatest over `limit` are given up; each direction is named by the rows that it
    consists of.
    """
    U, values, _ = np.linalg.svd(np.asarray(jacobian, float))
    rank = int(np.sum(values > values[0] / limit))
    return tuple(name_direction(column, names) for column in U[:, rank:].T)


def name_direction(direction: Array, labels: tuple[str, ...]) -> str:
    """The rows that a direction consists of, the greatest part first."""
    order = np.argsort(-np.abs(direction), kind="stable")
    parts = [(direction[i], labels[i]) for i in order if abs(direction[i]) >= 0.1]
    if len(parts) == 1:
        return parts[0][1]
    return " ".join(f"{share:+.2f} {label}" for share, label in parts)
