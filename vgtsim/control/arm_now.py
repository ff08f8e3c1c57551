"""The commanded arm at one instant: its kinematics by the lengths of its cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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

    @cached_property
    def lift(self) -> Array:
        """Least rates of the cylinders per twist of the tool, shape (J, 6); directions that are nearly lost are damped."""
        square = self.jacobian @ self.jacobian.T
        return self.jacobian.T @ np.linalg.inv(square + _DAMPED * np.trace(square) * np.eye(6))

    @property
    def position(self) -> Array:
        """Tool point in frame G, shape (3,), m."""
        return self.state.tool[0][0]

    @property
    def direction(self) -> Array:
        """Outward unit normal of the tip plate in frame G, shape (3,)."""
        return self.state.tool[1][0]
