"""Ways on which the mast moves, in time, inside the limits of cylinders and mast.

While the mast is fed the rates of different actuators take turns, and a way that is slow enough everywhere for its sharpest
bend would take twice the time. So a fed way has a speed of its own at each place: see `_pace`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Feed, Slew
from vgtsim.kinematics import Chain
from vgtsim.planning.timing import STEEPEST, SpeedLimits, TimedPath, overrun, ramp_profile, run_ramps

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


_FED_GRID = 2001  # places of a fed path: a centimetre of feed apart
_WINDOW = 9  # places that a speed is averaged over, three times: 0.1 m of 20; wider ones lose time


def time_feed(chain: Chain, spline: BSpline, feed: BSpline, limits: SpeedLimits, mast: Feed) -> TimedPath:
    """Time splines of inputs and of the mast's feed, m, over 0 to 1, inside the limits of cylinders and hoist."""
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    grid = np.linspace(0.0, 1.0, _FED_GRID)
    rates = np.append(limits.rate, mast.rate)
    accelerations = np.append(np.full(len(limits.rate), limits.acceleration), mast.acceleration)
    rows = np.concatenate([chain.lengths(spline(grid)), feed(grid)[:, None]], axis=1)
    speed = 1 / _pace(rows, rates, accelerations)
    reach = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(grid))])
    parameter = make_interp_spline(reach, grid, k=5)
    fraction, duration = ramp_profile(float(reach[-1]), STEEPEST * float(np.max(rates / accelerations)))

    def pull(time: Array) -> Array:
        place = np.clip(parameter(run_ramps(time, fraction) * reach[-1]), 0.0, 1.0)
        return np.concatenate([chain.lengths(spline(place)), feed(place)[:, None]], axis=1)

    time = np.linspace(0.0, 1.0, 4 * _FED_GRID)
    jerks = np.append(limits.jerk, np.inf)  # the mast's own is bounded by its ramps and the windows of `_pace`
    duration *= overrun(pull(time), time[1] * duration, rates, accelerations, jerks)[0]
    return TimedPath(
        curve=spline, parameter=parameter, fraction=fraction, reach=float(reach[-1]), duration=duration, feed=feed
    )


def time_turn(q: Array, first: float, last: float, mast: Slew) -> TimedPath:
    """An arm of inputs, shape (n,), that keeps its shape while the mast turns from an angle to another, rad."""
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    ends, reach = np.array([0.0, 1.0]), abs(last - first) / mast.rate
    fraction, duration = ramp_profile(reach, STEEPEST * mast.rate / mast.acceleration)
    return TimedPath(
        curve=make_interp_spline(ends, np.array([q, q]), k=1),
        parameter=make_interp_spline(reach * ends, ends, k=1),
        fraction=fraction,
        reach=reach,
        duration=duration,
        turn=make_interp_spline(ends, np.array([first, last]), k=1),
    )


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
