"""The mouth of a riser that stands beside the tank's axis, compiled.

The dome is a part of a sphere and the bore an upright cylinder: where they meet is no circle, but a curve whose height changes
around the bore. A mouth is as in `gaps`; positions are in frame G, m.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled

_STARTS = 12  # places around the rim from which the nearest one is sought: its distance has at most two minima
_STEPS = 12  # of Newton's method, which doubles the right digits at each


@compiled
def hypot(x: float, y: float) -> float:
    """Size of a pair, quicker than the library's, which cares for very great and small numbers."""
    return np.sqrt(x * x + y * y)


@compiled
def find_top(mouth: Array) -> float:
    """Height of the highest place of the rim, m: inside the bore nothing at or above it is near the tank."""
    if mouth[3] == 0 and mouth[4] == 0:
        return mouth[1]
    near = max(hypot(mouth[3], mouth[4]) - mouth[0], 0.0)
    return mouth[2] + np.sqrt(mouth[5] ** 2 - near * near)


@compiled
def _climb(mouth: Array, x: float, y: float, z: float, turn: float) -> tuple[float, float, float]:
    """Product of the directions from the dome's centre to a point and to the rim at an azimuth, and two derivatives."""
    bore, mx, my = mouth[0], mouth[3], mouth[4]
    c, s = np.cos(turn), np.sin(turn)
    square = mouth[5] ** 2 - mx * mx - my * my - bore * bore - 2 * bore * (mx * c + my * s)
    high, change, bend = np.sqrt(square), bore * (mx * s - my * c), bore * (mx * c + my * s)
    over = z - mouth[2]
    value = x * (mx + bore * c) + y * (my + bore * s) + over * high
    slope = bore * (y * c - x * s) + over * change / high
    curve = -bore * (x * c + y * s) + over * (bend / high - change * change / high**3)
    return value, slope, curve


@compiled
def find_rim(mouth: Array, x: float, y: float, z: float, foot: Array) -> float:
    """Distance of a point from the rim, and the nearest point of the rim, shape (3,).

    The rim lies on the dome's sphere, so its nearest point is the one whose direction from the centre is nearest.
    """
    best, turn, step = -np.inf, 0.0, 2 * np.pi / _STARTS
    for k in range(_STARTS):
        value = _climb(mouth, x, y, z, k * step)[0]
        if value > best:
            best, turn = value, k * step
    for _ in range(_STEPS):
        _, slope, curve = _climb(mouth, x, y, z, turn)
        change = -slope / curve if curve < 0 else (step / 4 if slope > 0 else -step / 4)
        turn += min(max(change, -step / 2), step / 2)
        if abs(change) < 1e-15:
            break
    foot[0], foot[1] = mouth[3] + mouth[0] * np.cos(turn), mouth[4] + mouth[0] * np.sin(turn)
    foot[2] = mouth[2] + np.sqrt(mouth[5] ** 2 - foot[0] ** 2 - foot[1] ** 2)
    return np.sqrt((x - foot[0]) ** 2 + (y - foot[1]) ** 2 + (z - foot[2]) ** 2)


@compiled
def enclose_aside(mouth: Array, x: float, y: float, z: float, closed: float) -> tuple[float, int]:
    """Distance from the riser's bore (-2) or rim (-1) where one of them takes the dome's place, or the closed tank's (0)."""
    bore, dome, mx, my, cap = mouth[0], mouth[2], mouth[3], mouth[4], mouth[5]
    u, v = x - mx, y - my
    away = hypot(u, v)
    # the wall of the bore beside the point; on the bore's axis its lowest place, which is farthest from the tank's
    if away > 0:
        wx, wy = mx + bore * u / away, my + bore * v / away
    else:
        wx, wy = mx * (1 + bore / hypot(mx, my)), my * (1 + bore / hypot(mx, my))
    beside = z > dome and z - dome >= np.sqrt(max(cap * cap - wx * wx - wy * wy, 0.0))
    if beside and (away < bore or bore - away > closed):
        return bore - away, -2
    out = np.sqrt(x * x + y * y + (z - dome) ** 2)
    if z > dome and hypot(cap * x / out - mx, cap * y / out - my) < bore:  # its foot on the dome falls into the opening
        return find_rim(mouth, x, y, z, np.empty(3)), -1
    return closed, 0
