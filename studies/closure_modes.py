"""All solutions of an octahedral cell's closure, real and complex, by elimination (section 3.4.1).

With x = tan(phi/2) each of a cell's three closures is a biquadratic in two of x1, x2, x3. Bezout's resultant
eliminates x3 between the second and the third closure. Sylvester's matrix eliminates x2 between the result and the first one.
The eigenvalues of the matrix polynomial in x1 that is left are the solutions. Newton's method on complex angles,
where nothing is singular at phi = pi, polishes each candidate. Only those that close are kept; doubles are counted once.

No count is assumed. The elimination bounds the solutions by sixteen per octahedral cell.

Some lengths leave a whole curve of solutions, Bricard's flexible octahedra. The eliminated determinant then
vanishes for every x1; the isolated solutions are found from a neighbouring closure, and the cell is reported
as flexible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig

from vgtsim.kinematics.closure import closure_slopes

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_CLOSES = 1e-11  # of the sum of the terms' sizes: polished solutions reach 1e-15, others do not get near
_SAME = 1e-6  # between cosines and sines of one solution reached twice; double roots are good to 1e-8
_REAL = 1e-8  # imaginary part of a real solution after polishing
_POLISH_STEPS = 30
_FARTHEST = 25.0  # imaginary part, rad: cosines of 1e10; farther solutions count as lying at infinity
_VANISHES = 1e-12  # smallest singular value of a matrix with rows of unit size
_NEIGHBOURHOOD = 1e-3  # relative change of the closure of a flexible cell
_ATTEMPTS = 3  # one for each unknown that may be kept to the end
_BOUND = 16  # degree of the elimination: there cannot be more
_REGULAR = 1e-5  # conditioning: on a curve of solutions it is zero but for rounding, of order its square root
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])  # pairs of a cell, in turn
_NUDGE = 1e-3  # rad: how far a solution is pushed to see whether it comes back


def closure_values(C: NDArray, cosine: NDArray, sine: NDArray) -> NDArray:
    """F = D² - edge² of the three pairs, shape (3, ...), m², of cosines and sines of phi; also of complex angles."""
    a, b, g, e, f = C
    c2, s2 = cosine[_NEXT], sine[_NEXT]
    return a + b * cosine + c2 * (g + e * cosine) + f * sine * s2


def solve_cyclic(p: NDArray, q: NDArray, right: NDArray, determinant: NDArray) -> NDArray:
    """Solution of p_k x_k + q_k x_(k+1) = right_k, shape (3, ...); the determinant is p1 p2 p3 + q1 q2 q3."""
    p1, p2 = p[_NEXT], p[_AFTER]
    return (right * p1 * p2 - q * right[_NEXT] * p2 + q * q[_NEXT] * right[_AFTER]) / determinant


@dataclass(frozen=True)
class Modes:
    """Solutions of one cell's closure.

    Attributes:
        cosine: Of phi_1 to phi_3, shape (n, 3), complex.
        sine: Of phi_1 to phi_3, shape (n, 3), complex.
        residual: Greatest closure error over the sum of the sizes of its terms, shape (n,).
        conditioning: Smallest singular value of the scaled closure's derivative, shape (n,): zero at a
            multiple solution.
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
    flexible = _vanishes(_sylvester(_biquadratics(scaled)))
    rng = np.random.default_rng(0)
    starts: list[ComplexArray] = []
    modes = None
    for attempt in range(_ATTEMPTS):
        near = scaled * (1 + _NEIGHBOURHOOD * rng.standard_normal(scaled.shape)) if flexible else scaled
        starts.append(_polish(scaled, _rotated_candidates(near, attempt)))
        modes = _distinct(scaled, np.concatenate(starts), flexible)
        if len(modes.residual) == _BOUND:
            break
    assert modes is not None
    return modes


def _rotated_candidates(C: Array, turn: int) -> ComplexArray:
    """Candidates from keeping x1, x2 or x3 to the end: one badly conditioned for one is not for another."""
    P = _biquadratics(np.roll(C, -turn, axis=1))
    return np.roll(_candidates(P, _sylvester(P)), turn, axis=1)


def _vanishes(M: Array) -> bool:
    """Whether a matrix polynomial is singular for every argument: tried at three."""
    scale = np.max(np.abs(M), axis=(0, 2))
    rows = M / np.where(scale > 0, scale, 1.0)[:, None]
    tried = [np.tensordot(x ** np.arange(5), rows, axes=1) for x in (0.61 + 0.83j, -1.27 + 0.31j, 0.29 - 1.13j)]
    return bool(np.max(np.linalg.svd(tried, compute_uv=False)[:, -1]) < _VANISHES)


def _biquadratics(C: Array) -> Array:
    """Coefficients of x_k^m x_(k+1)^n of the closures times (1 + x_k²)(1 + x_(k+1)²), shape (3, 3, 3)."""
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
    """Matrix polynomial in x1, shape (5 powers, 6, 6), singular where the three closures have a solution."""
    # quadratics in x3: the second closure's coefficients are polynomials in x2, the third's in x1
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
    A, B = np.zeros((degree * size, degree * size)), np.zeros((degree * size, degree * size))
    A[:-size, size:] = np.eye((degree - 1) * size)
    A[-size:] = -np.concatenate(list(M[:-1]), axis=1)
    B[:-size, :-size] = np.eye((degree - 1) * size)
    B[-size:, -size:] = M[-1]
    alpha, beta = np.asarray(eig(A, B, right=False, homogeneous_eigvals=True))
    finite = np.abs(beta) > 1e-10 * np.abs(alpha)
    return alpha[finite] / beta[finite]


def _polish(C: Array, x: ComplexArray) -> ComplexArray:
    """Newton on complex angles from every candidate; shape (n, 3), rad."""
    with np.errstate(all="ignore"):
        phi = (-1j * np.log((1 + 1j * x) / (1 - 1j * x))).T
        for _ in range(_POLISH_STEPS):
            phi = phi[:, np.all(np.isfinite(phi) & (np.abs(phi.imag) < _FARTHEST), axis=0)]
            cosine, sine = np.cos(phi), np.sin(phi)
            p, q = closure_slopes(C[..., None], cosine, sine)
            determinant = p[0] * p[1] * p[2] + q[0] * q[1] * q[2]
            phi = phi - solve_cyclic(p, q, closure_values(C[..., None], cosine, sine), determinant)
    return phi[:, np.all(np.isfinite(phi) & (np.abs(phi.imag) < _FARTHEST), axis=0)].T


def _distinct(C: Array, phi: ComplexArray, flexible: bool) -> Modes:
    """Keep the solutions that close, once each; of a flexible cell only the isolated ones."""
    residual, _ = _quality(C, phi)
    phi = phi[np.argsort(residual)][: np.count_nonzero(residual < _CLOSES)]
    if flexible:
        phi = phi[(_quality(C, phi)[1] > _REGULAR) & _comes_back(C, phi)]
    z = np.concatenate([np.cos(phi), np.sin(phi)], axis=-1)
    apart = np.max(np.abs(z[:, None] - z) / np.maximum(1.0, np.abs(z)), axis=-1)
    kept: list[int] = []
    for i in range(len(z)):
        if np.all(apart[kept, i] > _SAME):
            kept.append(i)
    kept.sort(key=lambda i: tuple(np.round(np.real(z[i]), 9)))  # mirrored solutions share cosines but for rounding
    return Modes(z[kept, :3], z[kept, 3:], *_quality(C, phi[kept]), flexible)


def _quality(C: Array, phi: ComplexArray) -> tuple[Array, Array]:
    """Closure error, relative to the sum of its terms' sizes, and conditioning; each shape (n,)."""
    cosine, sine = np.cos(phi.T), np.sin(phi.T)
    c2, s2 = np.abs(cosine[[1, 2, 0]]), np.abs(sine[[1, 2, 0]])
    a, b, g, e, f = np.abs(C)[..., None]
    size = a + b * np.abs(cosine) + c2 * (g + e * np.abs(cosine)) + f * np.abs(sine) * s2
    error = np.max(np.abs(closure_values(C[..., None], cosine, sine)) / size, axis=0, initial=0.0)
    value = np.linalg.svd(_jacobian(C, cosine, sine), compute_uv=False)
    return error, np.asarray(value[:, -1] / np.maximum(value[:, 0], 1.0), float)


def _jacobian(C: Array, cosine: ComplexArray, sine: ComplexArray) -> ComplexArray:
    """dF/dphi, shape (n, 3, 3), for cosines and sines of shape (3, n)."""
    p, q = closure_slopes(C[..., None], cosine, sine)
    J = np.zeros((cosine.shape[1], 3, 3), complex)
    for k in range(3):
        J[:, k, k], J[:, k, (k + 1) % 3] = p[k], q[k]
    return J


def _comes_back(C: Array, phi: ComplexArray) -> NDArray[np.bool_]:
    """Which solutions are isolated: pushed aside, the shortest Newton steps bring them back; shape (n,)."""
    moved = phi + _NUDGE * np.random.default_rng(0).standard_normal(phi.shape)
    for _ in range(_POLISH_STEPS):
        cosine, sine = np.cos(moved.T), np.sin(moved.T)
        F = closure_values(C[..., None], cosine, sine).T
        moved = moved - (np.linalg.pinv(_jacobian(C, cosine, sine), rcond=1e-6) @ F[..., None])[..., 0]
    return np.max(np.abs(moved - phi), axis=-1) < _NUDGE / 100
