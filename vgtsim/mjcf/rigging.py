"""What an arm hangs from and carries, and what its parts may touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import Tetrahedral
from vgtsim.kinematics import Chain
from vgtsim.mjcf.contact_bits import contact_bits

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rigging:
    """What the arm hangs from and carries, and how its cylinders are held.

    Attributes:
        mast_diameter: Outer diameter of the mast, m.
        mast_wall: m.
        mast_density: kg/m³.
        mast_length: From the flange up, m.
        feed_range: Lowest and highest position of the mast relative to its working depth, m.
        payload_mass: At the tool point, kg.
        payload_radius: m.
        reference: Inputs of the reference pose, shape (n,): where the model stands when it is reset.
        timestep: Of the simulation, s; it sets the closures' time constants.
        servo_stiffness: N/m.
        servo_damping: N·s/m.
        elastic: Whether each tube is two halves with a spring of stiffness EA/L between them.
        lumped: Whether the members' mass sits in their hubs.
    """

    mast_diameter: float
    mast_wall: float
    mast_density: float
    mast_length: float
    feed_range: tuple[float, float]
    payload_mass: float
    payload_radius: float
    reference: Array
    timestep: float
    servo_stiffness: float
    servo_damping: float
    elastic: bool = False
    lumped: bool = False


def part_bits(chain: Chain, module: int) -> dict[str, int]:
    """Contact bits of a module; a hinge counts with the module below it, whose nodes it shares.

    Args:
        chain: The arm.
        module: Index of the module; -1 for the mast.

    Returns:
        `contype` and `conaffinity`.
    """
    modules = chain.manipulator.modules
    part = module + 1 - sum(isinstance(item, Tetrahedral) for item in modules[: module + 1])
    contype, conaffinity = contact_bits(part, len(modules) + 1)
    return {"contype": contype, "conaffinity": conaffinity}
