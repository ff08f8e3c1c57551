"""The quadratic model about a point, and Newton's equations: factors that serve more than one right side.

    W s + Jᵀ y = -r
    J s        = -e

with e the error of the goal rows, J its Jacobian, r the slope of the Lagrangian and W its curvature. One Cholesky
factorisation of W and the factors of J W⁻¹ Jᵀ, m by m, take the place of a singular value decomposition of J, n by n.
Eigenvalues of J W⁻¹ Jᵀ below the greatest over the squared condition limit are given up, so steps stay bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import get_lapack_funcs

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Which = NDArray[np.intp] | NDArray[np.bool_] | slice

_POSV, _POTRS = get_lapack_funcs(("posv", "potrs"), dtype=np.float64)
CONDITION_LIMIT = 1e5  # section 6.2.1: past it the smallest singular values are given up


@dataclass(frozen=True)
class Equations:
    """The left sides of a batch, in factors.

    Attributes:
        lower: Cholesky factors of W in the lower triangles, shape (b, k, k).
        definite: Which W are positive definite, shape (b,); of the others nothing else counts.
        J: Shape (b, m, k).
        spread: J W⁻¹, shape (b, m, k).
        inverse: Pseudo-inverse of J W⁻¹ Jᵀ, shape (b, m, m).
    """

    lower: Array
    definite: NDArray[np.bool_]
    J: Array
    spread: Array
    inverse: Array


def factorise(W: Array, J: Array, limit: float) -> Equations:
    """Factorise symmetric W, shape (b, k, k), overwritten, with J, shape (b, m, k), up to a condition number.

    LAPACK matrix by matrix: one call factorises, solves and tells whether W is definite, in half the time of NumPy's
    stacked `cholesky` and `solve`.
    """
    spread, definite = np.array(J), np.zeros(len(W), bool)
    for i in range(len(W)):
        # the transpose of a matrix stored by rows is one stored by columns: worked on in place
        _, _, info = _POSV(W[i].T, spread[i].T, overwrite_a=True, overwrite_b=True)
        definite[i] = info == 0
    spread[~definite] = 0.0
    return Equations(W, definite, J, spread, pseudo_inverse(spread @ np.swapaxes(J, 1, 2), limit))


def solve_equations(equations: Equations, which: Index, slope: Array, error: Array) -> tuple[Array, Array, Array]:
    """Solve some of the equations, shape (c,), all definite, for slopes r, shape (c, k), and errors e, shape (c, m).

    Returns steps, shape (c, k), multipliers y, shape (c, m), and the fall of the objective that the part of the step in
    the null space promises, shape (c,).
    """
    fall, lower = np.array(slope), equations.lower
    for i, k in enumerate(which):
        _POTRS(lower[k].T, fall[i : i + 1].T, overwrite_b=True)
    J, spread, inverse = equations.J[which], equations.spread[which], equations.inverse[which]
    own = (inverse @ (J @ fall[..., None]))[..., 0]
    y = (inverse @ error[..., None])[..., 0] - own
    homogeneous = (own[:, None] @ spread)[:, 0] - fall
    step = -fall - (y[:, None] @ spread)[:, 0]
    return step, y, np.maximum(-0.5 * np.sum(slope * homogeneous, axis=1), 0.0)


def restoring(equations: Equations, which: NDArray[np.bool_]) -> Array:
    """Steps of least curvature that change each goal row by one, shape (c, k, m), of some equations."""
    return np.swapaxes(equations.spread[which], 1, 2) @ equations.inverse[which]


def least_multipliers(J: Array, slope: Array, limit: float) -> Array:
    """Multipliers that leave least of the slope, shape (b, m), for J of shape (b, m, k) and slopes of shape (b, k)."""
    inverse = pseudo_inverse(J @ np.swapaxes(J, 1, 2), limit)
    return -(inverse @ (J @ slope[..., None]))[..., 0]


def pseudo_inverse(matrices: Array, limit: float) -> Array:
    """Inverses of symmetric matrices, shape (b, m, m), without the eigenvalues below the greatest over limit²."""
    values, vectors = np.linalg.eigh(matrices)
    keep = values > values[:, -1:] / limit**2
    return (vectors * np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)[:, None]) @ np.swapaxes(vectors, 1, 2)


def downhill(W: Array, J: Array, slope: Array, limit: float) -> Array:
    """Directions, shape (b, k), of least curvature in the null space of J, along which the objective does not rise.

    W, shape (b, k, k), is not positive there; J has shape (b, m, k), the slope (b, k). The greatest change of a
    variable is 1.
    """
    Jt = np.swapaxes(J, 1, 2)
    keep = np.eye(W.shape[1]) - Jt @ pseudo_inverse(J @ Jt, limit) @ J
    direction = np.linalg.eigh(keep @ W @ keep)[1][:, :, 0]  # the rows' own directions have the eigenvalue zero
    rise = np.sum(slope * direction, axis=1)
    scale = np.where(rise > 0, -1.0, 1.0) / np.max(np.abs(direction), axis=1)
    return direction * scale[:, None]


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

    inside: NDArray[np.bool_]
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array | None = None
    by_length: Array | None = None

    def take(self, which: Which) -> Quadratic:
        """Some of the points, copied."""
        parts = (getattr(self, field.name) for field in fields(self))
        return Quadratic(*(None if part is None else part[which] for part in parts))  # type: ignore[arg-type]

    def put(self, where: Which, source: Quadratic, which: Which) -> None:
        """Write some points of a source to places of this batch."""
        for field in fields(self):
            part = getattr(self, field.name)
            if part is not None:
                part[where] = getattr(source, field.name)[which]


def stationarity(at: Quadratic) -> Array:
    """Norm of the slope's part in the null space of J, over 1 + the norm of the slope, shape (b,)."""
    Q = np.linalg.qr(np.swapaxes(at.J, 1, 2))[0]
    rest = at.slope - (Q @ (np.swapaxes(Q, 1, 2) @ at.slope[..., None]))[..., 0]
    return np.linalg.norm(rest, axis=1) / (1 + np.linalg.norm(at.slope, axis=1))


def condition_numbers(jacobian: ArrayLike) -> Array:
    """Greatest over least singular value (6.32), shape (...), of Jacobians (..., m, n); infinite below rank m."""
    values = np.linalg.svd(np.asarray(jacobian, float), compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(values[..., -1] > 0, values[..., 0] / values[..., -1], inf)


def lost_directions(jacobian: ArrayLike, names: tuple[str, ...], limit: float = CONDITION_LIMIT) -> tuple[str, ...]:
    """Goal directions that a configuration cannot follow, from a Jacobian of shape (m, n) and the names of its rows.

    Singular values below the greatest over `limit` are given up; each direction is named by the rows that it consists
    of.
    """
    U, values, _ = np.linalg.svd(np.asarray(jacobian, float))
    rank = int(np.sum(values > values[0] / limit))
    return tuple(_name(column, names) for column in U[:, rank:].T)


def _name(direction: Array, labels: tuple[str, ...]) -> str:
    """The rows that a direction consists of, the greatest part first."""
    order = np.argsort(-np.abs(direction), kind="stable")
    parts = [(direction[i], labels[i]) for i in order if abs(direction[i]) >= 0.1]
    if len(parts) == 1:
        return parts[0][1]
    return " ".join(f"{share:+.2f} {label}" for share, label in parts)
