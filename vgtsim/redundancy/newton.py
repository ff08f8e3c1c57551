"""The batched null-space method: Newton on the goal rows and on the objective within their null space, at once.

For every goal of a batch each iteration takes the step that solves

    min over s of  ½ sᵀ H s + gᵀ s   subject to   J s = -e,

with e the goal's error, J its Jacobian, g and H slope and curvature of the objective. It is the particular solution of
least curvature plus the best homogeneous one (end of section 6.3): the goal and the optimum are approached together.
With H⁻¹ in hand it costs the factors of J H⁻¹ Jᵀ, m by m, instead of a singular value decomposition of J, n by n.

Step control: a step changes no input by more than `turn`; it is cut to a third until the point is inside the strokes
and |e| times twice the multipliers' size plus the objective has fallen. Singular directions: eigenvalues of J H⁻¹ Jᵀ
below the greatest over the squared condition limit are given up, so steps stay bounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vgtsim.redundancy.analysis import CONDITION_LIMIT

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_FULL = 0.02  # steps below this may raise the merit while the goal's error falls to a quarter: no crawling along curves
_SLIGHT = 1e-5  # error, m or rad, that such a step may also leave
_NEAR = 0.05  # error, m and rad, below which the whole curvature is worth its price
_PENALTY = 30.0  # weight of JᵀJ beside the curvature, by their traces
_KEPT = 4  # iterations for which it is kept
_CUTS = 9  # thirds: steps shorter than 5e-5 of the full one are not tried


@dataclass(frozen=True)
class Local:
    """Goal rows and objective about a batch of points.

    Attributes:
        inside: Whether a point is inside all hard limits; nothing else counts where it is not, shape (b,).
        error: Shape (b, m), in units of the rows.
        J: Derivative of the error, shape (b, m, k).
        value: Objective, shape (b,).
        slope: Shape (b, k).
        curve: Known curvature, positive semidefinite, shape (b, k, k).
        rough: Part of the slope whose curvature is to be learned from its changes, shape (b, k), or absent.
        memo: What the curvature's function wants again of these points, leading dimension b, or absent.
    """

    inside: NDArray[np.bool_]
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array | None = None
    memo: Array | None = None


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


@dataclass(frozen=True)
class Found:
    """Where the iteration ended, for each goal.

    Attributes:
        z: Variables, shape (B, k).
        local: Rows and objective there.
        iterations: Steps taken, shape (B,).
        met: Whether every row is within its tolerance, shape (B,).
        promise: Fall of the objective that the best null-space step promises, shape (B,).
        definite: Whether the whole curvature was positive definite in the null space when last asked for, shape (B,).
        stationarity: Norm of the objective's slope within the null space, over 1 + that of the whole slope, shape (B,).
        optimal: Whether the goal is met, the promise is below the setting and the curvature definite: a local minimum
            to second order, shape (B,).
    """

    z: Array
    local: Local
    iterations: NDArray[np.intp]
    met: NDArray[np.bool_]
    promise: Array
    definite: NDArray[np.bool_]
    stationarity: Array
    optimal: NDArray[np.bool_]


Evaluate = Callable[[Array, Index], Local]
Bend = Callable[[Array, Index, Array, Array | None], Array]


def minimise(
    evaluate: Evaluate, start: Array, settings: NewtonSettings | None = None, bend: Bend | None = None
) -> Found:
    """Meet every goal of a batch and make its objective least in the null space.

    Args:
        evaluate: From variables, shape (b, k), and the goals they are for, shape (b,), to the local model.
        start: Variables inside the hard limits, shape (B, k).
        settings: How.
        bend: From variables, goals, multipliers of the goal rows, shape (b, m), and memos to the curvature of the
            Lagrangian that the local model leaves out, shape (b, k, k). It is asked for once a goal is near, and kept
            for a few steps.

    Returns:
        The ends; goals that cannot be met are not `met`.

    Raises:
        ValueError: A start is outside the hard limits.
    """
    how = settings or NewtonSettings()
    every = np.arange(len(start))
    z, at = np.array(start, float), evaluate(start, every)
    if not np.all(at.inside):
        raise ValueError(f"start {int(np.argmin(at.inside))} is outside the strokes")
    iterations, promise, optimal = np.zeros(len(z), int), np.full(len(z), np.inf), np.zeros(len(z), bool)
    learned = None if at.rough is None else np.zeros_like(at.curve)
    bent, age = np.zeros_like(at.curve) if bend and learned is None else None, np.full(len(z), _KEPT)
    definite, active = np.ones(len(z), bool), every
    for count in range(how.most + 1):
        now = _take(at, active) if len(active) < len(every) else at
        H = now.curve if learned is None else now.curve + learned[active]
        step, y, promise[active] = _step(now, H, how)
        if bend is not None and bent is not None:
            near = np.linalg.norm(now.error, axis=1) < _NEAR
            stale = near & (age[active] >= _KEPT)
            if np.any(stale):
                bent[active[stale]] = bend(
                    z[active[stale]], active[stale], y[stale], None if now.memo is None else now.memo[stale]
                )
                age[active[stale]] = 0
            definite[active] = _bend_steps(now, H, bent[active], near, (step, y, promise), active, how)
            age[active] += 1
        met = np.all(np.abs(now.error) <= how.tolerance, axis=1)
        done = met & (promise[active] <= how.optimality * (1 + np.abs(now.value)))
        optimal[active] = done & definite[active]
        if count == how.most or np.all(done):
            break
        go = ~done
        active, now, step, y = active[go], _take(now, go), step[go], y[go]
        at, moved, shift = _search(evaluate, z, at, active, now, step, np.linalg.norm(y, axis=1))
        if learned is not None:
            _learn(learned, at, now, active, shift, y)
        iterations[active[moved]] += 1
        active = active[moved]
        if not len(active):
            break
    met = np.all(np.abs(at.error) <= how.tolerance, axis=1)
    return Found(z, at, iterations, met, promise, definite, _stationarity(at), optimal)


def _step(now: Local, H: Array, how: NewtonSettings) -> tuple[Array, Array, Array]:
    """Step, shape (b, k), multipliers of the goal rows, shape (b, m), promise of the null-space part, shape (b,)."""
    ridge = 1e-10 * np.trace(H, axis1=1, axis2=2) / H.shape[1] + 1e-14
    H = H.copy()
    np.einsum("bii->bi", H)[:] += ridge[:, None]
    solved = np.linalg.solve(H, np.concatenate([np.swapaxes(now.J, 1, 2), now.slope[:, :, None]], axis=2))
    spread, fall = solved[:, :, :-1], solved[:, :, -1]
    values, vectors = np.linalg.eigh(now.J @ spread)
    keep = values > values[:, -1:] / how.limit**2
    inverse = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)

    def multipliers(right: Array) -> Array:
        return (vectors @ (inverse[..., None] * (np.swapaxes(vectors, 1, 2) @ right[..., None])))[..., 0]

    own = multipliers((now.J @ fall[..., None])[..., 0])
    y = multipliers(now.error) - own
    homogeneous = -fall + (spread @ own[..., None])[..., 0]
    step = -fall - (spread @ y[..., None])[..., 0]
    promise = -0.5 * np.sum(now.slope * homogeneous, axis=1)
    largest = np.max(np.abs(step), axis=1, keepdims=True)
    step *= np.minimum(1.0, how.turn / np.maximum(largest, 1e-300))
    return step, y, np.maximum(promise, 0.0)


def _bend_steps(
    now: Local,
    H: Array,
    bent: Array,
    near: NDArray[np.bool_],
    found: tuple[Array, Array, Array],
    active: Index,
    how: NewtonSettings,
) -> NDArray[np.bool_]:
    """Put steps with the whole curvature in the place of those near a goal, where it is definite in the null space.

    A multiple of JᵀJ is added: it changes no step that meets the rows, and makes the matrix definite if, and only if,
    the curvature in the null space is (Debreu's lemma). Returns where it is, shape (b,).
    """
    known = np.ones(len(H), bool)
    if not np.any(near):
        return known
    J = now.J[near]
    scale = np.trace(H, axis1=1, axis2=2)[near] / np.sum(J**2, axis=(1, 2))
    whole = np.swapaxes((_PENALTY * scale)[:, None, None] * J, 1, 2) @ J
    whole += bent[near]
    whole += H[near]
    good = _definite(whole)
    known[near] = good
    if not np.any(good):
        return known
    which = np.flatnonzero(near)[good]
    step, y, promise = found
    step[which], multipliers, promise[active[which]] = _step(_take(now, which), whole[good], how)
    y[which] = multipliers
    return known


def _definite(matrices: Array) -> NDArray[np.bool_]:
    """Which matrices are positive definite, shape (b,); a batch that fails is halved."""
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.zeros(1, bool)
        half = len(matrices) // 2
        return np.concatenate([_definite(matrices[:half]), _definite(matrices[half:])])
    return np.ones(len(matrices), bool)


def _search(
    evaluate: Evaluate, z: Array, at: Local, active: Index, now: Local, step: Array, size: Array
) -> tuple[Local, NDArray[np.bool_], Array]:
    """Take the step or a part of it for each active goal: the new local model, which goals moved, and by how much."""
    moved, shift = np.zeros(len(active), bool), np.zeros_like(step)
    error, weight = np.linalg.norm(now.error, axis=1), 2 * size
    merit = now.value + weight * error
    pending, part = np.arange(len(active)), 1.0
    for _ in range(_CUTS):
        trial = z[active[pending]] + part * step[pending]
        there = evaluate(trial, active[pending])
        off = np.linalg.norm(there.error, axis=1)
        with np.errstate(invalid="ignore"):
            falls = there.value + weight[pending] * off <= merit[pending] + 1e-12 * (1 + np.abs(merit[pending]))
            short = np.max(np.abs(part * step[pending]), axis=1) < _FULL
            near = (off <= 0.25 * error[pending]) | (off <= _SLIGHT)
        good = there.inside & (falls | (short & near & (part == 1.0)))
        taken = pending[good]
        z[active[taken]] = trial[good]
        if len(taken) == len(z):
            at = there
        else:
            _put(at, active[taken], there, good)
        moved[taken], shift[taken] = True, part * step[taken]
        pending, part = pending[~good], part / 3
        if not len(pending):
            break
    return at, moved, shift


def _learn(learned: Array, at: Local, before: Local, active: Index, shift: Array, y: Array) -> None:
    """Add what the change of the Lagrangian's slope says about its curvature beyond the known part, in place.

    Source: M. J. D. Powell's damped BFGS formula, Nocedal and Wright, Numerical Optimization, procedure 18.2.
    """
    change = at.slope[active] - before.slope - (before.curve @ shift[..., None])[..., 0]
    change += (np.swapaxes(at.J[active] - before.J, 1, 2) @ y[..., None])[..., 0]
    length = np.sum(shift**2, axis=1)
    for i in np.flatnonzero(length > 1e-24):
        s, y, B = shift[i], change[i], learned[active[i]]
        if not B.any():
            B[:] = max(float(s @ y), 1e-3 * float(np.linalg.norm(y) * np.linalg.norm(s))) / length[i] * np.eye(len(s))
        Bs = B @ s
        curve = float(s @ Bs)
        if curve <= 0:
            continue
        part = 1.0 if s @ y >= 0.2 * curve else 0.8 * curve / (curve - float(s @ y))
        r = part * y + (1 - part) * Bs
        B += np.outer(r, r) / float(s @ r) - np.outer(Bs, Bs) / curve


def _stationarity(at: Local) -> Array:
    """Norm of the slope's part in the null space of J, over 1 + the norm of the slope, shape (B,)."""
    Q = np.linalg.qr(np.swapaxes(at.J, 1, 2))[0]
    rest = at.slope - (Q @ (np.swapaxes(Q, 1, 2) @ at.slope[..., None]))[..., 0]
    return np.linalg.norm(rest, axis=1) / (1 + np.linalg.norm(at.slope, axis=1))


def _take(local: Local, which: Index | NDArray[np.bool_]) -> Local:
    parts = (getattr(local, field.name) for field in fields(local))
    return Local(*(None if part is None else part[which] for part in parts))  # type: ignore[arg-type]


def _put(local: Local, where: Index, source: Local, which: NDArray[np.bool_]) -> None:
    for field in fields(local):
        part = getattr(local, field.name)
        if part is not None:
            part[where] = getattr(source, field.name)[which]
