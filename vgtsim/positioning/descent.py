"""The iteration of `newton`, compiled: every goal goes its way until it needs something evaluated at its point.

A goal's way is a row of marks and of numbers. `advance` takes goals whose wants have been answered on to their next want.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
# inside, error, J, value, slope, curve, rough and by_length, see `Quadratic`; absent ones have no columns
Point = tuple[Mask, Array, Array, Array, Array, Array, Array, Array]
# Cholesky factors of W, shape (B, k, k), J W⁻¹, shape (B, m, k), and the pseudo-inverse of J W⁻¹ Jᵀ, shape (B, m, m)
Factors = tuple[Array, Array, Array]

MODEL, GLANCE, ERRORS, BEND = 1, 2, 3, 4  # what is wanted
WANT, PHASE, MODE, CUT, CUTS, BACKS, COUNT, AGE, DEFINITE, OPTIMAL, AGAIN, MOVES, DONE = range(13)  # marks
PROMISE, PART, WEIGHT, BAR, OFF, WAY, PENALTY, SIZE = range(8)  # numbers
_ITERATE, _FACTOR, _MAIN, _TRY, _BACK, _BACKED, _JUDGE, _ACCEPT, _MOVED, _FAILED, _AGAIN = range(11)  # phases
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
_RESTORED = 2  # corrections of the goal rows on a long step


@compiled
def _dot(a: Array, b: Array) -> float:
    """Scalar product by four sums, which a processor works out side by side."""
    p, q, r, s, n = 0.0, 0.0, 0.0, 0.0, len(a) // 4 * 4
    for i in range(0, n, 4):
        p += a[i] * b[i]
        q += a[i + 1] * b[i + 1]
        r += a[i + 2] * b[i + 2]
        s += a[i + 3] * b[i + 3]
    for i in range(n, len(a)):
        p += a[i] * b[i]
    return (p + q) + (r + s)


@compiled
def _size(a: Array) -> float:
    return np.sqrt(_dot(a, a))


@compiled
def _greatest(a: Array) -> float:
    most = 0.0
    for i in range(len(a)):
        most = max(most, abs(a[i]))
    return most


@compiled
def _add(row: Array, other: Array, part: float) -> None:
    for i in range(len(row)):
        row[i] += part * other[i]


@compiled
def _apply(matrix: Array, vector: Array, out: Array) -> None:
    for i in range(len(out)):
        out[i] = _dot(matrix[i], vector)


@compiled
def _spread(vector: Array, matrix: Array, out: Array) -> None:
    """Product of a row and a matrix."""
    out[:] = 0.0
    for i in range(len(vector)):
        _add(out, matrix[i], vector[i])


@compiled
def _factorise(W: Array) -> bool:
    """Cholesky's factor of a symmetric matrix in its upper triangle, and whether it is definite."""
    for k in range(len(W)):
        if not W[k, k] > 0:
            return False
        root = np.sqrt(W[k, k])
        for j in range(k, len(W)):
            W[k, j] /= root
        for i in range(k + 1, len(W)):
            _add(W[i, i:], W[k, i:], -W[k, i])
    return True


@compiled
def _solve(U: Array, x: Array) -> None:
    """Solve by the factors, in place."""
    n = len(x)
    for i in range(n):
        x[i] /= U[i, i]
        _add(x[i + 1 :], U[i, i + 1 :], -x[i])
    for i in range(n - 1, -1, -1):
        x[i] = (x[i] - _dot(U[i, i + 1 :], x[i + 1 :])) / U[i, i]


@compiled
def _diagonalise(A: Array, V: Array) -> None:
    """Eigenvalues of a symmetric matrix on its diagonal, and eigenvectors as the rows of V, by Jacobi's turns."""
    n = len(A)
    V[:] = 0.0
    for i in range(n):
        V[i, i] = 1.0
    for _ in range(50):  # sweeps; some six are enough
        rest, whole = 0.0, 0.0
        for i in range(n):
            whole += A[i, i] * A[i, i]
            for j in range(i):
                rest += A[i, j] * A[i, j]
        if rest <= 1e-34 * whole:
            break
        for p in range(n):
            for q in range(p + 1, n):
                if A[p, q] == 0.0:
                    continue
                half = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = (1.0 if half >= 0 else -1.0) / (abs(half) + np.sqrt(half * half + 1))
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                for k in range(n):
                    A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
                for k in range(n):
                    A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
                    V[p, k], V[q, k] = c * V[p, k] - s * V[q, k], s * V[p, k] + c * V[q, k]


@compiled
def _pseudo_inverse(A: Array, limit: float, out: Array) -> None:
    """Inverse of a symmetric matrix, overwritten, without the eigenvalues below the greatest over limit²."""
    n, V, greatest = len(A), np.empty(A.shape), 0.0
    _diagonalise(A, V)
    for k in range(n):
        greatest = max(greatest, A[k, k])
    out[:] = 0.0
    for k in range(n):
        if A[k, k] > greatest / limit**2:
            for i in range(n):
                _add(out[i], V[k], V[k, i] / A[k, k])


@compiled
def find_multipliers(J: Array, slope: Array, limit: float, y: Array) -> None:
    """Multipliers that leave least of the slope, shape (b, m), for J of shape (b, m, k) and slopes of shape (b, k)."""
    rows = J.shape[1]
    square, inverse, own = np.empty((rows, rows)), np.empty((rows, rows)), np.empty(rows)
    for i in range(len(y)):
        _cross(J[i], J[i], square)
        _pseudo_inverse(square, limit, inverse)
        _apply(J[i], slope[i], own)
        _apply(inverse, own, y[i])
        y[i] = -y[i]


@compiled
def _cross(A: Array, B: Array, out: Array) -> None:
    """A Bᵀ."""
    for i in range(len(A)):
        _apply(B, A[i], out[i])


@compiled
def find_rest(J: Array, slope: Array, rest: Array) -> None:
    """Part of slopes, shape (b, k), in the null space of J, shape (b, m, k): Gram and Schmidt's method, twice."""
    row = np.empty(J.shape[2])
    for i in range(len(J)):
        basis, count = np.empty(J[i].shape), 0
        for m in range(J.shape[1]):
            row[:] = J[i, m]
            for _ in range(2):
                for k in range(count):
                    _add(row, basis[k], -_dot(row, basis[k]))
            if _size(row) > 1e-12 * _size(J[i, m]):
                basis[count] = row / _size(row)
                count += 1
        rest[i] = slope[i]
        for _ in range(2):
            for k in range(count):
                _add(rest[i], basis[k], -_dot(rest[i], basis[k]))


@compiled
def _set_up(W: Array, J: Array, spread: Array, inverse: Array, limit: float) -> bool:
    """Factors of Newton's equations from W, overwritten, and J; whether W is definite."""
    if not _factorise(W):
        return False
    square = np.empty(inverse.shape)
    for m in range(len(J)):
        spread[m] = J[m]
        _solve(W, spread[m])
    _cross(spread, J, square)
    _pseudo_inverse(square, limit, inverse)
    return True


@compiled
def _solve_equations(
    lower: Array, J: Array, spread: Array, inverse: Array, slope: Array, error: Array, step: Array, y: Array
) -> float:
    """Step and multipliers for a slope and an error; returns the fall that the step in the null space promises."""
    fall, own, rows = slope.copy(), np.empty(len(error)), np.empty(len(error))
    _solve(lower, fall)
    _apply(J, fall, rows)
    _apply(inverse, rows, own)
    _apply(inverse, error, y)
    for m in range(len(y)):
        y[m] -= own[m]
    _spread(own, spread, step)
    promise = 0.0
    for k in range(len(step)):
        promise -= 0.5 * slope[k] * (step[k] - fall[k])
    _spread(y, spread, step)
    for k in range(len(step)):
        step[k] = -fall[k] - step[k]
    return max(promise, 0.0)


@compiled
def _go_downhill(W: Array, J: Array, slope: Array, limit: float, direction: Array) -> None:
    """Direction of least curvature in the null space of J, along which the objective does not rise; its greatest entry is 1.

    W is not positive there.
    """
    k, rows = len(W), len(J)
    square, inverse, keep = np.empty((rows, rows)), np.empty((rows, rows)), np.eye(k)
    _cross(J, J, square)
    _pseudo_inverse(square, limit, inverse)
    row, half, V = np.empty(k), np.empty((k, k)), np.empty((k, k))
    for m in range(rows):
        _spread(inverse[m], J, row)
        for i in range(k):
            _add(keep[i], row, -J[m, i])
    for i in range(k):
        _spread(keep[i], W, row)
        _apply(keep, row, half[i])
    _diagonalise(half, V)  # the rows' own directions have the eigenvalue zero
    least = 0
    for i in range(k):
        if half[i, i] < half[least, least]:
            least = i
    scale = (-1.0 if _dot(slope, V[least]) > 0 else 1.0) / _greatest(V[least])
    for i in range(k):
        direction[i] = scale * V[least, i]


@compiled
def _learn(shift: Array, change: Array, B: Array) -> None:
    """Add what the change of the Lagrangian's slope says about its curvature beyond the known part.

    Source: M. J. D. Powell's damped BFGS formula, Nocedal and Wright, Numerical Optimization, procedure 18.2.
    """
    length, k = _dot(shift, shift), len(shift)
    if length <= 1e-24:
        return
    if not np.any(B):
        first = max(_dot(shift, change), 1e-3 * _size(change) * _size(shift)) / length
        for i in range(k):
            B[i, i] = first
    Bs = np.empty(k)
    _apply(B, shift, Bs)
    curve, along = _dot(shift, Bs), _dot(shift, change)
    if curve <= 0:
        return
    part = 1.0 if along >= 0.2 * curve else 0.8 * curve / (curve - along)
    r = part * change + (1 - part) * Bs
    scale = _dot(r, shift)
    for i in range(k):
        _add(B[i], r, r[i] / scale)
        _add(B[i], Bs, -Bs[i] / curve)


@compiled
def _equations(
    marks: Index,
    numbers: Array,
    curve: Array,
    J: Array,
    near: bool,
    learned: Array,
    bent: Array,
    limit: float,
    factors: tuple[Array, Array, Array],
) -> None:
    """Newton's equations, with the whole curvature near a goal where it is definite in the null space.

    A multiple of JᵀJ is added to it: that changes no step that meets the rows, and makes the matrix definite if, and
    only if, the curvature in the null space is (Debreu's lemma). That multiple is the penalty; it is zero where the
    quadratic model's curvature stands alone.
    """
    W, spread, inverse = factors
    plain, k = curve.copy(), len(curve)
    for i in range(len(learned)):
        _add(plain[i], learned[i], 1.0)
    trace = 0.0
    for i in range(k):
        trace += plain[i, i]
    for i in range(k):
        plain[i, i] += 1e-10 * trace / k + 1e-14
    W[:] = plain
    numbers[PENALTY] = 0.0
    if near:
        total = 0.0
        for m in range(len(J)):
            total += _dot(J[m], J[m])
        numbers[PENALTY] = _WEIGHT * trace / total
        for i in range(k):
            _add(W[i], bent[i], 1.0)
            for m in range(len(J)):
                _add(W[i], J[m], numbers[PENALTY] * J[m, i])
    sound = _set_up(W, J, spread, inverse, limit)
    if len(bent):
        marks[DEFINITE] = sound
    while not sound:
        numbers[PENALTY] = 0.0
        W[:] = plain
        sound = _set_up(W, J, spread, inverse, limit)
        for i in range(k):  # only where rounding leaves nothing of the least curvature
            plain[i, i] = 2 * plain[i, i] + 1e-14


@compiled
def _settle(marks: Index, numbers: Array, error: Array, value: float, tolerance: Array, optimality: float) -> bool:
    """Whether a goal is met and stationary; with a definite curvature it is optimal."""
    done = numbers[PROMISE] <= optimality * (1 + abs(value))
    for m in range(len(error)):
        done = done and abs(error[m]) <= tolerance[m]
    marks[OPTIMAL] = done and marks[DEFINITE]
    return done


@compiled
def _begin_search(
    marks: Index,
    numbers: Array,
    mode: int,
    cuts: int,
    backs: int,
    size: float,
    error: Array,
    value: float,
    least: float,
) -> None:
    """Get ready to take a step, or a part of it, where it lowers the merit enough."""
    marks[MODE], marks[CUT], marks[CUTS], marks[BACKS], marks[PHASE] = mode, 0, cuts, backs, _TRY
    numbers[PART], numbers[WEIGHT], numbers[OFF] = 1.0, 2 * size, _size(error)
    merit = value + numbers[WEIGHT] * numbers[OFF]
    numbers[BAR] = merit - least + 1e-12 * (1 + abs(merit))


@compiled
def _judge(marks: Index, numbers: Array, step: Array, inside: bool, error: Array, value: float) -> bool:
    """Whether a trial point is good enough to go to."""
    off, part = _size(error), numbers[PART]
    falls = value + numbers[WEIGHT] * off <= numbers[BAR]
    short = part * _greatest(step) < _FULL and part == 1.0
    return inside and (falls or (short and (off <= 0.25 * numbers[OFF] or off <= _SLIGHT)))


@compiled
def advance(
    how: Array,
    tolerance: Array,
    which: Index,
    there: Point,
    marks: Index,
    numbers: Array,
    z: Array,
    trial: Array,
    step: Array,
    main: Array,
    y: Array,
    at: Point,
    factors: Factors,
    learned: Array,
    bent: Array,
) -> None:
    """Carry some goals, shape (c,), on to what they want next; `there` has the answers to what they wanted.

    `how` is optimality, greatest count, greatest change of a variable, condition limit, whether slopes cost far more than
    values, and whether `bent`, the curvature that the model leaves out, can be asked for. Multipliers are y, shape (B, m).
    """
    optimality, most, turn, limit, dear, bends = how[0], int(how[1]), how[2], how[3], how[4] > 0, how[5] > 0
    _, error, J, value, slope, curve, _, _ = at
    lower, spread, inverse = factors
    multipliers, right, own = np.empty(y.shape[1]), np.empty(z.shape[1]), np.empty(y.shape[1])
    for r in range(len(which)):
        i = which[r]
        own_marks, own_numbers = marks[i], numbers[i]
        own_marks[WANT] = 0
        own_learned = learned[i] if len(learned) else learned[:0].reshape(0, 0)
        own_bent = bent[i] if len(bent) else bent[:0].reshape(0, 0)
        while True:
            phase = own_marks[PHASE]
            near = _size(error[i]) < _NEAR
            if phase == _ITERATE:
                own_marks[PHASE] = _FACTOR
                if bends and near and own_marks[AGE] >= KEPT:
                    own_marks[WANT], own_marks[AGE] = BEND, 0
                    break
            elif phase == _FACTOR:
                own_marks[AGE] += bends and near
                _equations(
                    own_marks,
                    own_numbers,
                    curve[i],
                    J[i],
                    bends and near,
                    own_learned,
                    own_bent,
                    limit,
                    (lower[i], spread[i], inverse[i]),
                )
                own_numbers[PROMISE] = _solve_equations(
                    lower[i], J[i], spread[i], inverse[i], slope[i], error[i], step[i], multipliers
                )
                own_numbers[SIZE] = _size(multipliers)
                y[i] = multipliers
                _add(y[i], error[i], -own_numbers[PENALTY])
                own_marks[DONE] = _settle(own_marks, own_numbers, error[i], value[i], tolerance, optimality)
                if own_marks[COUNT] >= most:
                    break
                largest = _greatest(step[i])
                if largest > turn:
                    step[i] *= turn / largest
                own_marks[PHASE] = _MAIN
                if bends and not own_marks[DEFINITE]:
                    # an escape must lower the merit by more than a null-space step promises, and by more than a settled
                    # goal may promise, so there are finitely many
                    main[i] = step[i]
                    _go_downhill(curve[i] + own_bent, J[i], slope[i], limit, step[i])
                    step[i] *= _LEAP
                    least = max(own_numbers[PROMISE], optimality * (1 + abs(value[i])))
                    _begin_search(
                        own_marks, own_numbers, _ESCAPING, _WAYS, _RESTORED, _size(y[i]), error[i], value[i], least
                    )
            elif phase == _MAIN:
                if own_marks[DONE]:
                    break
                # long steps near a goal bend away from it and are brought back
                long = near and _greatest(step[i]) > _FULL
                mode, backs = (_LONG, _RESTORED) if long else (_SHORT, 0)
                _begin_search(own_marks, own_numbers, mode, _CUTS, backs, own_numbers[SIZE], error[i], value[i], 0.0)
            elif phase == _TRY:
                trial[i] = z[i]
                _add(trial[i], step[i], own_numbers[PART])
                own_marks[PHASE] = _BACK
            elif phase == _BACK:
                left = own_marks[BACKS] if own_marks[MODE] in (_ESCAPING, _LONG) else 0
                if left:
                    own_marks[WANT], own_marks[PHASE] = ERRORS, _BACKED
                else:
                    own_marks[WANT] = MODEL if own_numbers[PART] == 1.0 or not dear else GLANCE
                    own_marks[PHASE] = _JUDGE
                break
            elif phase == _BACKED:
                _apply(inverse[i], there[1][r], own)
                _spread(own, spread[i], right)
                _add(trial[i], right, -1.0)
                own_marks[BACKS] -= 1
                own_marks[PHASE] = _BACK
            elif phase == _JUDGE:
                if _judge(own_marks, own_numbers, step[i], there[0][r], there[1][r], there[3][r]):
                    own_marks[PHASE] = _ACCEPT
                    if own_numbers[PART] != 1.0 and dear:
                        own_marks[WANT] = MODEL
                        break
                else:
                    own_marks[CUT] += 1
                    own_numbers[PART] /= 3
                    own_marks[BACKS] = _RESTORED
                    own_marks[PHASE] = _TRY if own_marks[CUT] < own_marks[CUTS] else _FAILED
            elif phase == _ACCEPT:
                if len(own_learned) and own_marks[MODE] != _ESCAPING:
                    shift, change = trial[i] - z[i], there[4][r] - slope[i]
                    _apply(curve[i], shift, right)
                    _add(change, right, -1.0)
                    _spread(y[i], there[2][r] - J[i], right)
                    _add(change, right, 1.0)
                    _learn(shift, change, own_learned)
                z[i] = trial[i]
                error[i], J[i], value[i], slope[i], curve[i] = (
                    there[1][r],
                    there[2][r],
                    there[3][r],
                    there[4][r],
                    there[5][r],
                )
                at[7][i] = there[7][r]
                own_marks[PHASE] = _MOVED
            elif phase == _MOVED:
                own_marks[PHASE] = _ITERATE
                if own_marks[MODE] == _FURTHER:
                    own_marks[PHASE] = _AGAIN
                    continue
                own_marks[MOVES] += 1
                if own_marks[MODE] == _SHORT and own_numbers[PENALTY] > 0:
                    own_marks[AGAIN], own_marks[PHASE] = 0, _AGAIN
                    own_numbers[WAY] = _greatest(step[i])
                    continue
                own_marks[COUNT] += 1
                if own_marks[MODE] == _ESCAPING:
                    own_marks[AGE] = KEPT
            elif phase == _FAILED:
                if own_marks[MODE] == _ESCAPING:
                    step[i] = main[i]
                    own_marks[PHASE] = _MAIN
                elif own_marks[MODE] == _FURTHER:
                    own_marks[COUNT] += 1
                    own_marks[PHASE] = _ITERATE
                else:
                    break
            else:  # a further step by the same factors
                own_marks[COUNT] += own_marks[AGAIN] == _MOST_AGAIN
                if own_marks[AGAIN] == _MOST_AGAIN:
                    own_marks[PHASE] = _ITERATE
                    continue
                own_marks[AGAIN] += 1
                _spread(y[i], J[i], right)
                _add(right, slope[i], 1.0)
                own_numbers[PROMISE] = _solve_equations(
                    lower[i], J[i], spread[i], inverse[i], right, error[i], step[i], multipliers
                )
                if _settle(own_marks, own_numbers, error[i], value[i], tolerance, optimality):
                    break
                way = _greatest(step[i])
                if way >= _SHRINKS * own_numbers[WAY]:
                    own_marks[COUNT] += 1
                    own_marks[PHASE] = _ITERATE
                    continue
                own_numbers[WAY] = way
                _add(y[i], multipliers, 1.0)
                _add(y[i], error[i], -own_numbers[PENALTY])
                _begin_search(own_marks, own_numbers, _FURTHER, 1, 0, _size(y[i]), error[i], value[i], 0.0)
