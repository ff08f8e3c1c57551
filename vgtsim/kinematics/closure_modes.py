"""All solutions of an octahedral cell's closure, real and complex, by elimination (section 3.4.1).

With x = tan(phi/2) each of a cell's three closures is a biquadratic in two of x1, x2, x3. Eliminating x3 between the
second and the third by Bezout's resultant, and x2 between that and the first by Sylvester's matrix, leaves a matrix
polynomial in x1 whose eigenvalues are the solutions. Each candidate is polished by Newton's method on the cosines and
sines in complex arithmetic, where nothing is singular at phi = pi, and kept only if it closes; doubles are counted once.

No count is assumed: what is returned is what closes. The elimination bounds it by sixteen per octahedral cell.

Some lengths leave a whole curve of solutions, Bricard's flexible octahedra. The eliminated determinant then vanishes for
every x1; the isolated solutions are found from a neighbouring closure, and the cell is reported as flexible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig

from vgtsim.kinematics.octahedral_closure import closure_values

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_CLOSES = 1e-10  # of the largest coefficient: polished solutions reach 1e-15, false candidates do not get near
_SAME = 1e-6  # between cosines and sines of one solution reached twice; double roots are good to 1e-8
_REAL = 1e-8  # imaginary part of a real solution after polishing
_POLISH_STEPS = 30
_VANISHES = 1e-12  # smallest singular value of a matrix with rows of unit size
_NEIGHBOURHOOD, _NEIGHBOURS = 1e-3, 3  # relative change of the closure, and how many are tried
_ISOLATED = 1e-5  # conditioning above which a solution of a flexible cell is off the curve


@dataclass(frozen=True)
class Modes:
    """Solutions of one cell's closure.

    Attributes:
        cosine: Of phi_1 to phi_3, shape (n, 3), complex.
        sine: Of phi_1 to phi_3, shape (n, 3), complex.
        residual: Greatest closure error over the largest coefficient, shape (n,).
        conditioning: Smallest singular value of the scaled closure's derivative, shape (n,): zero at a multiple solution.
        flexible: Whether there is a curve of solutions besides these; they are isolated then.
    """

    cosine: ComplexArray
    sine: ComplexArray
    residual: Array
    conditioning: Array
    flexible: bool

    @property
    def real(self) -> NDArray[np.bool_]:
        """Which of them are real, shape (n,)."""
        parts = np.concatenate([self.cosine, self.sine], axis=-1)
        return np.max(np.abs(parts.imag), axis=-1) < _REAL

    @property
    def phi(self) -> Array:
        """Angles of the real ones, shape (r, 3), rad."""
        keep = self.real
        return np.arctan2(self.sine[keep].real, self.cosine[keep].real)


def closure_modes(C: ArrayLike) -> Modes:
    """All solutions of an octahedral cell's three closures.

    Args:
        C: Closure, shape (5, 3), m².

    Returns:
        The isolated solutions, sorted by the real part of cos(phi_1).
    """
    scaled = np.asarray(C, float)
    scaled = scaled / np.max(np.abs(scaled))
    M = _sylvester(_biquadratics(scaled))
    if not _vanishes(M):
        return _distinct(scaled, _polish(scaled, _candidates(_biquadratics(scaled), M)), flexible=False)
    rng = np.random.default_rng(0)
    starts = []
    for _ in range(_NEIGHBOURS):
        P = _biquadratics(scaled * (1 + _NEIGHBOURHOOD * rng.standard_normal(scaled.shape)))
        starts.append(_polish(scaled, _candidates(P, _sylvester(P))))
    return _distinct(scaled, np.concatenate(starts), flexible=True)


def _vanishes(M: Array) -> bool:
    """Whether a matrix polynomial is singular for every argument: tried at three."""
    scale = np.max(np.abs(M), axis=(0, 2))
    rows = M / np.where(scale > 0, scale, 1.0)[:, None]
    tried = [np.tensordot(x ** np.arange(5), rows, axes=1) for x in (0.61 + 0.83j, -1.27 + 0.31j, 0.29 - 1.13j)]
    return bool(np.max(np.linalg.svd(tried, compute_uv=False)[:, -1]) < _VANISHES)


def _biquadratics(C: Array) -> Array:
    """Coefficients of x_k^m x_(k+1)^n of the three closures times (1 + x_k²)(1 + x_(k+1)²), shape (3, 3, 3)."""
    plus, minus, odd = np.array([1.0, 0, 1]), np.array([1.0, 0, -1]), np.array([0, 2.0, 0])
    terms = ((plus, plus), (minus, plus), (plus, minus), (minus, minus), (odd, odd))
    return np.array([sum(C[i, k] * np.outer(*term) for i, term in enumerate(terms)) for k in range(3)])


def _candidates(P: Array, M: Array) -> ComplexArray:
    """Values of (x1, x2, x3) near which solutions may lie, shape (n, 3)."""
    grids = []
    for x in _eigenvalues(M):
        powers = x ** np.arange(3)
        second, third = np.roots((powers @ P[0])[::-1]), np.roots((P[2] @ powers)[::-1])
        grids += [(x, x2, x3) for x2 in second for x3 in third]
    return np.array(grids, dtype=complex).reshape(-1, 3)


def _sylvester(P: Array) -> Array:
    """Matrix polynomial in x1, shape (5 powers, 6, 6), singular where all three closures have a common solution."""
    # quadratics in x3: the second closure's coefficients are polynomials in x2 (rows), the third's in x1 (columns)
    U, W = P[1].T, P[2]

    def outer(i: int, j: int) -> Array:
        return np.outer(U[i], W[j])

    outside = outer(2, 0) - outer(0, 2)
    inside = _multiply(outer(2, 1) - outer(1, 2), outer(1, 0) - outer(0, 1))
    resultant = _multiply(outside, outside) - inside  # powers of x2, of x1: shape (5, 5)
    M = np.zeros((5, 6, 6))
    for row in range(2):
        M[:, row, row : row + 5] = resultant.T
    for row in range(4):
        M[:3, 2 + row, row : row + 3] = P[0]
    return M


def _multiply(first: Array, second: Array) -> Array:
    """Product of two polynomials in two unknowns."""
    result = np.zeros((first.shape[0] + second.shape[0] - 1, first.shape[1] + second.shape[1] - 1))
    for (i, j), value in np.ndenumerate(first):
        result[i : i + second.shape[0], j : j + second.shape[1]] += value * second
    return result


def _eigenvalues(M: Array) -> ComplexArray:
    """Finite eigenvalues of a matrix polynomial, from its companion pencil."""
    degree, size = M.shape[0] - 1, M.shape[1]
    scale = np.max(np.abs(M), axis=(0, 2), keepdims=True)
    M = M / np.where(scale > 0, scale, 1.0)
    A, B = np.zeros((2, degree * size, degree * size))
    A[:-size, size:] = np.eye((degree - 1) * size)
    A[-size:] = -np.concatenate(list(M[:-1]), axis=1)
    B[:-size, :-size] = np.eye((degree - 1) * size)
    B[-size:, -size:] = M[-1]
    alpha, beta = eig(A, B, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-10 * np.abs(alpha)
    return alpha[finite] / beta[finite]


def _polish(C: Array, x: ComplexArray) -> ComplexArray:
    """Newton on the cosines and sines from every candidate; shape (n, 6), cosines first."""
    z = np.concatenate([(1 - x**2), 2 * x], axis=-1) / np.tile(1 + x**2, 2)
    z = z[np.all(np.isfinite(z), axis=-1)]
    for _ in range(_POLISH_STEPS):
        value, slope = _system(C, z)
        regular = np.linalg.cond(slope) < 1e15
        z = z[regular] - np.linalg.solve(slope[regular], value[regular][..., None])[..., 0]
        z = z[np.max(np.abs(z), axis=-1) < 1e8]
    return z


def _system(C: Array, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """The three closures and cos² + sin² = 1, with their derivatives; shapes (n, 6) and (n, 6, 6)."""
    cosine, sine = z[:, :3], z[:, 3:]
    value = np.concatenate([closure_values(C[..., None], cosine.T, sine.T).T, cosine**2 + sine**2 - 1], axis=-1)
    slope = np.zeros((*z.shape, 6), complex)
    _, b, g, e, f = C
    for k in range(3):
        j = (k + 1) % 3
        slope[:, k, k], slope[:, k, j] = b[k] + e[k] * cosine[:, j], g[k] + e[k] * cosine[:, k]
        slope[:, k, 3 + k], slope[:, k, 3 + j] = f[k] * sine[:, j], f[k] * sine[:, k]
        slope[:, 3 + k, k], slope[:, 3 + k, 3 + k] = 2 * cosine[:, k], 2 * sine[:, k]
    return value, slope


def _distinct(C: Array, z: ComplexArray, flexible: bool) -> Modes:
    """Keep the solutions that close, once each; of a flexible cell only the isolated ones."""
    residual, conditioning = _quality(C, z)
    z = z[(residual < _CLOSES) & (not flexible or conditioning > _ISOLATED)]
    z = z[np.lexsort((z[:, 3].real, z[:, 1].real, z[:, 0].real))]
    apart = np.max(np.abs(z[:, None] - z), axis=-1) / np.maximum(1.0, np.max(np.abs(z), axis=-1))
    kept: list[int] = []
    for i in range(len(z)):
        if np.all(apart[i, kept] > _SAME):
            kept.append(i)
    z = z[kept]
    return Modes(z[:, :3], z[:, 3:], *_quality(C, z), flexible)


def _quality(C: Array, z: ComplexArray) -> tuple[Array, Array]:
    """Closure error, relative to the size of the solution squared, and conditioning; each shape (n,)."""
    value, slope = _system(C, z)
    size = np.maximum(1.0, np.max(np.abs(z), axis=-1, initial=0.0))
    return np.max(np.abs(value), axis=-1, initial=0.0) / size**2, np.linalg.svd(slope, compute_uv=False)[:, -1]
