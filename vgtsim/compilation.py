"""Functions that are compiled on first use: loops over poses and modules at the speed of machine code.

The code is kept on disk, beside the source or, in an installation that cannot be written to, in the user's cache. Numba
looks at one file to tell whether that code is still good, so a compiled function may only call those of its own file.
It takes arrays of doubles stored by rows that may be written to, so that each function is compiled once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """The function, compiled when it is first called; a division by zero gives what NumPy gives."""
    try:
        made = njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither folder can be written to: it is compiled again in every process
        made = njit(error_model="numpy")(function)
    return cast("Function", made)


def by_rows(array: ArrayLike) -> NDArray[np.float64]:
    """The array as compiled functions take it; a copy where it is not so already."""
    return np.require(array, float, ["C", "W"])
