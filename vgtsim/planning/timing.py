"""From a path to actuator lengths in time, inside the rates and accelerations of the cylinders.

The path's parameter is first replaced by one in which the fastest actuator, relative to its own rate, keeps the same
speed. The greatest rate has corners, so a p-norm of the scaled rates, which is smooth, stands for it. The new parameter
runs from rest to rest with ramps of a fifth-order smooth step in speed, so the acceleration is continuous and starts and
ends at zero. Jerk is bounded too. It matters where the actuator that leads changes on a short path, which never comes to its
full speed: there the corner of the norm is passed within a tenth of a second. A lower power makes the corner wider.

While the mast is fed the rates of different actuators take turns, and a way that is slow enough everywhere for its sharpest
bend would take twice the time. So a fed way has a speed of its own at each place: see `_pace`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Feed, Slew
from vgtsim.kinematics import Chain

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from vgtsim.planning.curve import Curve


_POWERS = (12, 6, 4, 2)  # of the p-norm: with 12, 15 equal rates count 1.25 times one; the others where a path jerks
_STEEPEST = 1.875  # of `run_ramps`: greatest over mean acceleration of a ramp, 15/8
# Of the squared acceleration over the rate. The ramp of a path takes 1.64 if one actuator leads all the way; four are usual.
_JERK = 5.0
_BENDS = 6  # where bends count too; with 4 paths that go to and fro take 3 % longer, with 12 as much and jerk
_SLOWED = 2.0  # times the time that rates and ramps ask: other speeds may be faster, then; the shipped scenes' tours take 1.63
_GRID = 801  # points of the path at which speeds are measured
_MISSED = 1.1  # of the acceleration limit: more than this was missed between the points of time; paths without turns have 0.99
_SPARE = 1.005  # margin on the time for peaks between the points of the grid
_FED_GRID = 2001  # places of a fed path: a centimetre of feed apart
_WINDOW = 9  # places that a speed is averaged over, three times: 0.1 m of 20; wider ones lose time


@dataclass(frozen=True)
class SpeedLimits:
    """Greatest speed of each actuator, shape (J,), m/s, and greatest acceleration of any actuator, m/s²."""

    rate: Array
    acceleration: float

    @property
    def jerk(self) -> Array:
        """Greatest jerk of each actuator, shape (J,), m/s³: five times acceleration over the time to full rate."""
        return _JERK * self.acceleration**2 / self.rate


def make_limits(chain: Chain, rate_fraction: float, acceleration: float) -> SpeedLimits:
    """Limits of an arm's cylinders: a fraction of their rated speeds, and an acceleration, m/s²."""
    truss, cylinders = chain.truss, chain.manipulator.cylinders
    rates = [rate_fraction * cylinders[truss.members[i].section].rate for i in truss.actuated]
    return SpeedLimits(np.array(rates), acceleration)


@dataclass(frozen=True)
class TimedPath:
    """A curve of inputs over 0 to 1 with its way in time, from rest to rest.

    Attributes:
        parameter: The curve's parameter over the way, 0 to `reach` seconds at full speed.
        fraction: Part of the time spent in each ramp.
        duration: s; 0 of a path on which no actuator moves.
        feed: Height of the mast above its working depth, m, over the curve's parameter; absent while it is held.
        turn: Of the mast about its axis, rad, likewise.
    """

    curve: BSpline | Curve
    parameter: BSpline | None
    fraction: float
    reach: float
    duration: float
    feed: BSpline | None = None
    turn: BSpline | None = None

    def inputs(self, timestep: float) -> Array:
        """Inputs at every time step, s, the ends of the path included, shape (T, n)."""
        return self.curve(self._places(timestep))

    def mast(self, timestep: float) -> tuple[Array | None, Array | None]:
        """Heights of the mast above its working depth, m, and turns, rad, at the same instants, (T,); None while it is held."""
        places = self._places(timestep)
        return self.feed and self.feed(places), self.turn and self.turn(places)

    def _places(self, timestep: float) -> Array:
        """The curve's parameter at every time step, shape (T,)."""
        if self.parameter is None:
            return np.array([0.0, 1.0])
        count = max(2, int(np.ceil(self.duration / timestep)))
        travelled = run_ramps(np.linspace(0.0, 1.0, count + 1), self.fraction) * self.reach
        return np.clip(self.parameter(travelled), 0.0, 1.0)


def time_path(chain: Chain, curve: BSpline | Curve, limits: SpeedLimits) -> TimedPath:
    """Time a curve of inputs over 0 to 1.

    Source: the project's own; the dissertation gives configurations and no motion in time.
    """
    parameter = np.linspace(0.0, 1.0, _GRID)
    rates = chain.length_rates(curve(parameter), curve(parameter, 1)) / limits.rate
    if np.max(_find_norm(rates, _POWERS[0])) * limits.rate.max() < 1e-9:
        return TimedPath(curve=curve, parameter=None, fraction=0.5, reach=0.0, duration=0.0)
    norms = (_find_norm(rates, power) for power in _POWERS)
    ramp = _STEEPEST * float(np.max(limits.rate)) / limits.acceleration
    tried = []
    for speed in (*norms, _slow_at_bends(rates, limits)):
        speed = np.maximum(speed, 1e-3 * np.max(speed))  # finite changes of the parameter where hardly anything moves
        most = limits.rate, limits.acceleration, limits.jerk
        timed, slowed = _time_by_speed(chain, curve, speed, ramp, most)
        missed = _find_acceleration(timed, rates * limits.rate, speed) > _MISSED * limits.acceleration
        if not (tried or slowed or missed):
            return timed
        tried.append((missed, timed.duration, timed))
    return min(tried, key=lambda way: way[:2])[2]


def time_feed(chain: Chain, spline: BSpline, feed: BSpline, limits: SpeedLimits, mast: Feed) -> TimedPath:
    """Time splines of inputs and of the mast's feed, m, over 0 to 1, inside the limits of cylinders and hoist."""
    grid = np.linspace(0.0, 1.0, _FED_GRID)
    rates = np.append(limits.rate, mast.rate)
    accelerations = np.append(np.full(len(limits.rate), limits.acceleration), mast.acceleration)
    rows = np.concatenate([chain.lengths(spline(grid)), feed(grid)[:, None]], axis=1)
    jerks = np.append(limits.jerk, np.inf)  # the mast's own is bounded by its ramps and the windows of `_pace`
    ramp = _STEEPEST * float(np.max(rates / accelerations))
    speed = 1 / _pace(rows, rates, accelerations)
    return _time_by_speed(chain, spline, speed, ramp, (rates, accelerations, jerks), feed)[0]


def time_turn(q: Array, first: float, last: float, mast: Slew) -> TimedPath:
    """An arm of inputs, shape (n,), that keeps its shape while the mast turns from an angle to another, rad."""
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    ends, reach = np.array([0.0, 1.0]), abs(last - first) / mast.rate
    fraction, duration = _ramp_profile(reach, _STEEPEST * mast.rate / mast.acceleration)
    return TimedPath(
        curve=make_interp_spline(ends, np.array([q, q]), k=1),
        parameter=make_interp_spline(reach * ends, ends, k=1),
        fraction=fraction,
        reach=reach,
        duration=duration,
        turn=make_interp_spline(ends, np.array([first, last]), k=1),
    )


def _time_by_speed(
    chain: Chain,
    curve: BSpline | Curve,
    speed: Array,
    ramp: float,
    most: tuple[Array, Array | float, Array],
    feed: BSpline | None = None,
) -> tuple[TimedPath, bool]:
    """The curve in time, and whether its jerk had to be brought down or it became much slower than its rates ask.

    Given are the time over the curve's parameter, shape (P,), s, at full speed, the ramp, s, and greatest rates, accelerations
    and jerks.
    """
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    reach = _add_up(speed)
    parameter = make_interp_spline(reach, np.linspace(0.0, 1.0, len(speed)), k=5)
    fraction, duration = _ramp_profile(float(reach[-1]), ramp)
    time = np.linspace(0.0, 1.0, 4 * len(speed))
    place = np.clip(parameter(run_ramps(time, fraction) * reach[-1]), 0.0, 1.0)
    rows = chain.lengths(curve(place))
    if feed is not None:
        rows = np.concatenate([rows, feed(place)[:, None]], axis=1)
    factor, jerks = _overrun(rows, float(time[1]) * duration, *most)
    timed = TimedPath(
        curve=curve,
        parameter=parameter,
        fraction=fraction,
        reach=float(reach[-1]),
        duration=duration * factor,
        feed=feed,
    )
    return timed, jerks or factor > _SLOWED


def _add_up(speed: Array) -> Array:
    """Time from the start of the curve to each point of its grid, shape (P,), s."""
    steps = (speed[1:] + speed[:-1]) / 2 * np.diff(np.linspace(0.0, 1.0, len(speed)))
    return np.concatenate([[0.0], np.cumsum(steps)])


def _find_acceleration(timed: TimedPath, rates: Array, speed: Array) -> float:
    """Greatest acceleration, m/s², of a path between the points of the curve's grid.

    Where a path goes back the way that it came, all of its turn may lie between two points of a grid in time.
    """
    even = np.linspace(0.0, 1.0, 4 * _GRID)
    share = np.interp(_add_up(speed) / timed.reach, run_ramps(even, timed.fraction), even)
    full = timed.reach / (timed.duration * (1 - timed.fraction))  # seconds of the way in a second
    shown = rates * (full * _run_up(share, timed.fraction) / speed)[:, None]
    return float(np.max(np.abs(np.diff(shown, axis=0)) / (np.diff(share) * timed.duration)[:, None]))


def _slow_at_bends(rates: Array, limits: SpeedLimits) -> Array:
    """Time over the curve's parameter, shape (P,), s, that is long enough where an actuator turns back, too.

    There its speed is zero, and its acceleration is its second derivative over the square of that time. The norm of all is
    smooth; the greatest of them has corners, where all actuators would change their acceleration at once.
    """
    bend = np.gradient(rates * limits.rate, 1 / (len(rates) - 1), axis=0)
    slow = np.sqrt(np.abs(bend) / limits.acceleration)
    return _find_norm(np.column_stack([rates, slow]), _BENDS)


def _pace(rows: Array, rates: Array, accelerations: Array) -> Array:
    """Speed of the parameter, shape (P,), 1/s, at places evenly spread over 0 to 1, for lengths there, shape (P, C), m.

    It is what rates and half the accelerations allow in a bend; the other half is left for changes of the speed. The least
    speed of a window stands for each place and is then averaged over the window, so that the speed is smooth.
    """
    from scipy.ndimage import minimum_filter1d, uniform_filter1d  # slow to load

    step = 1 / (len(rows) - 1)
    slope = np.abs(np.gradient(rows, step, axis=0))
    bend = np.abs(np.gradient(np.gradient(rows, step, axis=0), step, axis=0))
    tiny = 1e-9 * np.ptp(rows, axis=0).max()
    fastest = np.min(rates / (slope + tiny), axis=1)
    square = np.minimum(fastest**2, np.min(accelerations / 2 / (bend + tiny), axis=1))
    climb = np.min(accelerations / (slope + tiny), axis=1) * step  # of the squared speed, from place to place
    for order in (range(1, len(square)), range(len(square) - 2, -1, -1)):
        back = -1 if order.step > 0 else 1
        for i in order:
            square[i] = min(square[i], square[i + back] + climb[i])
    least = minimum_filter1d(np.sqrt(square), 3 * _WINDOW, mode="nearest")
    for _ in range(3):
        least = uniform_filter1d(least, _WINDOW, mode="nearest")
    return least


def time_lengths(chain: Chain, curve: BSpline | Curve, limits: SpeedLimits, timestep: float) -> Array:
    """Actuator lengths, shape (T, J), m, along a curve of inputs over 0 to 1, at every time step, s, from rest to rest.

    The first and last rows are those of the path's ends. Each row is computed from the inputs at its instant.
    """
    return chain.lengths(time_path(chain, curve, limits).inputs(timestep))


def _find_norm(rates: Array, power: int) -> Array:
    """Norm of the actuators' speeds over their limits, shape (P, J), of an even power, shape (P,)."""
    return np.sum(rates**power, axis=1) ** (1 / power)


def _ramp_profile(reach: float, ramp: float) -> tuple[float, float]:
    """Fraction of the time spent in each ramp, and the time, s, to cover `reach` seconds of full speed."""
    if reach >= ramp:
        return ramp / (reach + ramp), reach + ramp
    return 0.5, 2 * float(np.sqrt(reach * ramp))


def run_ramps(time: ArrayLike, fraction: float) -> Array:
    """Part of the way covered at a part of the time, both 0 to 1: speed 10 x³ - 15 x⁴ + 6 x⁵ in the ramps."""
    t = np.asarray(time, float)
    x = _find_ramp(t, fraction)
    ramp = fraction * (2.5 * x**4 - 3 * x**5 + x**6)
    rest = np.maximum(np.minimum(t, 1 - t) - fraction, 0.0)
    half = (ramp + rest) / (1 - fraction)
    return np.where(t <= 0.5, half, 1 - half)


def _run_up(time: Array, fraction: float) -> Array:
    """Speed of `run_ramps` at a part of the time, of full speed."""
    x = _find_ramp(time, fraction)
    return 10 * x**3 - 15 * x**4 + 6 * x**5


def _find_ramp(time: Array, fraction: float) -> Array:
    """Part of the ramp that is run at a part of the time, 1 between the ramps."""
    return np.clip(np.minimum(time, 1 - time) / fraction, 0.0, 1.0)


def _overrun(rows: Array, step: float, rates: Array, accelerations: Array | float, jerks: Array) -> tuple[float, bool]:
    """Factor on the time that brings rows of lengths, shape (T, C), m, a step apart, s, inside their limits, shape (C,).

    The second value tells whether it is the jerk that asks for most.
    """
    too_fast = float(np.max(np.abs(np.diff(rows, axis=0)) / step / rates))
    too_hard = float(np.sqrt(np.max(np.abs(np.diff(rows, n=2, axis=0)) / step**2 / accelerations)))
    too_sudden = float(np.cbrt(np.max(np.abs(np.diff(rows, n=3, axis=0)) / step**3 / jerks)))
    return _SPARE * max(too_fast, too_hard, too_sudden), too_sudden > max(too_fast, too_hard)
