"""The commanded arm at one instant: its kinematics by the lengths of its cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.kinematics import Chain, State

Array = NDArray[np.float64]

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
    rows, count = jacobian.shape
    lower, left = np.empty((rows, rows)), twist.copy()
    damped = 0.0
    for i in range(rows):
        for k in range(i + 1):
            lower[i, k] = 0.0
            for j in range(count):
                lower[i, k] += jacobian[i, j] * jacobian[k, j]
        damped += _DAMPED * lower[i, i]
    for i in range(rows):  # Cholesky's factor, and the solution with it forward
        lower[i, i] += damped
        for k in range(i + 1):
            for m in range(k):
                lower[i, k] -= lower[i, m] * lower[k, m]
            lower[i, k] = np.sqrt(lower[i, i]) if k == i else lower[i, k] / lower[k, k]
        for k in range(i):
            left[i] -= lower[i, k] * left[k]
        left[i] /= lower[i, i]
    for i in range(rows - 1, -1, -1):
        for k in range(i + 1, rows):
            left[i] -= lower[k, i] * left[k]
        left[i] /= lower[i, i]
    most = 0.0
    for j in range(count):
        rate = 0.0
        for i in range(rows):
            rate += jacobian[i, j] * left[i]
        most = max(most, abs(rate))
    return most
