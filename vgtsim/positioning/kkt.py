"""Newton's equations of goal rows and objective: factors that serve more than one right side.

    W s + Jᵀ y = -r
    J s        = -e

with e the error of the goal rows, J its Jacobian, r the slope of the Lagrangian and W its curvature. One Cholesky
factorisation of W and the factors of J W⁻¹ Jᵀ, m by m, take the place of a singular value decomposition of J, n by n.
Eigenvalues of J W⁻¹ Jᵀ below the greatest over the squared condition limit are given up, so steps stay bounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_POSV, _POTRS = get_lapack_funcs(("posv", "potrs"), dtype=np.float64)


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
