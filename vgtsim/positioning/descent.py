"""The iteration of `newton`, compiled: every goal goes its way until it needs something evaluated at its point.

A goal's way is a row of marks and of numbers. `carry_all_on` takes goals whose wants have been answered on to their next want.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_matrix, copy_row
from vgtsim.positioning.elimination import (
    Factors,
    add_row,
    apply_matrix,
    apply_row,
    find_dot,
    find_greatest,
    find_size,
    project_slope,
    set_up,
    solve_equations,
)

# curvature learned from changes of the slope, and curvature that the model leaves out, shape (B, k, k) or without entries
Further = tuple[Array, Array]

MODEL, GLANCE, ERRORS, BEND, DOWNHILL = 1, 2, 3, 4, 5  # what is wanted; the last two are put into `bent` and `step`
WANT, PHASE, MODE, CUT, CUTS, BACKS, COUNT, AGE, DEFINITE, OPTIMAL, AGAIN, MOVES, DONE = range(13)  # marks
PROMISE, PART, WEIGHT, BAR, OFF, WAY, PENALTY, SIZE = range(8)  # numbers
_START, _ITERATE, _FACTOR, _LEAVE, _MAIN, _TRY = range(6)  # phases
_BACK, _BACKED, _JUDGE, _ARRIVE, _FAILED, _AGAIN = range(6, 12)
_ESCAPING, _SHORT, _LONG, _FURTHER = range(4)  # modes of a search

KEPT = 4  # iterations for which the curvature that a model leaves out is kept
_FULL = 0.02  # steps below this may raise the merit while the goal's error falls to a quarter: no crawling along curves
_SLIGHT = 1e-5  # error, m or rad, that such a step may also leave
_NEAR = 0.05  # error, m and rad, below which the whole curvature is worth its price
_WEIGHT = 30.0  # of JᵀJ beside the curvature, by their traces
_CUTS = 9  # thirds: steps shorter than 5e-5 of the full one are not tried
_MOST_AGAIN = 4  # steps that one factorisation may serve after its own
_SHRINKS = 0.2  # a step longer than this part of the last wants new factors
_LEAP = 0.1  # greatest change of a variable on the way from a saddle
_WAYS = 4  # thirds of it that are tried
_STIFFER = 60  # doublings of a plain curvature's diagonal: it is not definite by rounding, or it is no number
_RESTORED = 2  # corrections of the goal rows on a long step


class Rules(NamedTuple):
    """How the iteration runs, see `newton`.

    Attributes:
        tolerance: Greatest error of each row, shape (m,).
        optimality, most: See `NewtonSettings`.
        turn: Greatest change of a variable in one step.
        limit: Condition number past which goal directions are given up.
        dear: Whether slopes cost far more than values.
        bends: Whether the curvature that the model leaves out can be asked for.
    """

    tolerance: Array
    optimality: float
    most: int
    turn: float
    limit: float
    dear: bool
    bends: bool


class Point(NamedTuple):
    """Models at the points of a batch, see `Quadratic`; what is absent has no columns."""

    inside: Mask
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array
    by_length: Array


class Ways(NamedTuple):
    """Where the goals of a batch are on their ways, shapes (B, ...).

    Attributes:
        z: Variables; `trial` is the point that is tried next, and `step` leads to it.
        main: The step put aside for an escape.
        y: Multipliers.
    """

    marks: Index
    numbers: Array
    z: Array
    trial: Array
    step: Array
    main: Array
    y: Array


@compiled
def _learn(shift: Array, change: Array, B: Array) -> None:
    """Add what the change of the Lagrangian's slope says about its curvature beyond the known part.

    Source: M. J. D. Powell's damped BFGS formula, Nocedal and Wright, Numerical Optimization, procedure 18.2.
    """
    length, k = find_dot(shift, shift), len(shift)
    if length <= 1e-24:  # a step of 1e-12, m or rad: its change of slope is rounding
        return
    if not np.any(B):
        first = max(find_dot(shift, change), 1e-3 * find_size(change) * find_size(shift)) / length
        for i in range(k):
            B[i, i] = first
    Bs = np.empty(k)
    apply_matrix(B, shift, Bs)
    curve, along = find_dot(shift, Bs), find_dot(shift, change)
    if curve <= 0:
        return
    part = 1.0 if along >= 0.2 * curve else 0.8 * curve / (curve - along)
    r = part * change + (1 - part) * Bs
    scale = find_dot(r, shift)
    for i in range(k):
        add_row(B[i], r, r[i] / scale)
        add_row(B[i], Bs, -Bs[i] / curve)


@compiled
def _equations(
    marks: Index,
    numbers: Array,
    curve: Array,
    J: Array,
    near: bool,
    i: int,
    learned: Array,
    bent: Array,
    limit: float,
    factors: Factors,
) -> None:
    """Newton's equations, with the whole curvature near a goal where it is definite in the null space.

    A multiple of JᵀJ is added to it: that changes no step that meets the rows, and makes the matrix definite if, and
    only if, the curvature in the null space is (Debreu's lemma). That multiple is the penalty; it is zero where the
    quadratic model's curvature stands alone.
    """
    W, plain, k = factors[0], curve.copy(), len(curve)
    if len(learned):
        plain += learned[i]
    trace = np.trace(plain)
    for a in range(k):
        plain[a, a] += 1e-10 * trace / k + 1e-14  # flat directions get a curvature, far below any that counts
    copy_matrix(plain, W)
    numbers[PENALTY] = 0.0
    if near:
        numbers[PENALTY] = _WEIGHT * trace / np.sum(J * J)
        for a in range(k):
            add_row(W[a], bent[i, a], 1.0)
            for m in range(len(J)):
                add_row(W[a], J[m], numbers[PENALTY] * J[m, a])
    sound = set_up(factors, J, limit)
    if len(bent):
        marks[DEFINITE] = sound
    for _ in range(_STIFFER):
        if sound:
            break
        numbers[PENALTY] = 0.0
        copy_matrix(plain, W)
        sound = set_up(factors, J, limit)
        for a in range(k):  # only where rounding leaves nothing of the least curvature
            plain[a, a] = 2 * plain[a, a] + 1e-14


@compiled
def _settle(marks: Index, numbers: Array, error: Array, value: Any, tolerance: Array, optimality: float) -> bool:
    """Whether a goal is met and stationary; with a definite curvature it is optimal."""
    done = numbers[PROMISE] <= optimality * (1 + abs(value))
    for m in range(len(error)):
        done = done and abs(error[m]) <= tolerance[m]
    marks[OPTIMAL] = done and marks[DEFINITE]
    return done


@compiled
def _search(
    marks: Index, numbers: Array, mode: int, cuts: int, size: float, error: Array, value: Any, least: float
) -> None:
    """Get ready to take a step, or a part of it, where it lowers the merit enough."""
    marks[MODE], marks[CUT], marks[CUTS], marks[BACKS], marks[PHASE] = mode, 0, cuts, _RESTORED, _TRY
    numbers[PART], numbers[WEIGHT], numbers[OFF] = 1.0, 2 * size, find_size(error)
    merit = value + numbers[WEIGHT] * numbers[OFF]
    numbers[BAR] = merit - least + 1e-12 * (1 + abs(merit))  # rounding of the merit


@compiled
def _judge(numbers: Array, step: Array, inside: Any, error: Array, value: Any) -> bool:
    """Whether a trial point is good enough to go to."""
    off, part = find_size(error), numbers[PART]
    falls = value + numbers[WEIGHT] * off <= numbers[BAR]
    short = part * find_greatest(step) < _FULL and part == 1.0
    return inside and (falls or (short and (off <= 0.25 * numbers[OFF] or off <= _SLIGHT)))


@compiled
def _take_up(i: int, rules: Rules, ways: Ways, at: Point, factors: Factors, further: Further) -> None:
    """A new step: Newton's equations set up and solved; at a saddle the way down is wanted."""
    marks, numbers, step, y = ways.marks[i], ways.numbers[i], ways.step[i], ways.y[i]
    error, J, value, slope, curve = at.error[i], at.J[i], at.value[i], at.slope[i], at.curve[i]
    own = factors[0][i], factors[1][i], factors[2][i]
    near = rules.bends and find_size(error) < _NEAR
    marks[AGE] += near
    learned, bent = further
    _equations(marks, numbers, curve, J, near, i, learned, bent, rules.limit, own)
    numbers[PROMISE] = solve_equations(own, J, slope, error, step, y)
    numbers[SIZE] = find_size(y)
    add_row(y, error, -numbers[PENALTY])
    marks[DONE] = _settle(marks, numbers, error, value, rules.tolerance, rules.optimality)
    largest = find_greatest(step)
    if largest > rules.turn:
        step *= rules.turn / largest
    marks[PHASE] = _MAIN
    if rules.bends and not marks[DEFINITE] and marks[COUNT] < rules.most:
        copy_row(step, ways.main[i])
        marks[WANT], marks[PHASE] = DOWNHILL, _LEAVE


@compiled
def _go_on(i: int, rules: Rules, ways: Ways, at: Point, factors: Factors) -> bool:
    """A further step by the same factors; whether the goal is settled."""
    marks, numbers, step, y = ways.marks[i], ways.numbers[i], ways.step[i], ways.y[i]
    error, J, value = at.error[i], at.J[i], at.value[i]
    slope, change = at.slope[i].copy(), np.empty(len(y))
    for m in range(len(y)):
        add_row(slope, J[m], y[m])
    marks[AGAIN] += 1
    own = factors[0][i], factors[1][i], factors[2][i]
    numbers[PROMISE] = solve_equations(own, J, slope, error, step, change)
    if _settle(marks, numbers, error, value, rules.tolerance, rules.optimality):
        return True
    way = find_greatest(step)
    if way >= _SHRINKS * numbers[WAY]:
        marks[COUNT] += 1
        marks[PHASE] = _ITERATE
    else:
        numbers[WAY] = way
        add_row(y, change, 1.0)
        add_row(y, error, -numbers[PENALTY])
        _search(marks, numbers, _FURTHER, 1, find_size(y), error, value, 0.0)
    return False


@compiled
def _arrive(i: int, r: int, ways: Ways, at: Point, there: Point, learned: Array) -> None:
    """Go to the trial point, which is point r of the answers; learn from the way."""
    marks, z, trial, y = ways.marks[i], ways.z[i], ways.trial[i], ways.y[i]
    if len(learned) and marks[MODE] != _ESCAPING:
        shift, change, known = trial - z, there.slope[r] - at.slope[i], np.empty(len(z))
        apply_matrix(at.curve[i], shift, known)
        add_row(change, known, -1.0)
        for m in range(len(y)):
            add_row(change, there.J[r, m], y[m])
            add_row(change, at.J[i, m], -y[m])
        _learn(shift, change, learned[i])
    copy_row(trial, z)
    at.value[i] = there.value[r]
    copy_row(there.error[r], at.error[i])
    copy_row(there.slope[r], at.slope[i])
    copy_row(there.by_length[r], at.by_length[i])
    copy_matrix(there.J[r], at.J[i])
    copy_matrix(there.curve[r], at.curve[i])


@compiled
def _count(marks: Index, numbers: Array, step: Array) -> None:
    """What comes after a step."""
    marks[PHASE] = _AGAIN if marks[MODE] == _FURTHER else _ITERATE
    if marks[MODE] == _FURTHER:
        return
    marks[MOVES] += 1
    if marks[MODE] == _SHORT and numbers[PENALTY] > 0:
        marks[AGAIN], marks[PHASE], numbers[WAY] = 0, _AGAIN, find_greatest(step)
        return
    marks[COUNT] += 1
    if marks[MODE] == _ESCAPING:
        marks[AGE] = KEPT


@compiled
def _leave(marks: Index, numbers: Array, step: Array, y: Array, error: Array, value: Any, optimality: float) -> None:
    """Get ready to leave a saddle along the step, which is a direction.

    An escape must lower the merit by more than a null-space step promises, and by more than a settled goal may promise, so
    there are finitely many.
    """
    step *= _LEAP
    least = max(numbers[PROMISE], optimality * (1 + abs(value)))
    _search(marks, numbers, _ESCAPING, _WAYS, find_size(y), error, value, least)


@compiled
def _ask(marks: Index, numbers: Array, dear: Any) -> None:
    """Ask for a trial point's errors where it is to be brought back to the goal rows, or for what judges it."""
    if marks[BACKS] and (marks[MODE] == _ESCAPING or marks[MODE] == _LONG):
        marks[WANT], marks[PHASE] = ERRORS, _BACKED
    else:
        marks[PHASE] = _JUDGE
        marks[WANT] = MODEL if numbers[PART] == 1.0 or not dear else GLANCE


@compiled
def _take_or_cut(marks: Index, numbers: Array, good: Any, dear: Any) -> None:
    """What follows a trial point: going to it if it is good, whose model is wanted where it was glanced at; or a cut step."""
    if good:
        marks[PHASE] = _ARRIVE
        if numbers[PART] != 1.0 and dear:
            marks[WANT] = MODEL
    else:
        marks[CUT] += 1
        marks[BACKS] = _RESTORED
        numbers[PART] /= 3
        marks[PHASE] = _TRY if marks[CUT] < marks[CUTS] else _FAILED


@compiled
def carry_on(
    rules: Rules, which: Index, there: Point, ways: Ways, at: Point, factors: Factors, further: Further
) -> None:
    """Carry some goals, shape (c,), on to what they want next; `there` are answers to what was wanted."""
    back, row = np.empty(ways.z.shape[1]), np.empty(ways.y.shape[1])
    for r in range(len(which)):
        i = which[r]
        marks, numbers, z, trial = ways.marks[i], ways.numbers[i], ways.z[i], ways.trial[i]
        step, main, y = ways.step[i], ways.main[i], ways.y[i]
        marks[WANT] = 0
        while marks[WANT] == 0:
            phase, error, value = marks[PHASE], at.error[i], at.value[i]
            near = find_size(error) < _NEAR
            if phase == _START:
                project_slope(at.J[i], at.slope[i], rules.limit, y, back)
                marks[PHASE] = _ITERATE
            elif phase == _ITERATE:
                marks[PHASE] = _FACTOR
                if rules.bends and near and marks[AGE] >= KEPT:
                    marks[WANT], marks[AGE] = BEND, 0
            elif phase == _FACTOR:
                _take_up(i, rules, ways, at, factors, further)
                if marks[COUNT] >= rules.most:
                    break
            elif phase == _LEAVE:
                _leave(marks, numbers, step, y, error, value, rules.optimality)
            elif phase == _MAIN:
                if marks[DONE]:
                    break
                # long steps near a goal bend away from it and are brought back
                mode = _LONG if near and find_greatest(step) > _FULL else _SHORT
                _search(marks, numbers, mode, _CUTS, numbers[SIZE], error, value, 0.0)
            elif phase == _TRY:
                copy_row(z, trial)
                add_row(trial, step, numbers[PART])
                marks[PHASE] = _BACK
            elif phase == _BACK:
                _ask(marks, numbers, rules.dear)
            elif phase == _BACKED:
                apply_matrix(factors[2][i], there.error[r], row)
                apply_row(row, factors[1][i], back)
                add_row(trial, back, -1.0)
                marks[BACKS], marks[PHASE] = marks[BACKS] - 1, _BACK
            elif phase == _JUDGE:
                good = _judge(numbers, step, there.inside[r], there.error[r], there.value[r])
                _take_or_cut(marks, numbers, good, rules.dear)
            elif phase == _ARRIVE:
                _arrive(i, r, ways, at, there, further[0])
                _count(marks, numbers, step)
            elif phase == _FAILED and marks[MODE] == _ESCAPING:
                copy_row(main, step)
                marks[PHASE] = _MAIN
            elif marks[AGAIN] == _MOST_AGAIN or (phase == _FAILED and marks[MODE] == _FURTHER):
                marks[COUNT] += 1
                marks[AGAIN], marks[PHASE] = 0, _ITERATE
            elif phase == _FAILED or _go_on(i, rules, ways, at, factors):
                break


@compiled
def carry_all_on(which: Index, there: Any, rules: Any, ways: Any, at: Any, factors: Factors, further: Further) -> None:
    """As `carry_on`, of plain tuples: Python gives them to compiled functions in half the time of records."""
    carry_on(Rules(*rules), which, Point(*there), Ways(*ways), Point(*at), factors, further)
