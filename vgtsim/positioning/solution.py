"""The solution of a batch of goals, or of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Index, Mask


@dataclass(frozen=True)
class Solution:
    """Configurations that a solver ended with, met or not. Shapes are for a batch of B; `pick` takes one out.

    Attributes:
        q: Inputs, shape (B, n).
        error: Goal rows, reached less desired, shape (B, m), m and rad.
        value: Objective with the stroke barrier, shape (B,).
        iterations: Shape (B,); over all starts of a goal.
        met: Whether all rows are within tolerance, shape (B,).
        stationarity: Norm of the objective's slope in the null space, over 1 + that of the whole slope, shape (B,).
        optimal: Whether the goal is met, the promise small and the curvature definite, shape (B,): a local minimum.
        clearance: Least clearance, shape (B,), m; infinite when none was asked for.
        nearest: Name of the nearest body, shape (B,); empty when no clearance was asked for.
        notes: Facts that the method tells, by name; a batch has an array of them, or the same for all.
    """

    q: Array
    error: Array
    value: Array
    iterations: Index
    met: Mask
    stationarity: Array
    optimal: Mask
    clearance: Array | float = np.inf
    nearest: Any = ""
    notes: Any = field(default_factory=dict)

    def pick(self, which: int | np.integer | slice | Index | Mask) -> Solution:
        """One solution, without the batch dimension, or some of them; copied."""
        parts = (getattr(self, item.name) for item in fields(self))
        return Solution(*(np.array(part[which])[()] if isinstance(part, np.ndarray) else part for part in parts))

    def put(self, where: Index | Mask, source: Solution, which: Index | Mask | slice = slice(None)) -> None:
        """Overwrite some solutions by some of a source; the number of iterations stays."""
        for name in ("q", "error", "value", "met", "stationarity", "optimal"):
            getattr(self, name)[where] = getattr(source, name)[which]


def join_solutions(parts: Sequence[Solution]) -> Solution:
    """One batch of several."""
    columns = ([getattr(part, item.name) for part in parts] for item in fields(Solution))
    return Solution(*(np.concatenate(same) if isinstance(same[0], np.ndarray) else same[0] for same in columns))


def make_column(notes: Sequence[dict[str, Any]]) -> NDArray[np.object_]:
    """Notes of each solution of a batch."""
    column = np.empty(len(notes), object)
    column[:] = notes
    return column
