"""Kinematics of a chain under the names that positioning has for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.state import Blocks, State, cross

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kernel:
    """An arm, ready for batches.

    Attributes:
        chain: The arm.
    """

    chain: Chain

    @property
    def static(self) -> Array:
        """Lengths that the static legs have, shape (S,), m."""
        return self.chain.layout.static

    def state(self, q: Array) -> State:
        """As `Chain.state`."""
        return self.chain.state(q)


__all__ = ["Blocks", "Kernel", "State", "cross"]
