"""The rates of one step: a small quadratic programme over the cylinders and the part of the wish that is done.

With rates r, bounds and rows C, the wish v of the task rows A, the part s of it that is done, the way back b to a target, and
rates n that the null space would like, it makes least

    W |A r - s v - b|² + |(r - n) / R|² + w (1 - s)²   for low <= r <= high, C r >= c, 0 <= s <= 1,

R the greatest rates. W is so great that the task is met along its direction, slower where it must be; the rows may be
violated where nothing else is left, so there always is a solution. With no limit in the way it is the particular solution of
least rates and the best homogeneous one (sections 6.3 and 6.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TASK = 1e7  # W in units of the task's speed: a rate in full costs 1
_PART = 1e-3  # w over W |v|²: above what rates cost in poor directions, and far below leaving the task's direction
_SPEED = 0.1  # m/s, of a task that counts one
_SOFT, _BOUND = 8, 0  # daqp's marks of a row that may be violated and of one that may not
_HELD = 1e-6  # of the greatest multiplier: a smaller one holds nothing


@dataclass(frozen=True)
class Rates:
    """Rates of the cylinders, shape (J,), m/s; the part of the wish that they do; signs of active bounds (J,) and rows (R,).

    An active bound is 1 where the greatest rate holds a cylinder and -1 where the least does.
    """

    rates: Array
    part: float
    bounds: Array
    rows: Array


def solve_rates(
    *,
    task: Array,
    wish: Array,
    back: Array,
    liked: Array,
    full: Array,
    low: Array,
    high: Array,
    rows: Array,
    least: Array,
) -> Rates:
    """Solve the programme: task (m, J), wish and back (m,), liked and full rates and bounds (J,), rows (R, J), least (R,)."""
    count = len(full)
    A, v, b = task * (full / _SPEED), wish / _SPEED, back / _SPEED
    size = _TASK * float(v @ v)
    H = np.empty((count + 1, count + 1))
    H[:count, :count] = _TASK * (A.T @ A)
    H[:count, :count].flat[:: count + 1] += 1.0
    H[count, :count] = H[:count, count] = -_TASK * (v @ A)
    H[count, count] = (1 + _PART) * size + 1e-9
    f = np.append(-liked / full - _TASK * (b @ A), _TASK * float(v @ b) - _PART * size)
    C = np.zeros((len(rows), count + 1))
    C[:, :count] = rows * (full / _SPEED)
    lower = np.concatenate([low / full, [0.0], least / _SPEED])
    upper = np.concatenate([high / full, [1.0], np.full(len(rows), 1e30)])
    sense = np.full(len(lower), _BOUND, dtype=np.int32)
    sense[count + 1 :] = _SOFT
    z, _, flag, info = daqp.solve(H, f, C, upper, lower, sense)
    if flag < 1:  # not seen; the arm then slows as it can
        return Rates(np.clip(0.0, low, high), 0.0, np.zeros(count), np.zeros(len(rows)))
    force = np.asarray(info["lam"])
    signs = np.where(np.abs(force) > _HELD * max(float(np.abs(force).max(initial=0.0)), 1.0), np.sign(force), 0.0)
    rates = np.clip(np.asarray(z[:count]) * full, low, high)
    done = float(wish @ (task @ rates - back)) / float(wish @ wish) if size > 0 else 1.0
    return Rates(rates, min(max(done, 0.0), 1.0), signs[:count], signs[count + 1 :])
