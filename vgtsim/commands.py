"""Rows of numbers that come from outside, read before anything is done with them."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import CommandError

Array = NDArray[np.float64]


def read_row(what: str, values: ArrayLike, size: int) -> Array:
    """A copy of finite values, shape (size,).

    Raises:
        CommandError: The size is wrong, or something is no finite number; `what` names the row.
    """
    try:
        row = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise CommandError(what, repr(values), f"{size} numbers") from None
    if row.shape != (size,):
        raise CommandError(what, f"shape {row.shape}", f"shape ({size},)")
    if not all(map(isfinite, row.tolist())):  # for some tens of numbers quicker than an array of bits
        worst = int(np.flatnonzero(~np.isfinite(row))[0])
        raise CommandError(what, f"{row[worst]} at {worst}", "finite numbers")
    return row
