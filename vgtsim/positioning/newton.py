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
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vgtsim.positioning.kkt import (
    CONDITION_LIMIT,
    Equations,
    Quadratic,
    downhill,
    factorise,
    least_multipliers,
    restoring,
    solve_equations,
    stationarity,
)
from vgtsim.positioning.solution import Solution

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_FULL = 0.02  # steps below this may raise the merit while the goal's error falls to a quarter: no crawling along curves
_SLIGHT = 1e-5  # error, m or rad, that such a step may also leave
_NEAR = 0.05  # error, m and rad, below which the whole curvature is worth its price
_PENALTY = 30.0  # weight of JᵀJ beside the curvature, by their traces
_KEPT = 4  # iterations for which it is kept
_CUTS = 9  # thirds: steps shorter than 5e-5 of the full one are not tried
_AGAIN = 4  # steps that one factorisation may serve after its own
_SHRINKS = 0.2  # a step longer than this part of the last wants new factors
_ESCAPE = 0.1  # greatest change of a variable on the way from a saddle
_WAYS = 4  # thirds of it that are tried
_RESTORED = 2  # corrections of the goal rows on a long step


@dataclass(frozen=True)
class NewtonSettings:
    """How the iteration runs.

    Attributes:
        tolerance: Greatest error of each row, shape (m,), or one for all.
        optimality: Greatest fall of the objective that a null-space step may still promise, of 1 + |objective|.
        most: Greatest number of iterations.
        turn: Greatest change of a variable in one step.
        limit: Condition number past which goal directions are given up.
    """

    tolerance: Array | float = 1e-9
    optimality: float = 1e-6
    most: int = 80
    turn: float = 0.15
    limit: float = CONDITION_LIMIT


Evaluate = Callable[[Array, Index], Quadratic]
Glance = Callable[[Array, Index, bool], tuple[Mask, Array, Array]]
Bend = Callable[[Array, Index, Array, Array | None], Array]


def minimise(
    evaluate: Evaluate,
    start: Array,
    settings: NewtonSettings | None = None,
    bend: Bend | None = None,
    glance: Glance | None = None,
) -> Solution:
    """Meet every goal of a batch from variables of shape (B, k), and make its objective least in the null space.

    Args:
        evaluate: From variables, shape (b, k), and their goals, shape (b,), to the quadratic model there.
        bend: From variables, goals, multipliers of the goal rows, shape (b, m), and `by_length` to the curvature of the
            Lagrangian that the model leaves out, shape (b, k, k). It is worked out near a goal and kept for a few
            steps.
        glance: From variables, goals and whether values are wanted to `inside`, `error` and `value` alone: cheaper, for
            trial steps that have been cut, most of which are cut again.

    Raises:
        ValueError: A start is outside the hard limits.
    """
    how = settings or NewtonSettings()
    batch = _begin(how, evaluate, glance, bend, start)
    active = np.arange(len(start))
    for count in range(how.most + 1):
        now = batch.at.take(active)
        equations, penalty = _equations(batch, now, active)
        every = np.arange(len(active))
        step, multipliers, batch.promise[active] = solve_equations(equations, every, now.slope, now.error)
        batch.y[active] = multipliers - penalty[:, None] * now.error
        done = _settle(batch, active, now)
        if count == how.most:
            break
        step, size = _bounded(step, how.turn), np.linalg.norm(multipliers, axis=1)
        moved, shift = _escape(batch, active, now, equations), np.zeros_like(step)
        go = ~done & ~moved
        near = np.linalg.norm(now.error, axis=1) < _NEAR
        long = go & near & (np.max(np.abs(step), axis=1) > _FULL)
        for which, restore in ((go & ~long, None), (long, restoring(equations, long))):
            moved[which], shift[which] = _search(batch, active[which], step[which], size[which], restore=restore)
        if batch.learned is not None:
            _learn(batch, now.take(go), active[go], shift[go])
        batch.iterations[active[moved]] += 1
        again = np.flatnonzero(go & ~long & moved & (penalty > 0))
        settled = _go_on(batch, active, again, step[again], equations, penalty)
        active = np.setdiff1d(active[moved], settled)
        if not len(active):
            break
    return Solution(
        q=batch.z,
        error=batch.at.error,
        value=batch.at.value,
        iterations=batch.iterations,
        met=_met(batch.at, how),
        stationarity=stationarity(batch.at),
        promise=batch.promise,
        optimal=batch.optimal,
    )


@dataclass(frozen=True)
class _Batch:
    """The problem and the state of all goals, changed in place.

    `z` are the variables, shape (B, k), and `at` the model there; `y` are the multipliers of the goal rows, shape (B,
    m). `learned` is curvature learned from changes of the slope, and `bent` the curvature that the model leaves out,
    shape (B, k, k) or absent; `age` is the number of iterations for which `bent` has been kept, shape (B,).
    """

    how: NewtonSettings
    model: Evaluate
    brief: Glance | None
    bend: Bend | None
    z: Array
    at: Quadratic
    y: Array
    iterations: Index
    promise: Array
    definite: Mask
    optimal: Mask
    learned: Array | None
    bent: Array | None
    age: Index

    def glance(self, z: Array, which: Index, value: bool = True) -> tuple[Mask, Array, Array]:
        """`inside`, `error` and, where it is wanted, `value` about some points."""
        if self.brief is not None:
            return self.brief(z, which, value)
        at = self.model(z, which)
        return at.inside, at.error, at.value


def _begin(how: NewtonSettings, model: Evaluate, brief: Glance | None, bend: Bend | None, start: Array) -> _Batch:
    count = len(start)
    z = np.array(start, float)
    at = model(z, np.arange(count))
    if not np.all(at.inside):
        raise ValueError(f"start {int(np.argmin(at.inside))} is outside the strokes")
    return _Batch(
        how=how,
        model=model,
        brief=brief,
        bend=bend,
        z=z,
        at=at,
        y=least_multipliers(at.J, at.slope, how.limit),
        iterations=np.zeros(count, int),
        promise=np.full(count, np.inf),
        definite=np.ones(count, bool),
        optimal=np.zeros(count, bool),
        learned=None if at.rough is None else np.zeros_like(at.curve),
        bent=np.zeros_like(at.curve) if bend is not None and at.rough is None else None,
        age=np.full(count, _KEPT),
    )


def _equations(batch: _Batch, now: Quadratic, active: Index) -> tuple[Equations, Array]:
    """Newton's equations, with the whole curvature near a goal where it is definite in the null space.

    A multiple of JᵀJ is added to it: that changes no step that meets the rows, and makes the matrix definite if, and
    only if, the curvature in the null space is (Debreu's lemma). Returns the equations and that multiple, shape (b,):
    zero where the quadratic model's curvature stands alone.
    """
    limit = batch.how.limit
    W = now.curve.copy() if batch.learned is None else now.curve + batch.learned[active]
    trace = np.trace(W, axis1=1, axis2=2)
    np.einsum("bii->bi", W)[:] += (1e-10 * trace / W.shape[1] + 1e-14)[:, None]
    penalty = np.zeros(len(W))
    if batch.bent is None:
        return factorise(W, now.J, limit), penalty
    near = np.flatnonzero(np.linalg.norm(now.error, axis=1) < _NEAR)
    _renew(batch, active[near])
    plain = W[near]
    penalty[near] = _PENALTY * trace[near] / np.sum(now.J[near] ** 2, axis=(1, 2))
    W[near] += batch.bent[active[near]]
    W[near] += (penalty[near, None, None] * np.swapaxes(now.J[near], 1, 2)) @ now.J[near]
    found = factorise(W, now.J, limit)
    batch.definite[active] = found.definite
    bad = np.flatnonzero(~found.definite[near])
    if len(bad):
        penalty[near[bad]] = 0.0
        others = factorise(plain[bad], now.J[near[bad]], limit)
        for field in fields(Equations):
            getattr(found, field.name)[near[bad]] = getattr(others, field.name)
    return found, penalty


def _renew(batch: _Batch, near: Index) -> None:
    """Ask again for curvatures that have been kept long enough."""
    assert batch.bend is not None
    assert batch.bent is not None
    stale = near[batch.age[near] >= _KEPT]
    if len(stale):
        by_length = None if batch.at.by_length is None else batch.at.by_length[stale]
        batch.bent[stale] = batch.bend(batch.z[stale], stale, batch.y[stale], by_length)
        batch.age[stale] = 0
    batch.age[near] += 1


def _settle(batch: _Batch, active: Index, now: Quadratic) -> Mask:
    """Which goals are met and stationary, shape (b,); those with a definite curvature are optimal."""
    done = _met(now, batch.how) & (batch.promise[active] <= batch.how.optimality * (1 + np.abs(now.value)))
    batch.optimal[active] = done & batch.definite[active]
    return done


def _met(at: Quadratic, how: NewtonSettings) -> Mask:
    return np.all(np.abs(at.error) <= how.tolerance, axis=1)


def _bounded(step: Array, turn: float) -> Array:
    largest = np.max(np.abs(step), axis=1, keepdims=True)
    return step * np.minimum(1.0, turn / np.maximum(largest, 1e-300))


def _go_on(batch: _Batch, active: Index, pending: Index, last: Array, equations: Equations, penalty: Array) -> Index:
    """Further steps by the same factors for some of the active goals; returns the goals that are settled."""
    settled, way = [active[:0]], np.max(np.abs(last), axis=1)
    for _ in range(_AGAIN):
        goals = active[pending]
        now = batch.at.take(goals)
        slope = now.slope + (batch.y[goals][:, None] @ now.J)[:, 0]
        step, change, batch.promise[goals] = solve_equations(equations, pending, slope, now.error)
        done = _settle(batch, goals, now)
        settled.append(goals[done])
        length = np.max(np.abs(step), axis=1)
        keep = np.flatnonzero(~done & (length < _SHRINKS * way))
        if not len(keep):
            break
        batch.y[goals[keep]] += (change - penalty[pending, None] * now.error)[keep]
        size = np.linalg.norm(batch.y[goals[keep]], axis=1)
        moved, _ = _search(batch, goals[keep], step[keep], size, cuts=1)
        pending, way = pending[keep[moved]], length[keep[moved]]
    return np.concatenate(settled)


def _search(
    batch: _Batch,
    goals: Index,
    step: Array,
    size: Array,
    cuts: int = _CUTS,
    restore: Array | None = None,
    least: Array | float = 0.0,
) -> tuple[Mask, Array]:
    """Take the step or a part of it where it lowers the merit enough: which goals moved, and by how much.

    Long steps near a goal bend away from it; `restore`, shape (b, k, m), brings them back.
    """
    moved, shift = np.zeros(len(goals), bool), np.zeros_like(step)
    error, weight = np.linalg.norm(batch.at.error[goals], axis=1), 2 * size
    merit = batch.at.value[goals] + weight * error
    bar = merit - least + 1e-12 * (1 + np.abs(merit))
    pending, part = np.arange(len(goals)), 1.0
    for _ in range(cuts):
        if not len(pending):
            break
        trial = batch.z[goals[pending]] + part * step[pending]
        for back in () if restore is None else (restore,) * _RESTORED:
            error_there = batch.glance(trial, goals[pending], value=False)[1]
            trial = trial - (back[pending] @ error_there[..., None])[..., 0]
        whole = part == 1.0 or batch.brief is None
        there = batch.model(trial, goals[pending]) if whole else None
        at_trial = batch.glance(trial, goals[pending]) if there is None else (there.inside, there.error, there.value)
        inside, error_there, value_there = at_trial
        off = np.linalg.norm(error_there, axis=1)
        with np.errstate(invalid="ignore"):
            falls = value_there + weight[pending] * off <= bar[pending]
            short = np.max(np.abs(part * step[pending]), axis=1) < _FULL
            near = (off <= 0.25 * error[pending]) | (off <= _SLIGHT)
        good = inside & (falls | (short & near & (part == 1.0)))
        taken = pending[good]
        moved[taken], shift[taken] = True, trial[good] - batch.z[goals[taken]]
        batch.z[goals[taken]] = trial[good]
        if there is not None:
            batch.at.put(goals[taken], there, good)
        elif len(taken):
            batch.at.put(goals[taken], batch.model(trial[good], goals[taken]), slice(None))
        pending, part = pending[~good], part / 3
    return moved, shift


def _escape(batch: _Batch, active: Index, now: Quadratic, equations: Equations) -> Mask:
    """Leave saddles along the least curvature in the null space: which goals have left, shape (b,).

    An escape must lower the merit by more than a null-space step promises, and by more than a settled goal may promise,
    so there are finitely many.
    """
    freed = ~batch.definite[active]
    if batch.bent is None or not np.any(freed):
        return freed & False
    goals = active[freed]
    W = now.curve[freed] + batch.bent[goals]
    step = _ESCAPE * downhill(W, now.J[freed], now.slope[freed], batch.how.limit)
    least = np.maximum(batch.promise[goals], batch.how.optimality * (1 + np.abs(now.value[freed])))
    size = np.linalg.norm(batch.y[goals], axis=1)
    freed[freed] = _search(batch, goals, step, size, _WAYS, restoring(equations, freed), least)[0]
    batch.age[active[freed]] = _KEPT
    return freed


def _learn(batch: _Batch, before: Quadratic, goals: Index, shift: Array) -> None:
    """Add what the change of the Lagrangian's slope says about its curvature beyond the known part.

    Source: M. J. D. Powell's damped BFGS formula, Nocedal and Wright, Numerical Optimization, procedure 18.2.
    """
    assert batch.learned is not None
    at, learned = batch.at, batch.learned
    change = at.slope[goals] - before.slope - (before.curve @ shift[..., None])[..., 0]
    change += (np.swapaxes(at.J[goals] - before.J, 1, 2) @ batch.y[goals][..., None])[..., 0]
    length = np.sum(shift**2, axis=1)
    for i in np.flatnonzero(length > 1e-24):
        s, y, B = shift[i], change[i], learned[goals[i]]
        if not B.any():
            B[:] = max(float(s @ y), 1e-3 * float(np.linalg.norm(y) * np.linalg.norm(s))) / length[i] * np.eye(len(s))
        Bs = B @ s
        curve = float(s @ Bs)
        if curve <= 0:
            continue
        part = 1.0 if s @ y >= 0.2 * curve else 0.8 * curve / (curve - float(s @ y))
        r = part * y + (1 - part) * Bs
        B += np.outer(r, r) / float(s @ r) - np.outer(Bs, Bs) / curve
