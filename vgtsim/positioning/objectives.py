"""What the null space is used for: scalar objectives over a batch of configurations (section 6.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.errors import ObjectiveError
from vgtsim.kinematics import Chain, State, azimuth
from vgtsim.positioning.rows import measure_strokes
from vgtsim.positioning.strokes import StrokeBox
from vgtsim.positioning.surroundings import Surroundings

_ON_AXIS = 1e-6  # distance from the mast's axis below which a goal has no plane, m
_STEP = 1e-6  # of one-sided differences of closed-form slopes, in units of the inputs: the root of their rounding


@dataclass(frozen=True)
class Configurations:
    """The kinematics of b configurations inside the strokes, and the goal of each, shape (b,)."""

    box: StrokeBox
    state: State
    which: Index

    @property
    def q(self) -> Array:
        """Inputs, shape (b, n)."""
        return self.state.q

    @cached_property
    def length(self) -> Array:
        """Actuator lengths, shape (b, J), m."""
        return np.ascontiguousarray(self.box.lengths(self.state.legs))

    @cached_property
    def strokes(self) -> tuple[Array, Array, Array, Array]:
        """Least spare stroke, m, and the stroke barrier, shape (b,), with its derivatives by the lengths, shape (b, J)."""
        length = self.length
        room, value = np.empty(len(length)), np.empty(len(length))
        first, second = np.empty(length.shape), np.empty(length.shape)
        measure_strokes(length, self.box.least, self.box.greatest, room, value, first, second)
        return room, value, first, second


@dataclass(frozen=True)
class Terms:
    """An objective's value, shape (b,), slope by the inputs, shape (b, n), and known curvature, positive semidefinite.

    Attributes:
        curve: Shape (b, n, n), or absent.
        rough: The part of the slope whose curvature has to be learned, shape (b, n), or absent.
        by_length: Derivative by the actuator lengths, shape (b, J), of the part that depends on them, or absent.
    """

    value: Array
    slope: Array
    curve: Array | None = None
    rough: Array | None = None
    by_length: Array | None = None


class Objective:
    """An objective has a name for reports and gives its terms; the other methods have defaults."""

    name: str

    @property
    def dear(self) -> bool:
        """Whether slopes cost far more than values: trial steps are then judged by values alone."""
        return False

    def terms(self, at: Configurations) -> Terms:
        """Value, slope and known curvature."""
        raise NotImplementedError

    def values(self, at: Configurations) -> Array:
        """Values without slopes, shape (b,)."""
        return self.terms(at).value

    def squares(self, box: StrokeBox) -> tuple[float, Array] | None:  # noqa: ARG002
        """Weight and lengths, shape (B, J) or (1, J), m, of an objective that is half squares of ways from lengths, or none."""
        return None

    def curvature(self, at: Configurations) -> Array | float:
        """Curvature beyond the known part, shape (b, n, n), symmetric and not definite; or zero."""
        del at
        return 0.0


@dataclass(frozen=True)
class StrokeBarrier(Objective):
    """-log of the room left in every stroke: zero at mid-stroke, infinite at the ends; it keeps iterates inside."""

    name: str = "stroke_barrier"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        _, value, first, second = at.strokes
        return _of_lengths(at, value, first, second)

    def squares(self, box: StrokeBox) -> tuple[float, Array]:
        """None: the barrier stands alone."""
        return 0.0, box.least[None]

    def values(self, at: Configurations) -> Array:
        """Without slopes."""
        return at.strokes[1]


@dataclass(frozen=True)
class MidStroke(Objective):
    """Half the sum of squares of every actuator's distance from mid-stroke, in half strokes."""

    name: str = "mid_stroke"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        return _half_square(at, (at.length - at.box.least) / at.box.half - 1)

    def squares(self, box: StrokeBox) -> tuple[float, Array]:
        """From mid-stroke."""
        return 1.0, (box.least + box.greatest)[None] / 2


@dataclass(frozen=True)
class Nearness(Objective):
    """Half the sum of squares of the actuators' distances, in half strokes, from given lengths, shape (B, J) or (J,), m."""

    previous: Array
    name: str = "nearness"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        before = self.previous.reshape(-1, at.length.shape[1])
        return _half_square(at, (at.length - (before[at.which] if len(before) > 1 else before)) / at.box.half)

    def squares(self, box: StrokeBox) -> tuple[float, Array]:
        """From the lengths before."""
        return 1.0, np.array(self.previous.reshape(-1, len(box.least)), float)


@dataclass(frozen=True)
class LengthVariation(Objective):
    """Sum of the distances of all lengths from their mean (8.8), m, with its corners rounded below `softness`, m."""

    softness: float = 1e-3
    name: str = "length_variation"

    def terms(self, at: Configurations) -> Terms:
        """In closed form; curvature by reweighted squares, which bounds it from above."""
        away = at.length - at.length.mean(axis=1, keepdims=True)
        size = np.hypot(away, self.softness)
        rate = away / size
        first = rate - rate.mean(axis=1, keepdims=True)
        full = at.state.leg_slopes[:, : away.shape[1]]
        spread = np.sqrt(1 / size)[:, :, None] * (full - full.mean(axis=1, keepdims=True))
        value, curve = np.sum(size - self.softness, axis=1), np.swapaxes(spread, 1, 2) @ spread
        return Terms(value=value, slope=at.state.pull(first), curve=curve, by_length=first)


@dataclass(frozen=True)
class Differences(Objective):
    """Any function from inputs, shape (b, n), to values, shape (b,); its slope is made of central differences.

    The function is finite inside the strokes. The step, in units of the inputs, is near the cube root of their
    rounding.
    """

    name: str
    function: Callable[[Array], Array]
    step: float = 1e-5

    @property
    def dear(self) -> bool:
        """Slopes take 2 n + 1 values."""
        return True

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
        return Terms(value=value[:, 0], slope=slope, rough=slope)

    def values(self, at: Configurations) -> Array:
        """One value for each configuration."""
        return np.asarray(self.function(at.q), float)


@dataclass(frozen=True)
class WeightedSum(Objective):
    """A sum of objectives with weights greater than zero; its name is made of weights and names."""

    summands: tuple[tuple[float, Objective], ...]
    name: str = field(init=False)

    def __post_init__(self) -> None:
        """Make the name."""
        names = [part.name if weight == 1 else f"{weight:g} {part.name}" for weight, part in self.summands]
        object.__setattr__(self, "name", " + ".join(names))

    @property
    def dear(self) -> bool:
        """As dear as any part."""
        return any(part.dear for _, part in self.summands)

    def terms(self, at: Configurations) -> Terms:
        """Weighted sums of everything."""
        found = [(weight, part.terms(at)) for weight, part in self.summands]
        return Terms(
            value=sum((w * t.value for w, t in found), np.zeros(len(at.which))),
            slope=sum((w * t.slope for w, t in found), np.zeros(at.q.shape)),
            curve=_sum([w * t.curve for w, t in found if t.curve is not None]),
            rough=_sum([w * t.rough for w, t in found if t.rough is not None]),
            by_length=_sum([w * t.by_length for w, t in found if t.by_length is not None]),
        )

    def values(self, at: Configurations) -> Array:
        """Weighted sum of the values."""
        return sum((weight * part.values(at) for weight, part in self.summands), np.zeros(len(at.which)))

    def curvature(self, at: Configurations) -> Array | float:
        """Weighted sum of the curvatures."""
        return sum((weight * part.curvature(at) for weight, part in self.summands), 0.0)


def _sum(parts: list[Array]) -> Array | None:
    return sum(parts[1:], parts[0]) if parts else None


def _half_square(at: Configurations, away: Array) -> Terms:
    """Terms of half the sum of squares of distances in half strokes, shape (b, J)."""
    curve = np.tile(1 / at.box.half**2, (len(away), 1))
    return _of_lengths(at, 0.5 * np.sum(away**2, axis=1), away / at.box.half, curve)


def _of_lengths(at: Configurations, value: Array, first: Array, second: Array) -> Terms:
    """Terms of a sum of functions of one length each."""
    return Terms(value=value, slope=at.state.pull(first), curve=at.state.curve(second), by_length=first)


@dataclass(frozen=True)
class InPlane(Objective):
    """Half the sum of squares of forms on the inputs, shape (r, n), that lead out of a vertical plane.

    Each kind of module names its forms, see `ModuleSet.sideways`.
    """

    across: Array
    name: str = "in_plane"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        q = at.state.q
        parts = q @ self.across.T
        curve = np.broadcast_to(self.across.T @ self.across, (len(q), q.shape[1], q.shape[1]))
        return Terms(value=0.5 * np.sum(parts**2, axis=1), slope=parts @ self.across, curve=curve)


def goal_plane(chain: Chain, position: ArrayLike) -> InPlane:
    """The objective for the plane through the mast's axis and a position in G, shape (3,), m.

    For a position on the axis the objective is zero everywhere.
    """
    point = np.asarray(position, float)
    local, angle = (point - chain.mount[:3, 3]) @ chain.mount[:3, :3], azimuth(chain, point)
    yaws, known = chain.straight_yaws, float(np.hypot(local[0], local[1]) > _ON_AXIS)
    forms = []
    for place in chain.layout.places:
        for m, (columns, yaw) in enumerate(zip(place.columns, yaws[place.active], strict=True)):
            rows = known * place.modules.sideways(m, angle - yaw)
            form = np.zeros((len(rows), chain.layout.inputs))
            form[:, columns] = rows
            forms.append(form)
    return InPlane(np.concatenate([np.empty((0, chain.layout.inputs)), *forms]))


@dataclass(frozen=True)
class ClearanceHinges(Objective):
    """Half the sum of squares of hinges, one for each near pair of bodies.

    A hinge begins `softness`, m, beyond the wanted clearance, m, and is 1 at it. `payload` tells whether the payload's
    distance from all but the arm counts: it is constant where goal rows hold the tool.
    """

    surroundings: Surroundings
    wanted: float = 0.12
    softness: float = 0.10
    payload: bool = True
    name: str = "clearance"

    @property
    def dear(self) -> bool:
        """Slopes take the derivatives of all nodes."""
        return True

    def terms(self, at: Configurations) -> Terms:
        """In closed form, with Gauss and Newton's curvature."""
        rows = self.surroundings.rows(at.state, self.wanted + self.softness, payload=self.payload)
        batch, count = at.q.shape
        rise = self._rise(rows.gap)
        value, slope, curve = np.zeros(batch), np.zeros((batch, count)), np.zeros((batch, count, count))
        np.add.at(value, rows.config, 0.5 * rise**2)
        for b in np.unique(rows.config):
            mine = rows.config == b
            gradient = rows.gradient[mine] / self.softness
            slope[b], curve[b] = -rise[mine] @ gradient, gradient.T @ gradient
        return Terms(value=value, slope=slope, curve=curve)

    def values(self, at: Configurations) -> Array:
        """Values without slopes, shape (b,)."""
        rows = self.surroundings.rows(at.state, self.wanted + self.softness, slopes=False, payload=self.payload)
        value = np.zeros(len(at.q))
        np.add.at(value, rows.config, 0.5 * self._rise(rows.gap) ** 2)
        return value

    def _rise(self, gap: Array) -> Array:
        return (self.wanted - gap) / self.softness + 1

    def curvature(self, at: Configurations) -> Array:
        """Curvature that Gauss and Newton leave out, by differences of slopes, shape (b, n, n).

        A goal near a wall holds the tool and the last nodes: the multipliers of the rows balance the slopes of those
        hinges, so without their curvatures steps along the null space look far too long.
        """
        first = self.terms(at)
        assert first.curve is not None
        found, used = np.zeros_like(first.curve), np.flatnonzero(first.value > 0)
        if not len(used):
            return found
        shift = _STEP * np.eye(first.slope.shape[1])
        moved = (at.q[used, None] + shift).reshape(-1, len(shift))
        there = replace(at, state=at.box.chain.state(moved), which=np.repeat(at.which[used], len(shift)))
        slope = self.terms(there).slope.reshape(len(used), len(shift), -1)
        found[used] = (slope - first.slope[used, None]) / _STEP - first.curve[used]
        return (found + np.swapaxes(found, 1, 2)) / 2
