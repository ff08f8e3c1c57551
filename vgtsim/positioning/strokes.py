"""The strokes as a barrier: a smooth objective that is least at mid-stroke and infinite at the ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.positioning.kernel import Kernel

Array = NDArray[np.float64]

_BINDING = 2e-3  # an actuator this near to the end of its box is called binding, m
_PARTS = 41  # tried of the way from a configuration to the centre


@dataclass(frozen=True)
class StrokeBox:
    """Actuator lengths the plan may use.

    Attributes:
        least: Shape (J,), m.
        greatest: Shape (J,), m.
    """

    least: Array
    greatest: Array

    def barrier(self, length: Array) -> Array:
        """Sum of -log(4 (l - least)(greatest - l) / (greatest - least)²) over all actuators.

        Args:
            length: Actuator lengths inside the box, shape (..., J), m.

        Returns:
            Shape (...): zero at mid-stroke, growing without bound towards an end.
        """
        below, above = length - self.least, self.greatest - length
        return -np.sum(np.log(4 * below * above / (self.greatest - self.least) ** 2), axis=-1)

    def slopes(self, length: Array) -> tuple[Array, Array]:
        """First and second derivatives of the barrier.

        Args:
            length: Actuator lengths inside the box, shape (..., J), m.

        Returns:
            Each shape (..., J), 1/m and 1/m².
        """
        below, above = 1 / (length - self.least), 1 / (self.greatest - length)
        return above - below, above**2 + below**2

    def spare(self, length: Array) -> Array:
        """Distance of each actuator to the nearer end of its box, negative outside, shape (..., J), m."""
        return np.minimum(length - self.least, self.greatest - length)


def make_box(chain: Chain, margin: float) -> StrokeBox:
    """Shrink the strokes of an arm by a margin at both ends.

    Args:
        chain: The arm.
        margin: m.

    Returns:
        The box.

    Raises:
        DescriptionError: The margins leave nothing of a stroke; the actuator is named.
    """
    least, greatest = chain.stroke
    stroke = greatest - least
    shortest = int(np.argmin(stroke))
    if 2 * margin >= stroke[shortest]:
        name = chain.truss.members[chain.truss.actuated[shortest]].name
        allowed = f"less than {stroke[shortest] / 2:.4g} m, half the stroke of {name}"
        raise DescriptionError(None, "motion.stroke_margin", f"{margin:.4g} m", allowed)
    return StrokeBox(least + margin, greatest - margin)


def room(kernel: Kernel, box: StrokeBox, q: Array) -> Array:
    """Least spare stroke of every active module.

    Args:
        kernel: The arm.
        box: Lengths allowed.
        q: Inputs, shape (b, n).

    Returns:
        Shape (b, A), m; minus infinity for a module that does not assemble.
    """
    state, layout = kernel.state(q), kernel.chain.layout
    spare = box.spare(state.legs[:, : layout.actuators])
    owner = np.empty(layout.actuators, dtype=int)
    for place in layout.places:
        mine = np.arange(len(layout.names))[place.active]
        owner[place.lengths[place.modules.actuated]] = np.repeat(mine, place.modules.actuated.sum(axis=1))
    least = np.stack([spare[:, owner == a].min(axis=1) for a in range(len(layout.names))], axis=1)
    return np.where(state.valid, least, -np.inf)


def inside(kernel: Kernel, box: StrokeBox, q: Array) -> NDArray[np.bool_]:
    """Which configurations assemble inside the box, shape (b,), of inputs of shape (b, n)."""
    return np.min(room(kernel, box, q), axis=1) > 0


def centre(chain: Chain, box: StrokeBox) -> Array:
    """Inputs of the arm with every actuator at the middle of its box, shape (n,)."""
    return chain.inputs_from_lengths((box.least + box.greatest) / 2)


def bring_inside(chain: Chain, box: StrokeBox, q: Array) -> Array:
    """Move a configuration towards the centre of the box until it lies inside with a little to spare.

    Args:
        chain: The arm.
        box: Lengths allowed.
        q: Inputs, shape (..., n).

    Returns:
        Inputs whose lengths are inside the box, shape (..., n); module by module, so that those inside stay.
    """
    kernel, owner = Kernel(chain), chain.layout.owner
    row, middle = np.asarray(q, float).reshape(-1, len(owner)), centre(chain, box)
    part = np.linspace(0.0, 1.0, _PARTS)[:, None, None]
    trials = (1 - part) * row + part * middle
    good = room(kernel, box, trials.reshape(-1, len(owner))) >= 0.02 * np.min(box.greatest - box.least)
    first = np.argmax(good.reshape(_PARTS, len(row), -1), axis=0)[:, owner]
    found = np.take_along_axis(trials, first[None], axis=0)[0]
    return found.reshape(np.shape(q))


def binding_actuators(chain: Chain, box: StrokeBox, q: Array) -> tuple[str, ...]:
    """Name the actuators at the ends of their boxes.

    Args:
        chain: The arm.
        box: Lengths allowed.
        q: Inputs, shape (n,).

    Returns:
        Names such as `m3/actuator/2 retracted`.
    """
    length, limits = Kernel(chain).state(q[None]).legs[0], box
    names = []
    for j, member in enumerate(chain.truss.actuated):
        name = chain.truss.members[member].name
        if length[j] - limits.least[j] < _BINDING:
            names.append(f"{name} retracted")
        elif limits.greatest[j] - length[j] < _BINDING:
            names.append(f"{name} extended")
    return tuple(names)
