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

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled

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
    count, held = len(full), len(rows)
    size = _TASK * float(wish @ wish) / _SPEED**2
    H, f, C = np.empty((count + 1, count + 1)), np.empty(count + 1), np.empty((held, count + 1))
    bounds = np.empty((2, count + 1 + held))
    A = np.empty(task.shape)
    _fill_programme(by_rows(task), wish, back, liked, full, low, high, rows, least, A, H, f, C, bounds)
    sense = np.full(count + 1 + held, _BOUND, dtype=np.int32)
    sense[count + 1 :] = _SOFT
    z, _, flag, info = daqp.solve(H, f, C, bounds[1], bounds[0], sense)
    if flag < 1:  # not seen; the arm then slows as it can
        return Rates(np.clip(0.0, low, high), 0.0, np.zeros(count), np.zeros(len(rows)))
    rates, signs = np.empty(count), np.asarray(info["lam"])
    done = _read_solution(by_rows(z), full, low, high, by_rows(task), wish, back, rates, signs)
    return Rates(rates, min(max(done, 0.0), 1.0) if size > 0 else 1.0, signs[:count], signs[count + 1 :])


@compiled
def _read_solution(
    z: Array, full: Array, low: Array, high: Array, task: Array, wish: Array, back: Array, rates: Array, signs: Array
) -> float:
    """Rates from daqp's unknowns, the signs of its multipliers in place of them, and the part of the wish that is done."""
    most = 1.0
    for k in range(len(signs)):
        most = max(most, abs(signs[k]))
    for k in range(len(signs)):
        signs[k] = np.sign(signs[k]) if abs(signs[k]) > _HELD * most else 0.0
    for j in range(len(rates)):
        rates[j] = min(max(z[j] * full[j], low[j]), high[j])
    along = size = 0.0
    for i in range(len(wish)):
        size += wish[i] * wish[i]
        done = -back[i]
        for j in range(len(rates)):
            done += task[i, j] * rates[j]
        along += wish[i] * done
    return along / size


@compiled
def _fill_programme(
    task: Array,
    wish: Array,
    back: Array,
    liked: Array,
    full: Array,
    low: Array,
    high: Array,
    rows: Array,
    least: Array,
    A: Array,
    H: Array,
    f: Array,
    C: Array,
    bounds: Array,
) -> None:
    """Matrix, slope, rows and bounds of the programme for daqp; rates in parts of the full ones, and then the part done."""
    count, size, turn = len(full), 0.0, 0.0
    for i in range(len(task)):
        size += (wish[i] / _SPEED) ** 2
        turn += wish[i] * back[i] / _SPEED**2
        for j in range(count):
            A[i, j] = task[i, j] * full[j] / _SPEED
    for j in range(count):
        for k in range(j + 1):
            total = 0.0
            for i in range(len(task)):
                total += A[i, j] * A[i, k]
            H[j, k] = H[k, j] = _TASK * total + (1.0 if j == k else 0.0)
        along = across = 0.0
        for i in range(len(task)):
            along += wish[i] / _SPEED * A[i, j]
            across += back[i] / _SPEED * A[i, j]
        H[count, j] = H[j, count] = -_TASK * along
        f[j] = -liked[j] / full[j] - _TASK * across
        bounds[0, j], bounds[1, j] = low[j] / full[j], high[j] / full[j]
    H[count, count] = (1 + _PART) * _TASK * size + 1e-9
    f[count] = _TASK * turn - _PART * _TASK * size
    bounds[0, count], bounds[1, count] = 0.0, 1.0
    for r in range(len(rows)):
        for j in range(count):
            C[r, j] = rows[r, j] * full[j] / _SPEED
        C[r, count] = 0.0
        bounds[0, count + 1 + r], bounds[1, count + 1 + r] = least[r] / _SPEED, 1e30
