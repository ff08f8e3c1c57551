"""Poses of the tool by named places of a tank, and the frame of the tool."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_UPRIGHT = 1 - 1e-9  # size of a direction's z from which it has no vertical plane


def tool_frame(direction: ArrayLike) -> Array:
    """Axes x, y, z of the tool's frame in frame G as columns, shape (3, 3), for a unit direction, shape (3,).

    z is the direction. x is upward in the vertical plane of z, y horizontal. Of a vertical tool x is the x axis of frame G.
    """
    z = np.asarray(direction, float)
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < _UPRIGHT else np.array([1.0, 0.0, 0.0])
    x = up - (up @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)
