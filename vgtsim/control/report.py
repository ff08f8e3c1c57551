"""What a step of the controller found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ControlReport:
    """What a person at the controls wants to know. Vectors are in frame G.

    Attributes:
        target_position, target_direction: Where the tool is meant to be, shape (3,), m, and its direction.
        tool_position, tool_direction: The tool by the measured lengths.
        lengths, rates: Wanted lengths of the cylinders and their rates, shape (J,), m and m/s.
        part: Part of the wish that the last step did, 0 to 1.
        held_by: What kept it from more: limits by name, or a contact.
        condition: Condition number of the task; a radian counts as a metre.
        clearance: Least gap of the arm, m, and `nearest` the two bodies; infinite where nothing is within half a metre.
        utilisation: Greatest use of a member or drive at rest, a tenth added for motion, over its limit; `member` has it.
    """

    target_position: Array
    target_direction: Array
    tool_position: Array
    tool_direction: Array
    lengths: Array
    rates: Array
    part: float
    held_by: tuple[str, ...]
    condition: float
    clearance: float
    nearest: str
    utilisation: float
    member: str
