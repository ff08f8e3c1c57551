"""The commanded arm at one instant: its kinematics by the lengths of its cylinders, and where the tool cannot go."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled
from vgtsim.kinematics import Chain, State
from vgtsim.positioning import CONDITION_LIMIT, name_direction
from vgtsim.positioning.elimination import apply_row, factorise, find_greatest, multiply_across, solve_by_factors

_DAMPED = 1e-6  # of the sum of squared singular values: a thousandth of the greatest is still followed
_AXES = ("x", "y", "z", "turn about x", "turn about y", "turn about z")
_CLEAR = 1e3  # condition number up to which squares of singular values are good to ten digits
_ASKED = 1e-3  # part of a wish along a lost direction that is worth a word


@dataclass(frozen=True, eq=False)
class ArmNow:
    """An arm of n inputs and J cylinders in one posture: a state of one row."""

    chain: Chain
    state: State

    @property
    def q(self) -> Array:
        """Inputs, shape (n,)."""
        return self.state.q[0]

    @property
    def lengths(self) -> Array:
        """Lengths of the cylinders, shape (J,), m."""
        return self.state.lengths[0]

    @cached_property
    def inputs_by_length(self) -> Array:
        """Rates of the inputs per rate of each cylinder, shape (n, J), 1/m or rad/m; raises `SingularPoseError`."""
        return self.chain.input_rates(self.state)[0]

    @cached_property
    def jacobian(self) -> Array:
        """Velocity of the tool point over angular velocity of the tip plate per rate of each cylinder, shape (6, J)."""
        return self.state.tool_jacobian[0] @ self.inputs_by_length

    def ask_most(self, twist: Array) -> float:
        """Greatest of the least rates of the cylinders, m/s, for a twist of the tool, shape (6,); see `_ask_most`."""
        return _ask_most(self.jacobian, twist)

    @property
    def position(self) -> Array:
        """Tool point in frame G, shape (3,), m."""
        return self.state.tool[0][0]

    @property
    def direction(self) -> Array:
        """Outward unit normal of the tip plate in frame G, shape (3,)."""
        return self.state.tool[1][0]


@compiled
def _ask_most(jacobian: Array, twist: Array) -> float:
    """Greatest of J'(J J' + d I)^-1 t, for J of shape (6, J) and t of shape (6,): nearly lost directions are damped by d."""
    square, left, rates = np.empty((6, 6)), twist.copy(), np.empty(jacobian.shape[1])
    multiply_across(jacobian, jacobian, square)
    damped = _DAMPED * np.trace(square)
    for i in range(6):
        square[i, i] += damped
    factorise(square)
    solve_by_factors(square, left)
    apply_row(left, jacobian, rates)
    return find_greatest(rates)


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
