"""How near a matrix is to a singular one: a pure number with a margin, never whether a factorisation happens to fail.

A singular matrix that has been rounded is regular as often as not: whether a pivot comes out as zero hangs on the last
bit, and so on the processor. Here it is told by the distance of one column from the span of the others over the
column's length, the sine of an angle; a column shorter than is usual for its unit counts with that usual length, so that one
which vanishes is noticed too. The rows share one unit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.errors import NearSingularWarning, SingularPoseError

SINGULAR = 1e-9  # smallest sine refused: rounding leaves 1e-15, the weakest shipped arm within its strokes has 1e-3
POOR = 1e-7  # smallest sine that is not warned of: nine digits are left, a random pose comes to 1e-5 in 1e5


def invert(matrix: Array, usual: ArrayLike) -> tuple[Array, Array]:
    """Invert small matrices, shape (..., n, n), and tell how near each is to a singular one.

    `usual` is the size of the columns where all is well, in their units, broadcast to shape (..., n).

    Returns:
        Inverses, and the smallest sine of each matrix between one column and the span of the others, shape (...): 1
        where all are square to one another, 0 where there is no inverse or an entry is no number.

    Source: G. W. Stewart, Collinearity and least squares regression, Statistical Science 2 (1987): the product of the
        norms of a column and of the row of the inverse is one over that sine.
    """
    size, count = np.asarray(usual, float), matrix.shape[-1]
    if not size.ndim or size.shape != matrix.shape[-1 - size.ndim : -1]:
        size = np.broadcast_to(size, matrix.shape[:-1])
    inverse, sine = np.array(matrix, float), np.empty(matrix.shape[:-2])
    _invert_all(inverse.reshape(-1, count, count), by_rows(size.reshape(-1, count)), sine.reshape(-1))
    return inverse, sine


def invert_sound(matrix: Array, usual: ArrayLike, name: Callable[[tuple[int, ...]], str]) -> Array:
    """Inverses of small matrices, shape (..., n, n), of which none may be singular; `usual` is as for `invert`.

    `name` gives the module of a matrix by its index among the leading dimensions.

    Raises:
        SingularPoseError: A matrix is singular; its module is named.
    """
    inverse, sine = invert(matrix, usual)
    if (least := sine.min(initial=1.0)) < POOR:
        where = tuple(int(i) for i in np.unravel_index(int(np.argmin(sine)), sine.shape))
        if least < SINGULAR:
            raise SingularPoseError(name(where), float(least), SINGULAR)
        warn_poor(f"{name(where)}: smallest sine", float(least), POOR)
    return inverse


def warn_poor(what: str, value: float, bound: float) -> None:
    """Warn of a case that is sound, with few digits left: the value of `what` is below a bound."""
    message = f"{what} {value:.2g}, sound from {bound:.0e}: results have few digits"
    warnings.warn(message, NearSingularWarning, stacklevel=3)


@compiled
def _invert_all(matrix: Array, usual: Array, sine: Array) -> None:
    """Invert in place, shape (K, n, n); usual sizes have shape (U, n), over and over. Infinite where there is no inverse."""
    count = matrix.shape[1]
    rows, square = np.empty(count, np.intp), np.empty(count)
    for m in range(len(matrix)):
        for j in range(count):
            square[j] = 0.0
            for i in range(count):
                square[j] += matrix[m, i, j] ** 2
            square[j] = max(square[j], usual[m % len(usual), j] ** 2)
        if invert_in_place(matrix[m], rows, count):
            sine[m] = find_sine(square, matrix[m], count)
        else:
            sine[m] = 0.0
            for i in range(count):
                for j in range(count):
                    matrix[m, i, j] = np.inf


@compiled
def invert_in_place(matrix: Array, rows: Index, count: int) -> bool:
    """Invert the first rows and columns, by Gauss and Jordan with the greatest pivots; whether there is an inverse.

    `rows` is room for as many indices.
    """
    for p in range(count):
        best = p
        for i in range(p + 1, count):
            if abs(matrix[i, p]) > abs(matrix[best, p]):
                best = i
        rows[p] = best
        if not abs(matrix[best, p]) > 0.0:  # nor where it is no number
            return False
        scale = 1 / matrix[best, p]
        for j in range(count):
            value = matrix[best, j]
            matrix[best, j] = matrix[p, j]
            matrix[p, j] = value * scale
        matrix[p, p] = scale
        for i in range(count):
            if i != p:
                part = matrix[i, p]
                matrix[i, p] = 0.0
                for j in range(count):
                    matrix[i, j] -= part * matrix[p, j]
    for p in range(count - 1, -1, -1):  # columns in the place of the rows that were exchanged
        for i in range(count):
            value = matrix[i, p]
            matrix[i, p] = matrix[i, rows[p]]
            matrix[i, rows[p]] = value
    return True


@compiled
def find_sine(square: Array, inverse: Array, count: int) -> float:
    """Smallest sine between a column and the span of the others, see `invert`, from the columns' squared sizes."""
    worst = 0.0
    for j in range(count):
        row = 0.0
        for i in range(count):
            row += inverse[j, i] ** 2
        row *= square[j]
        if not row < np.inf:
            return 0.0
        worst = max(worst, row)
    return 1 / np.sqrt(worst)
