"""Linear algebra of one goal, compiled: factors, solutions and pseudo-inverses of small matrices.

    W s + Jᵀ y = -r
    J s        = -e

with e the error of the goal rows, J its Jacobian, r the slope of the Lagrangian and W its curvature. One Cholesky
factorisation of W and the factors of J W⁻¹ Jᵀ, m by m, take the place of a singular value decomposition of J, n by n.
Eigenvalues of J W⁻¹ Jᵀ below the greatest over the squared condition limit are given up, so steps stay bounded.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_row


@compiled
def find_dot(a: Array, b: Array) -> float:
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
def find_size(a: Array) -> float:
    """Norm."""
    return np.sqrt(find_dot(a, a))


@compiled
def find_greatest(a: Array) -> float:
    """Greatest size of an entry."""
    most = 0.0
    for i in range(len(a)):
        most = max(most, abs(a[i]))
    return most


@compiled
def add_row(row: Array, other: Array, part: float) -> None:
    """Add a part of another row."""
    for i in range(len(row)):
        row[i] += part * other[i]


@compiled
def apply_matrix(matrix: Array, vector: Array, out: Array) -> None:
    """Product of a matrix and a column."""
    for i in range(len(out)):
        out[i] = find_dot(matrix[i], vector)


@compiled
def apply_row(vector: Array, matrix: Array, out: Array) -> None:
    """Product of a row and a matrix."""
    out[:] = 0.0
    for i in range(len(vector)):
        add_row(out, matrix[i], vector[i])


@compiled
def factorise(W: Array) -> bool:
    """Cholesky's factor of a symmetric matrix in its upper triangle, and whether it is definite."""
    n = len(W)
    for k in range(0, n, 2):  # two rows at a time: half the ways through the matrix
        if not _scale(W[k], k):
            return False
        if k + 1 == n:
            break
        first = W[k]
        add_row(W[k + 1, k + 1 :], first[k + 1 :], -first[k + 1])
        if not _scale(W[k + 1], k + 1):
            return False
        second = W[k + 1]
        for i in range(k + 2, n):
            row, p, q = W[i], first[i], second[i]
            for j in range(i, n):
                row[j] -= p * first[j] + q * second[j]
    return True


@compiled
def _scale(row: Array, k: int) -> bool:
    """Divide a row from its diagonal on by the root of that, and whether it has one."""
    if not row[k] > 0:
        return False
    root = np.sqrt(row[k])
    for j in range(k, len(row)):
        row[j] /= root
    return True


@compiled
def solve_by_factors(U: Array, x: Array) -> None:
    """Solve by the factors, in place."""
    n = len(x)
    for i in range(n):
        x[i] /= U[i, i]
        add_row(x[i + 1 :], U[i, i + 1 :], -x[i])
    for i in range(n - 1, -1, -1):
        x[i] = (x[i] - find_dot(U[i, i + 1 :], x[i + 1 :])) / U[i, i]


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
        if rest <= 1e-34 * whole:  # squares: off the diagonal 1e-17 of it, below rounding
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
                A[p, q] = A[q, p] = 0.0  # but for rounding, which would keep the sweeps going


@compiled
def _invert(A: Array, out: Array) -> float:
    """Inverse of a definite matrix, and a bound of its condition number; infinite where it is not definite."""
    n, U = len(A), A.copy()
    trace, size = 0.0, 0.0
    for i in range(n):
        trace += A[i, i]
    if not factorise(U):
        return np.inf
    out[:] = 0.0
    for i in range(n):
        out[i, i] = 1.0
        solve_by_factors(U, out[i])
        size += out[i, i]
    return trace * size


@compiled
def pseudo_inverse(A: Array, limit: float, out: Array) -> None:
    """Inverse of a symmetric matrix, overwritten, without the eigenvalues below the greatest over limit²."""
    if _invert(A, out) < limit**2:
        return
    n, V, greatest = len(A), np.empty(A.shape), 0.0
    _diagonalise(A, V)
    for k in range(n):
        greatest = max(greatest, A[k, k])
    out[:] = 0.0
    for k in range(n):
        if A[k, k] > greatest / limit**2:
            for i in range(n):
                add_row(out[i], V[k], V[k, i] / A[k, k])


@compiled
def multiply_across(A: Array, B: Array, out: Array) -> None:
    """A Bᵀ."""
    for i in range(len(A)):
        apply_matrix(B, A[i], out[i])


@compiled
def project_slope(J: Array, slope: Array, limit: float, y: Array, rest: Array) -> None:
    """Multipliers that leave least of a slope, and what they leave: its part in the null space of J."""
    square, inverse = np.empty((len(J), len(J))), np.empty((len(J), len(J)))
    multiply_across(J, J, square)
    pseudo_inverse(square, limit, inverse)
    _leave(J, inverse, slope, y, rest)


@compiled
def _leave(J: Array, inverse: Array, slope: Array, y: Array, rest: Array) -> None:
    """As `project_slope`, by the pseudo-inverse of J Jᵀ."""
    own = np.empty(len(J))
    apply_matrix(J, slope, own)
    apply_matrix(inverse, own, y)
    apply_row(y, J, rest)
    for k in range(len(rest)):
        rest[k] = slope[k] - rest[k]
    for m in range(len(y)):
        y[m] = -y[m]


@compiled
def judge_goals(
    J: Array, slope: Array, error: Array, limit: float, tolerance: Array, stationarity: Array, met: Mask
) -> None:
    """Stationarity, and which goals are met, shape (b,), of Jacobians (b, m, k), slopes (b, k) and errors (b, m).

    The stationarity is the norm of a slope in the null space of its Jacobian over 1 + the whole norm.
    """
    size = J.shape[1]
    y, first, rest = np.empty(size), np.empty(J.shape[2]), np.empty(J.shape[2])
    square, inverse = np.empty((size, size)), np.empty((size, size))
    for i in range(len(J)):
        multiply_across(J[i], J[i], square)
        pseudo_inverse(square, limit, inverse)
        _leave(J[i], inverse, slope[i], y, first)  # twice, for the last digits
        _leave(J[i], inverse, first, y, rest)
        stationarity[i], met[i] = find_size(rest) / (1 + find_size(slope[i])), True
        for m in range(size):
            met[i] = met[i] and abs(error[i, m]) <= tolerance[m]


# Cholesky factors of W, shape (k, k), J W⁻¹, shape (m, k), and the pseudo-inverse of J W⁻¹ Jᵀ, shape (m, m); or of B goals
Factors = tuple[Array, Array, Array]


@compiled
def set_up(factors: Factors, J: Array, limit: float) -> bool:
    """Factors of Newton's equations from J and from W, which stands in the place of its own; whether W is definite."""
    W, spread, inverse = factors
    if not factorise(W):
        return False
    square = np.empty(inverse.shape)
    for m in range(len(J)):
        copy_row(J[m], spread[m])
        solve_by_factors(W, spread[m])
    multiply_across(spread, J, square)
    pseudo_inverse(square, limit, inverse)
    return True


@compiled
def solve_equations(factors: Factors, J: Array, slope: Array, error: Array, step: Array, y: Array) -> float:
    """Step and multipliers for a slope and an error; returns the fall that the step in the null space promises."""
    lower, spread, inverse = factors
    fall, own, rows = slope.copy(), np.empty(len(error)), np.empty(len(error))
    solve_by_factors(lower, fall)
    apply_matrix(J, fall, rows)
    apply_matrix(inverse, rows, own)
    apply_matrix(inverse, error, y)
    for m in range(len(y)):
        y[m] -= own[m]
    apply_row(own, spread, step)
    promise = 0.0
    for k in range(len(step)):
        promise -= 0.5 * slope[k] * (step[k] - fall[k])
    apply_row(y, spread, step)
    for k in range(len(step)):
        step[k] = -fall[k] - step[k]
    return max(promise, 0.0)
