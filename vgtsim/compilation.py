"""Functions that are compiled on first use: loops over poses and modules at the speed of machine code.

The code is kept on disk, beside the source or, in an installation that cannot be written to, in the user's cache. It is
good as long as no file changes in the folder of its source and of all compiled functions that the source names. It takes
arrays of doubles stored by rows that may be written to, so that each function is compiled once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numba.core.dispatcher import Dispatcher
from numpy.typing import ArrayLike

from vgtsim.arrays import Array

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """The function, compiled when it is first called; a division by zero gives what NumPy gives."""
    try:
        made = njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither folder can be written to: it is compiled again in every process
        made = njit(error_model="numpy")(function)
    # numba looks at one file alone to tell whether code that was kept is still good
    kept: Any = getattr(getattr(made, "_cache", None), "_cache_file", None)
    if hasattr(kept, "_source_stamp"):
        kept._source_stamp = tuple(_stamp(folder) for folder in sorted(find_folders(made)))
    return cast("Function", made)


def find_folders(function: Any) -> set[Path]:
    """Folders of a compiled function and of all that its file names, and so on."""
    files, left = set(), [function.py_func]
    while left:
        item = left.pop()
        if item.__code__.co_filename not in files:
            files.add(item.__code__.co_filename)
            left += [other.py_func for other in item.__globals__.values() if isinstance(other, Dispatcher)]
    return {Path(file).parent for file in files}


@cache
def _stamp(folder: Path) -> tuple[tuple[str, int, int], ...]:
    """Names, times and sizes of the files in a folder."""
    found = ((path.name, path.stat()) for path in sorted(folder.glob("*.py")))
    return tuple((name, stat.st_mtime_ns, stat.st_size) for name, stat in found)


def by_rows(array: ArrayLike) -> Array:
    """The array as compiled functions take it; a copy where it is not so already."""
    return np.require(array, float, ["C", "W"])
