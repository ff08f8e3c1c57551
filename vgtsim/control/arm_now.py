"""The commanded arm at one instant: its kinematics by the lengths of its cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.kinematics import Chain, State
from vgtsim.positioning.elimination import apply_row, factorise, find_greatest, multiply_across, solve_by_factors

_DAMPED = 1e-6  # of the sum of squared singular values: a thousandth of the greatest is still followed


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
