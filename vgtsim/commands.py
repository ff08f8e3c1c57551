"""Rows of numbers that come from outside, read before anything is done with them."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import CommandError


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


def read_inputs(inputs: ArrayLike, size: int, lengths_at: Callable[[Array], ArrayLike]) -> tuple[Array, Array]:
    """A copy of inputs of an arm, shape (size,), and what a function has as lengths of its cylinders there, shape (J,), m.

    Raises:
        CommandError: The size is wrong, something is not finite, or a module has no posture there.
    """
    q = read_row("inputs", inputs, size)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            there = np.array(lengths_at(q))
    except ValueError as error:
        raise CommandError("inputs", str(error), "inputs that every module can take") from None
    return q, read_row("lengths at these inputs", there, len(there))
