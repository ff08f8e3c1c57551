"""The state of a plant between two steps, as those who command it see it."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vgtsim.plant.recorder import Contact

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PlantState:
    """A plant at one instant; N nodes, J cylinders. Vectors are in frame G.

    Positions and speeds are those at `time`, the end of the last step. Forces are those that acted during it.

    Attributes:
        time: Time since the reset, s.
        commanded: Lengths asked for at this instant, shape (J,), m.
        lengths, rates: Actual lengths and speeds of the cylinders, shape (J,), m and m/s.
        nodes: Positions of the nodes, shape (N, 3), m.
        tool_position: Tool point, shape (3,), m.
        tool_rotation: Rotation of frame T of the tip plate, shape (3, 3).
        drive_force: Force of each drive on its rod, tension positive, shape (J,), N.
        speed: Greatest speed of a node along an axis, m/s.
        calm: Whether the arm has come to rest: slower than the scene's `settle_speed`, an elastic arm for a whole period
            of its slowest mode, since the command last changed.
        contacts: Contacts during the last call of `Plant.step`.
        stopped: Why the plant has stopped for good, or an empty string.
    """

    time: float
    commanded: Array
    lengths: Array
    rates: Array
    nodes: Array
    tool_position: Array
    tool_rotation: Array
    drive_force: Array
    speed: float
    calm: bool
    contacts: tuple[Contact, ...]
    stopped: str

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def tool_direction(self) -> Array:
        """Direction of the tool, shape (3,), unit."""
        return self.tool_rotation[:, 2]
