"""Targets that move smoothly, whatever a hand does: bounded accelerations, then two first-order filters.

A target's velocity is that of the last filter. The controller moves the target, as far as the arm could follow. So a target
never runs away from an arm that a limit holds, and a new command acts at once. Turns of unit directions, which a controller
needs in every cycle, are compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import expm1, sqrt

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.control.arm_now import ArmNow
from vgtsim.kinematics import cross_into, find_across

Measure = Callable[[Array], float]  # from a change of velocity to the time that it takes at full acceleration, s

_BRAKE = 0.5  # part of the acceleration that a target brakes with: the filters lag behind
_NEAR = 3.0  # 1/s: the last part of a way decays at this rate
_RETURN = 4.0  # 1/s, with which the drift of the arm from its target is taken back
_NOWHERE = 1e-5  # s: a way that takes less at full speed is none
_STILL = 2e-5  # m/s or rad/s: what is left of a velocity is dropped, an acceleration of a ten thousandth of gravity
_ROLLS = 1e-5  # rad/s
_NO_TURN = 1e-12  # rad: a smaller turn is none


@dataclass
class Filter:
    """Velocities of a target, shape (k,): as wanted with bounded acceleration, then after each of two filters."""

    time: float
    raw: Array
    first: Array
    second: Array

    @classmethod
    def start(cls, time: float, velocity: Array) -> Filter:
        """A filter through which a velocity has gone for long."""
        return cls(time, velocity.copy(), velocity.copy(), velocity.copy())

    def advance(self, wanted: Array, measure: Measure, timestep: float) -> None:
        """Follow a wanted velocity for a step, s."""
        needed = measure(wanted - self.raw)
        part, share = min(1.0, timestep / needed) if needed > 0 else 1.0, -expm1(-timestep / self.time)
        _pass_on(wanted, part, share, self.raw, self.first, self.second)

    @property
    def still(self) -> bool:
        """Whether nothing is left of the velocity."""
        return not (self.raw.any() or self.second.any())

    @property
    def left(self) -> Array:
        """The way that is still made if nothing more is wanted, shape (k,)."""
        return self.time * (self.first + self.second)


@compiled
def _pass_on(wanted: Array, part: float, share: float, raw: Array, first: Array, second: Array) -> None:
    """Go a part of the way to what is wanted, and shares of it through both filters, in place; what is left of a rest goes."""
    most = 0.0
    for k in range(len(wanted)):
        raw[k] += part * (wanted[k] - raw[k])
        first[k] += share * (raw[k] - first[k])
        second[k] += share * (first[k] - second[k])
        if wanted[k] != 0.0:
            most = _STILL
        most = max(most, abs(raw[k]), abs(first[k]), abs(second[k]))
    if most < _STILL:
        raw[:] = first[:] = second[:] = 0.0


def approach(way: Array, at_full_speed: float, at_full_acceleration: float) -> Array:
    """Velocity at which a way, shape (k,), is made: as fast as it can still be stopped at its end.

    `at_full_speed` is the time that the way takes, s; `at_full_acceleration` what `Measure` says of the way, s·s.
    """
    if at_full_speed < _NOWHERE:
        return np.zeros_like(way)
    rate = min(1 / at_full_speed, sqrt(2 * _BRAKE / at_full_acceleration), _NEAR)
    return rate * way


@dataclass
class ToolTarget:
    """A pose of the tool that moves: position, m, and direction in frame G, shape (3,); its velocities are twists (6,).

    Speed is in m/s and acceleration in m/s²; a radian counts as a metre. `twist` or `goal` is what is wanted; without both
    the target comes to rest. `roll` tells whether the turn about the tool's axis counts: only while it is asked for.
    """

    position: Array
    direction: Array
    filter: Filter
    speed: float
    acceleration: float
    twist: Array | None = None
    goal: Array | None = None
    roll: bool = False

    def wish(self, arm: ArmNow, most: float, timestep: float) -> tuple[Array, Array, Array]:
        """Rows of the tool's velocity, shape (m, 6), and what they are to be in the coming step, shape (m,), m/s.

        The last result is what is to be added for the arm to come back to the target, shape (m,), m/s. Accelerations are
        bounded by the greatest of a cylinder, m/s², too.
        """

        def measure(change: Array) -> float:
            return max(_size(change) / self.acceleration, arm.ask_most(change) / most)

        wanted = self._want(measure)
        self.filter.advance(wanted, measure, timestep)
        if self.filter.still and not wanted.any():
            self.goal = None  # it is reached; what rounding leaves is not run after
        direction = arm.direction.copy()
        back = _RETURN * np.concatenate([self.position - arm.position, find_turn_between(direction, self.direction)])
        rows = split_twist(direction)
        self.roll = abs(float(self.filter.second[3:] @ direction)) > _ROLLS
        rows = rows if self.roll else rows[:5]
        if not self.filter.second.any() and _size(back) < _STILL:
            back = np.zeros(6)
        return rows, rows @ self.filter.second, rows @ back

    def move(self, twist: Array) -> None:
        """Move the target by a small twist, shape (6,), m and rad."""
        self.position = self.position + twist[:3]
        self.direction = turn(self.direction, twist[3:].copy())

    def give_up(self, back: Array) -> None:
        """Bring the target to the arm where `back`, a twist of `wish`, shape (6,), cannot be done."""
        self.move(-back / _RETURN)

    def _want(self, measure: Measure) -> Array:
        if self.twist is not None:
            size = _size(self.twist)
            return self.twist * min(1.0, self.speed / size) if size else np.zeros(6)
        if self.goal is None:
            return np.zeros(6)
        end = turn(self.direction, self.filter.left[3:])
        way = np.concatenate(
            [self.goal[:3] - self.position - self.filter.left[:3], find_turn_between(end, self.goal[3:])]
        )
        return approach(way, _size(way) / self.speed, measure(way))


@dataclass
class LengthTarget:
    """Lengths of the cylinders that move together, shape (J,), m; `goal` is where to, or None to come to rest.

    Rates of the cylinders have shape (J,), m/s; speed, m/s, and acceleration, m/s², are those of the tool point.
    """

    lengths: Array
    filter: Filter
    rate: Array
    speed: float
    acceleration: float
    goal: Array | None = None

    def wish(self, arm: ArmNow, most: Array, timestep: float) -> tuple[Array, Array]:
        """Velocity of the lengths in the coming step, and what is to be added to come back to the target, shape (J,), m/s.

        Accelerations are bounded by those of the cylinders, shape (J,), m/s², and by that of the tool point.
        """
        lever = arm.jacobian[:3]

        def measure(change: Array) -> float:
            return max(float(np.abs(change / most).max()), _size(lever @ change) / self.acceleration)

        wanted = np.zeros_like(self.lengths)
        if self.goal is not None:
            way = self.goal - self.lengths - self.filter.left
            slowest = max(float(np.abs(way / self.rate).max()), _size(lever @ way) / self.speed)
            wanted = approach(way, slowest, measure(way))
        self.filter.advance(wanted, measure, timestep)
        if self.filter.still and not wanted.any():
            self.goal = None
        back = _RETURN * (self.lengths - arm.lengths)
        if not self.filter.second.any() and np.abs(back).max() < _STILL:
            back = np.zeros_like(back)
        return self.filter.second, back

    def move(self, way: Array) -> None:
        """Move the target by a small way, shape (J,), m."""
        self.lengths = self.lengths + way


def _size(vector: Array) -> float:
    """Norm of a short vector, quicker than NumPy's."""
    return sqrt(float(vector @ vector))


@compiled
def _length(a: Array) -> float:
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@compiled
def find_turn_between(first: Array, second: Array) -> Array:
    """Turn from one unit direction to another about the axis across both, a vector of shape (3,), rad."""
    axis = np.empty(3)
    cross_into(first, second, axis)
    size = _length(axis)
    angle = np.arctan2(size, first[0] * second[0] + first[1] * second[1] + first[2] * second[2])
    if size < _NO_TURN:
        if angle < 1:
            return axis
        find_across(first, axis)  # half a turn: about any axis across
        size = 1.0
    return axis * (angle / size)


@compiled
def turn(direction: Array, by: Array) -> Array:
    """A unit direction turned by a vector, shape (3,), rad."""
    angle = _length(by)
    if angle < _NO_TURN:
        return direction.copy()
    axis, across = by / angle, np.empty(3)
    cross_into(axis, direction, across)
    along = axis[0] * direction[0] + axis[1] * direction[1] + axis[2] * direction[2]
    moved = np.cos(angle) * direction + np.sin(angle) * across + (1 - np.cos(angle)) * along * axis
    return moved / _length(moved)


@compiled
def split_twist(direction: Array) -> Array:
    """Rows of a twist, shape (6, 6): velocity, two turns across a direction, the turn about it."""
    rows = np.zeros((6, 6))
    for k in range(3):
        rows[k, k] = 1.0
        rows[5, 3 + k] = direction[k]
    find_across(direction, rows[3, 3:])
    cross_into(direction, rows[3, 3:], rows[4, 3:])
    return rows
