"""The distance between two segments, and copies entry by entry, for compiled functions.

An assignment to a slice would bring along the text of an error about shapes, which takes a tenth of all compiling.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled

TOUCHING = 1e-9  # m: below this distance two axes have no direction from one to the other


@compiled
def find_between(a0: Array, a1: Array, b0: Array, b1: Array) -> tuple[float, float, float]:
    """Least distance between two segments, and where on each, see `segment_distance`."""
    ux, uy, uz = a1[0] - a0[0], a1[1] - a0[1], a1[2] - a0[2]
    vx, vy, vz = b1[0] - b0[0], b1[1] - b0[1], b1[2] - b0[2]
    wx, wy, wz = a0[0] - b0[0], a0[1] - b0[1], a0[2] - b0[2]
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    s = _share(uv * vw - vv * uw, uu * vv - uv * uv)
    t = _share(uv * s + vw, vv)
    s = _share(uv * t - uw, uu)
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return np.sqrt(x * x + y * y + z * z), s, t


@compiled
def _share(numerator: float, denominator: float) -> float:
    """Quotient clipped to [0, 1]; zero where the denominator vanishes."""
    return min(max(numerator / denominator, 0.0), 1.0) if denominator > 0 else 0.0


@compiled
def copy_row(source: Any, out: Any) -> None:
    """Copy a row, shape (n,), into another."""
    for k in range(len(out)):
        out[k] = source[k]


@compiled
def copy_matrix(source: Any, out: Any) -> None:
    """Copy a matrix, shape (n, m), into another."""
    for i in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[i, k] = source[i, k]
