"""Where the tool cannot go: how well the task is conditioned, and the directions that are lost (section 6.2.1)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled
from vgtsim.positioning import CONDITION_LIMIT, name_direction

_AXES = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
_CLEAR = 1e3  # condition number up to which squares of singular values are good to ten digits
_ASKED = 1e-3  # part of a wish along a lost direction that is worth a word


@dataclass(frozen=True)
class Mobility:
    """Condition number of the task rows, and the orthonormal directions of the rows that are lost, shape (L, m)."""

    condition: float
    lost: Array

    def refuse(self, wish: Array, rows: Array) -> tuple[Array, tuple[str, ...]]:
        """A wish, shape (m,), without its part along lost directions, and the names of those that it has.

        The task rows are parts of the tool's twist, shape (m, 6).
        """
        if not len(self.lost):
            return wish, ()
        share = self.lost @ wish
        size = float(np.linalg.norm(wish))
        asked = [self.lost[k] @ rows for k in np.flatnonzero(np.abs(share) > _ASKED * size)] if size > 0 else []
        return wish - share @ self.lost, tuple(name_direction(item, _AXES) for item in asked)


def find_mobility(task: Array) -> Mobility:
    """Mobility of task rows by the cylinders, shape (m, J); a radian counts as a metre.

    Source: section 6.2.1: past a condition number of 1e5 the smallest singular values are given up.
    """
    squares = _find_squares(by_rows(task))
    if squares[0] > squares[-1] * _CLEAR**-2:  # the squares tell it well
        return Mobility(sqrt(squares[-1] / squares[0]), np.empty((0, len(task))))
    U, values, _ = np.linalg.svd(task, full_matrices=len(task) > task.shape[1])
    whole = np.zeros(len(task))
    whole[: len(values)] = values
    condition = float(whole[0] / whole[-1]) if whole[-1] > 0 else np.inf
    return Mobility(condition, U[:, whole <= whole[0] / CONDITION_LIMIT].T)


@compiled
def _find_squares(task: Array) -> NDArray[np.floating]:
    """Squares of the singular values of rows, shape (m, J), in rising order, shape (m,)."""
    return np.linalg.eigvalsh(task @ task.T)
