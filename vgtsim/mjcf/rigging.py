"""What an arm hangs from and carries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Payload
from vgtsim.geometry import MastPipe
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import MemberInertia, make_member_inertia
from vgtsim.mjcf.contact_bits import module_bits

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rigging:
    """An arm with what it hangs from and carries, and how its cylinders are held.

    Attributes:
        chain: The arm on its mount.
        mast: The pipe that it hangs from.
        feed_range: Lowest and highest position of the mast relative to its working depth, m.
        payload: At the tool point.
        reference: Inputs of the reference pose, shape (n,): where the model stands when it is reset.
        timestep: Of the simulation, s; it sets the closures' time constants.
        servo_stiffness: N/m.
        servo_damping: N·s/m.
        elastic: Whether each tube is two halves with a spring of stiffness EA/L between them.
        lumped: Whether the members' mass sits in their hubs.
    """

    chain: Chain
    mast: MastPipe
    feed_range: tuple[float, float]
    payload: Payload
    reference: Array
    timestep: float
    servo_stiffness: float
    servo_damping: float
    elastic: bool = False
    lumped: bool = False

    @cached_property
    def nodes(self) -> Array:
        """Nodes of the reference pose, shape (N, 3), m, in frame G."""
        return self.chain.nodes(self.reference)

    @cached_property
    def inertia(self) -> MemberInertia:
        """Masses of the members as they are simulated."""
        return make_member_inertia(self.chain.manipulator, self.chain.truss, split=self.elastic, lumped=self.lumped)

    def bits(self, module: int) -> dict[str, int]:
        """Contact bits of a module; -1 for the mast."""
        return module_bits(self.chain.manipulator, module)
