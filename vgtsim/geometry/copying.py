"""Copies within compiled functions, entry by entry.

An assignment to a slice would bring along the text of an error about shapes, which takes a tenth of all compiling.
"""

from __future__ import annotations

from typing import Any

from vgtsim.compilation import compiled


@compiled
def copy_row(source: Any, out: Any) -> None:
    """Copy a row, shape (n,), into another."""
    for k in range(len(out)):
        out[k] = source[k]


@compiled
def copy_matrix(source: Any, out: Any) -> None:
    """Copy a matrix, shape (n, m), into another."""
    for i in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = source[i, k]
