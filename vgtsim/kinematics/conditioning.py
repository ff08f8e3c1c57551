"""How near a matrix is to a singular one: a pure number with a margin, never whether a factorisation happens to fail.

A singular matrix that has been rounded is regular as often as not: whether a pivot comes out as zero hangs on the last
bit, and so on the processor. Here it is told by the distance of one column from the span of the others over the
column's length, the sine of an angle; a column shorter than is usual for its unit counts with that usual length, so that one
which vanishes is noticed too. The rows share one unit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import NearSingularWarning, SingularPoseError

Array = NDArray[np.float64]

SINGULAR = 1e-9  # smallest sine refused: rounding leaves 1e-15, the weakest shipped arm within its strokes has 1e-3
POOR = 1e-7  # smallest sine that is not warned of: nine digits are left, a random pose comes to 1e-5 in 1e5


def invert(matrix: Array, usual: ArrayLike) -> tuple[Array, Array | None]:
    """Invert small matrices, shape (..., n, n), and tell how near each is to a singular one where it may be near.

    `usual` is the size of the columns where all is well, in their units, broadcast to shape (..., n).

    Returns:
        Inverses, and the smallest sine of each matrix between one column and the span of the others, shape (...): 1
        where all are square to one another, 0 where there is no inverse or an entry is no number. None where the
        largest entries show that no sine is below `POOR`, which is the usual case and cheap.

    Source: G. W. Stewart, Collinearity and least squares regression, Statistical Science 2 (1987): the product of the
        norms of a column and of the row of the inverse is one over that sine.
    """
    try:
        inverse = np.asarray(np.linalg.inv(matrix), float)
    except np.linalg.LinAlgError:
        inverse = _invert_each(matrix)
    size = np.asarray(usual, float)
    most = max(_largest(matrix), float(size.max(initial=0.0))) * _largest(inverse)
    if most * matrix.shape[-1] <= 1 / POOR:  # column times row is at most n times that; false where it is no number
        return inverse, None
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = np.maximum(np.einsum("...ij,...ij->...j", matrix, matrix), size**2)
        squared = columns * np.einsum("...ji,...ji->...j", inverse, inverse)
        sine = np.sqrt(1 / squared.max(axis=-1))
    return inverse, np.where(np.isfinite(sine), sine, 0.0)


def invert_sound(matrix: Array, usual: ArrayLike, name: Callable[[tuple[int, ...]], str]) -> Array:
    """Inverses of small matrices, shape (..., n, n), of which none may be singular; `usual` is as for `invert`.

    `name` gives the module of a matrix by its index among the leading dimensions.

    Raises:
        SingularPoseError: A matrix is singular; its module is named.
    """
    inverse, sine = invert(matrix, usual)
    if sine is not None and (least := sine.min()) < POOR:
        where = tuple(int(i) for i in np.unravel_index(int(np.argmin(sine)), sine.shape))
        if least < SINGULAR:
            raise SingularPoseError(name(where), float(least), SINGULAR)
        warn_poor(f"{name(where)}: smallest sine", float(least), POOR)
    return inverse


def warn_poor(what: str, value: float, bound: float) -> None:
    """Warn of a case that is sound, with few digits left: the value of `what` is below a bound."""
    message = f"{what} {value:.2g}, sound from {bound:.0e}: results have few digits"
    warnings.warn(message, NearSingularWarning, stacklevel=3)


def _largest(matrix: Array) -> float:
    """Greatest size of an entry, without a copy of them all."""
    return max(float(matrix.max(initial=0.0)), -float(matrix.min(initial=0.0)))


def _invert_each(matrix: Array) -> Array:
    """Inverse of each matrix, infinite where there is none: one singular matrix makes `inv` refuse them all."""
    inverse = np.full(matrix.shape, np.inf)
    for place in np.ndindex(matrix.shape[:-2]):
        with suppress(np.linalg.LinAlgError):
            inverse[place] = np.linalg.inv(matrix[place])
    return inverse
