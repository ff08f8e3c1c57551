"""The first of equals: what is greatest or least when values that are equal but for rounding are taken as equal.

Members that mirror one another carry the same force but for the last bit, which differs from processor to processor. What
is named in a report or an error, and in which order, is the first of such equals.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Index

_EQUAL = 1e-9  # of the largest size: rounding leaves 1e-12 of a force, and no reader sees ten digits


def first_greatest(values: ArrayLike, axis: int | None = None) -> Index:
    """Index of the first value that is the greatest but for rounding, along an axis or of the flattened values.

    A value that is not a number counts as greater than any, as in NumPy.
    """
    size = np.asarray(values, float)
    size = np.where(np.isnan(size), np.inf, size)
    most = size.max(axis=axis, keepdims=True)
    with np.errstate(invalid="ignore"):
        bound = np.where(np.isfinite(most), most - _EQUAL * np.abs(most), most)
    return np.argmax(size >= bound, axis=axis)


def first_least(values: ArrayLike, axis: int | None = None) -> Index:
    """As `first_greatest`, of the least."""
    return first_greatest(-np.asarray(values, float), axis)


def order_down(values: ArrayLike) -> Index:
    """Indices of values, shape (n,), the greatest first; equals but for rounding stay in their order."""
    size = np.asarray(values, float)
    order = np.argsort(-size, kind="stable")
    falls = size[order]
    with np.errstate(invalid="ignore"):
        step = falls[:-1] - falls[1:] > _EQUAL * np.abs(falls[:-1])
    level = np.concatenate([[0], np.cumsum(step)])[: len(order)]
    return order[np.lexsort((order, level))]
