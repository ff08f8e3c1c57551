"""What the null space is used for: scalar objectives over a batch of configurations, and their slopes (section 6.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import ObjectiveError
from vgtsim.positioning.kernel import Blocks, Kernel, State
from vgtsim.positioning.strokes import StrokeBox
from vgtsim.positioning.surroundings import Surroundings

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Configurations:
    """A batch of configurations inside the strokes, with what objectives need of them.

    Attributes:
        kernel: The arm.
        box: Strokes allowed.
        state: Kinematics of b configurations.
        which: Goal of each, shape (b,).
    """

    kernel: Kernel
    box: StrokeBox
    state: State
    which: Index

    @property
    def q(self) -> Array:
        """Inputs, shape (b, n)."""
        return self.state.q

    @property
    def length(self) -> Array:
        """Actuator lengths, shape (b, J), m."""
        return self.state.legs[:, : self.kernel.chain.layout.actuators]


@dataclass(frozen=True)
class Terms:
    """An objective's value and shape; curvatures are positive semidefinite.

    Attributes:
        value: Shape (b,).
        slope: By the inputs, shape (b, n).
        blocks: Curvature by modules, for each kind of shape (b, M, inputs, inputs), or absent.
        dense: Curvature of all inputs, shape (b, n, n), or absent.
        rough: The part of the slope whose curvature is not known and has to be learned, shape (b, n), or absent.
        by_length: Derivative by the actuator lengths, shape (b, J), of what depends on them; absent if nothing does.
    """

    value: Array
    slope: Array
    blocks: Blocks | None = None
    dense: Array | None = None
    rough: Array | None = None
    by_length: Array | None = None


class Objective(Protocol):
    """Anything with a name that gives terms."""

    @property
    def name(self) -> str:
        """For reports."""
        ...

    def terms(self, at: Configurations) -> Terms:
        """Value, slope and curvature."""
        ...


@dataclass(frozen=True)
class StrokeBarrier:
    """-log of the room left in every stroke: zero at mid-stroke, infinite at the ends; it keeps iterates inside."""

    name: str = "stroke_barrier"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        box = at.box
        first, second = box.slopes(at.length)
        return _of_lengths(at, box.barrier(at.length), first, second)


@dataclass(frozen=True)
class MidStroke:
    """Half the sum of squares of every actuator's distance from mid-stroke, in half strokes."""

    name: str = "mid_stroke"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        box = at.box
        half = (box.greatest - box.least) / 2
        away = (at.length - box.least) / half - 1
        value = 0.5 * np.sum(away**2, axis=1)
        return _of_lengths(at, value, away / half, np.broadcast_to(1 / half**2, away.shape))


@dataclass(frozen=True)
class LengthVariation:
    """Sum of the distances of all actuator lengths from their mean (8.8), m.

    Attributes:
        softness: Distance below which the corner of the absolute value is rounded, m.
    """

    softness: float = 1e-3
    name: str = "length_variation"

    def terms(self, at: Configurations) -> Terms:
        """In closed form; curvature by reweighted squares, which bounds it from above."""
        away = at.length - at.length.mean(axis=1, keepdims=True)
        size = np.hypot(away, self.softness)
        rate = away / size
        first = rate - rate.mean(axis=1, keepdims=True)
        weight = np.sqrt(1 / size)
        full = at.kernel.dense(at.state.blocks)[:, : away.shape[1]]
        spread = weight[:, :, None] * (full - full.mean(axis=1, keepdims=True))
        slope = at.kernel.pull(at.state.blocks, first)
        curve = np.swapaxes(spread, 1, 2) @ spread
        return Terms(np.sum(size - self.softness, axis=1), slope, dense=curve, by_length=first)

    @staticmethod
    def exact(length: Array) -> float:
        """Equation 8.8 as printed, m, for the lengths of one configuration, shape (J,)."""
        return float(np.sum(np.abs(length - np.mean(length))))


@dataclass(frozen=True)
class Nearness:
    """Half the sum of squares of the way of every actuator from a previous configuration, in half strokes.

    Attributes:
        previous: Actuator lengths before, of every goal, shape (B, J), or of all, shape (J,), m.
    """

    previous: Array
    name: str = "nearness"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        box = at.box
        half = (box.greatest - box.least) / 2
        before = self.previous.reshape(-1, at.length.shape[1])
        away = (at.length - (before[at.which] if len(before) > 1 else before)) / half
        value = 0.5 * np.sum(away**2, axis=1)
        return _of_lengths(at, value, away / half, np.broadcast_to(1 / half**2, away.shape))


@dataclass(frozen=True)
class Clearance:
    """Squares of hinges that rise when a pair of bodies comes nearer than wanted.

    Attributes:
        surroundings: What to keep clear of.
        wanted: Clearance at which a hinge is 1, m.
        softness: Distance beyond it at which a hinge begins, m.
        payload: Whether the payload's distance from what stands counts; where goal rows hold the tool it is constant.
    """

    surroundings: Surroundings
    wanted: float = 0.12
    softness: float = 0.10
    payload: bool = True
    name: str = "clearance"

    def terms(self, at: Configurations) -> Terms:
        """In closed form, Gauss and Newton's curvature."""
        rows = self.surroundings.rows(at.q, self.wanted + self.softness, payload=self.payload)
        count = at.state.q.shape[1]
        rise = (self.wanted - rows.gap) / self.softness + 1
        value, slope = np.zeros(len(at.which)), np.zeros((len(at.which), count))
        dense = np.zeros((len(at.which), count, count))
        np.add.at(value, rows.config, 0.5 * rise**2)
        for b in np.unique(rows.config):
            mine = rows.config == b
            gradient = rows.gradient[mine] / self.softness
            slope[b], dense[b] = -rise[mine] @ gradient, gradient.T @ gradient
        return Terms(value, slope, dense=dense)


@dataclass(frozen=True)
class Differences:
    """Any function of the inputs, by central differences.

    Attributes:
        name: For reports and errors.
        function: From inputs, shape (b, n), to values, shape (b,), finite inside the strokes.
        step: Of the differences, in units of the inputs.
    """

    name: str
    function: Callable[[Array], Array]
    step: float = 1e-5

    def terms(self, at: Configurations) -> Terms:
        """By 2 n + 1 values for each configuration."""
        q, count = at.q, at.q.shape[1]
        shift = self.step * np.eye(count)
        near = np.concatenate([q[:, None], q[:, None] + shift, q[:, None] - shift], axis=1)
        value = np.asarray(self.function(near.reshape(-1, count)), float)
        if value.shape != (near.shape[0] * near.shape[1],) or not np.all(np.isfinite(value)):
            bad = int(np.sum(~np.isfinite(value))) if value.ndim == 1 else value.size
            raise ObjectiveError(self.name, bad, f"values of shape {value.shape} for inputs of shape {near.shape}")
        value = value.reshape(len(q), -1)
        slope = (value[:, 1 : count + 1] - value[:, count + 1 :]) / (2 * self.step)
        return Terms(value[:, 0], slope, rough=slope)


@dataclass(frozen=True)
class WeightedSum:
    """Objectives added up.

    Attributes:
        parts: Objectives and their weights, greater than zero.
    """

    parts: tuple[tuple[float, Objective], ...]

    @property
    def name(self) -> str:
        """Names and weights."""
        return " + ".join(part.name if weight == 1 else f"{weight:g} {part.name}" for weight, part in self.parts)

    def terms(self, at: Configurations) -> Terms:
        """Weighted sums of everything."""
        found = [(weight, part.terms(at)) for weight, part in self.parts]
        return Terms(
            sum((w * t.value for w, t in found), np.zeros(len(at.which))),
            sum((w * t.slope for w, t in found), np.zeros(at.state.q.shape)),
            _sum_blocks([tuple(w * b for b in t.blocks) for w, t in found if t.blocks is not None]),
            _sum([w * t.dense for w, t in found if t.dense is not None]),
            _sum([w * t.rough for w, t in found if t.rough is not None]),
            _sum([w * t.by_length for w, t in found if t.by_length is not None]),
        )


def values(objective: Objective, at: Configurations) -> Array:
    """Values alone, without the differences that a slope may take.

    Args:
        objective: Any.
        at: Configurations.

    Returns:
        Shape (b,).
    """
    if isinstance(objective, WeightedSum):
        return sum((weight * values(part, at) for weight, part in objective.parts), np.zeros(len(at.which)))
    if isinstance(objective, Differences):
        return np.asarray(objective.function(at.q), float)
    return objective.terms(at).value


def _sum(parts: list[Array]) -> Array | None:
    return sum(parts[1:], parts[0]) if parts else None


def _sum_blocks(parts: list[Blocks]) -> Blocks | None:
    return tuple(np.sum(same, axis=0) for same in zip(*parts, strict=True)) if parts else None


def _of_lengths(at: Configurations, value: Array, first: Array, second: Array) -> Terms:
    """Terms of a sum of functions of one length each."""
    blocks = at.state.blocks
    return Terms(value, at.kernel.pull(blocks, first), at.kernel.curve(blocks, second), by_length=first)
