"""An arm with the actuator lengths that it may use, and the barrier that keeps a solver inside them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, fill_mid_planes
from vgtsim.positioning.course import Body

_BINDING = 2e-3  # m from the end of its box: such an actuator is called binding; the barrier keeps about a millimetre
_PARTS = 41  # steps of the way to mid-stroke that are tried: each is 2.5 % of it
_SPARE = 0.02  # part of the shortest stroke that starts keep from its ends: at an end itself the barrier is infinite


@dataclass(frozen=True, eq=False)
class StrokeBox:
    """An arm and its least and greatest actuator lengths for a plan, shape (J,), m.

    It is made once: the work that depends on it alone is kept.
    """

    chain: Chain
    least: Array
    greatest: Array

    @cached_property
    def middle(self) -> Array:
        """Inputs with every actuator at the middle of its box, shape (n,)."""
        return self.chain.inputs_from_lengths((self.least + self.greatest) / 2)

    @cached_property
    def body(self) -> Body | None:
        """Of an arm of double octahedra alone what `course` needs."""
        chain, layout = self.chain, self.chain.layout
        if not layout.in_order or layout.places[0].modules.fill is not fill_mid_planes:
            return None
        place = layout.places[0]
        parts = Body(
            flange=chain.flange,
            figures=place.modules.figures,
            straight=place.modules.straight,
            root=chain.root,
            after=layout.after,
            owner=layout.owner,
            place=np.arange(layout.inputs) % place.modules.inputs,
            legs=place.legs,
            columns=place.columns,
            least=self.least,
            greatest=self.greatest,
            middle=self.middle[None],
        )
        stored: tuple[Any, ...] = tuple(np.require(part, requirements=["C", "W"]) for part in parts)
        return Body(*stored)

    @property
    def half(self) -> Array:
        """Half of each stroke, shape (J,), m."""
        return (self.greatest - self.least) / 2

    def lengths(self, legs: Array) -> Array:
        """Actuator lengths, shape (b, J), of the legs of a state, static ones included."""
        return legs[:, : len(self.least)]

    def spare(self, length: Array) -> Array:
        """Distance of each actuator to the nearer end of its box, negative outside, shape (..., J), m."""
        return np.minimum(length - self.least, self.greatest - length)


def make_box(chain: Chain, margin: float) -> StrokeBox:
    """Shrink the strokes of an arm by a margin, m, at both ends.

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
    return StrokeBox(chain, least + margin, greatest - margin)


def spare_strokes(box: StrokeBox, q: Array) -> Array:
    """Least spare stroke of each active module, shape (b, A), m, of inputs (b, n); -inf where it does not assemble."""
    state, layout = box.chain.state(q), box.chain.layout
    spare = box.spare(box.lengths(state.legs))
    owner = np.empty(layout.actuators, dtype=int)
    for place in layout.places:
        owner[place.moving] = np.repeat(place.active, place.modules.actuated.sum(axis=1))
    least = np.stack([spare[:, owner == a].min(axis=1) for a in range(len(layout.names))], axis=1)
    return np.where(state.valid, least, -np.inf)


def inside(box: StrokeBox, q: Array) -> Mask:
    """Which configurations assemble inside the box, shape (b,), of inputs of shape (b, n)."""
    return np.min(spare_strokes(box, q), axis=1) > 0


def bring_inside(box: StrokeBox, q: Array) -> Array:
    """Move inputs, shape (..., n), towards mid-stroke until lengths lie inside the box with a little to spare.

    Modules are moved one by one: a module that is inside stays where it is.
    """
    owner = box.chain.layout.owner
    row = np.asarray(q, float).reshape(-1, len(owner))
    part = np.linspace(0.0, 1.0, _PARTS)[:, None, None]
    trials = (1 - part) * row + part * box.middle
    good = spare_strokes(box, trials.reshape(-1, len(owner))) >= _SPARE * np.min(box.greatest - box.least)
    first = np.argmax(good.reshape(_PARTS, len(row), -1), axis=0)[:, owner]
    return np.take_along_axis(trials, first[None], axis=0)[0].reshape(np.shape(q))


def binding_actuators(box: StrokeBox, q: Array) -> tuple[str, ...]:
    """Names such as `m3/actuator/2 retracted` of the actuators at the ends of their boxes, for inputs of shape (n,)."""
    length, truss = box.chain.state(q[None]).legs[0], box.chain.truss
    names = []
    for j, member in enumerate(truss.actuated):
        name = truss.members[member].name
        if length[j] - box.least[j] < _BINDING:
            names.append(f"{name} retracted")
        elif box.greatest[j] - length[j] < _BINDING:
            names.append(f"{name} extended")
    return tuple(names)
