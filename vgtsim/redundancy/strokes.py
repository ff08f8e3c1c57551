"""The strokes as a barrier: a smooth objective that is least at mid-stroke and infinite at the ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]

_BINDING = 2e-3  # an actuator this near to the end of its box is called binding, m


@dataclass(frozen=True)
class StrokeBox:
    """Actuator lengths the plan may use.

    Attributes:
        least: Shape (A, 3), m.
        greatest: Shape (A, 3), m.
    """

    least: Array
    greatest: Array

    def barrier(self, length: Array) -> Array:
        """Sum of -log(4 (l - least)(greatest - l) / (greatest - least)²) over all actuators.

        Args:
            length: Actuator lengths inside the box, shape (..., A, 3), m.

        Returns:
            Shape (...): zero at mid-stroke, growing without bound towards an end.
        """
        below, above = length - self.least, self.greatest - length
        return -np.sum(np.log(4 * below * above / (self.greatest - self.least) ** 2), axis=(-2, -1))

    def slopes(self, length: Array) -> tuple[Array, Array]:
        """First and second derivatives of the barrier.

        Args:
            length: Actuator lengths inside the box, shape (..., A, 3), m.

        Returns:
            Each shape (..., A, 3), 1/m and 1/m².
        """
        below, above = 1 / (length - self.least), 1 / (self.greatest - length)
        return above - below, above**2 + below**2

    def spare(self, length: Array) -> Array:
        """Distance of each actuator to the nearer end of its box, negative outside, shape (..., A, 3), m."""
        return np.minimum(length - self.least, self.greatest - length)


def make_box(chain: Chain, margin: float) -> StrokeBox:
    """Shrink the strokes of an arm by a margin at both ends.

    Args:
        chain: The arm.
        margin: m.

    Returns:
        The box.
    """
    least, greatest = chain.stroke
    return StrokeBox(least + margin, greatest - margin)


def lengths_inside(chain: Chain, box: StrokeBox, q: Array) -> Array | None:
    """Actuator lengths of a configuration that assembles inside the box.

    Args:
        chain: The arm.
        box: Lengths allowed.
        q: Inputs, shape (A, 3).

    Returns:
        Shape (A, 3), m; None when a module does not assemble or a length leaves the box.
    """
    if np.any(q[..., 0] ** 2 + q[..., 1] ** 2 >= 1):
        return None
    try:
        length = chain.lengths(q)
    except AssemblyError:
        return None
    return length if np.min(box.spare(length)) > 0 else None


def centre(chain: Chain, box: StrokeBox) -> Array:
    """Inputs of the arm with every actuator at the middle of its box, shape (A, 3)."""
    return chain.inputs_from_lengths((box.least + box.greatest) / 2)


def bring_inside(chain: Chain, box: StrokeBox, q: Array) -> Array:
    """Move a configuration towards the centre of the box until it lies inside with a little to spare.

    Args:
        chain: The arm.
        box: Lengths allowed.
        q: Inputs, shape (A, 3).

    Returns:
        Inputs whose lengths are inside the box, shape (A, 3); module by module, so that those inside stay.
    """
    middle = centre(chain, box)
    spare = 0.02 * np.min(box.greatest - box.least)
    result = np.array(q, float)
    for a in range(len(result)):
        for part in np.linspace(0.0, 1.0, 41):
            trial = np.array(middle)
            trial[a] = (1 - part) * q[a] + part * middle[a]
            length = lengths_inside(chain, box, trial)
            if length is not None and np.min(box.spare(length)[a]) >= spare:
                result[a] = trial[a]
                break
    return result


def binding_actuators(chain: Chain, box: StrokeBox, q: Array) -> tuple[str, ...]:
    """Name the actuators at the ends of their boxes.

    Args:
        chain: The arm.
        box: Lengths allowed.
        q: Inputs, shape (A, 3).

    Returns:
        Names such as `m3/actuator/2 retracted`.
    """
    length = chain.lengths(q)
    names = []
    for a, module in enumerate(chain.manipulator.active):
        for i in range(3):
            if length[a, i] - box.least[a, i] < _BINDING:
                names.append(f"{module.name}/actuator/{i + 1} retracted")
            elif box.greatest[a, i] - length[a, i] < _BINDING:
                names.append(f"{module.name}/actuator/{i + 1} extended")
    return tuple(names)
