"""Products of many short vectors, quicker than NumPy's own for a single pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled

Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """Cross products, shape (..., 3), of vectors whose shapes broadcast; the same sums as `numpy.cross`."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    result[..., 0] = ay * bz - az * by
    result[..., 1] = az * bx - ax * bz
    result[..., 2] = ax * by - ay * bx
    return result


@compiled
def cross_into(a: Array, b: Array, out: Array) -> None:
    """Cross product of two vectors, shape (3,), within compiled functions."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


def dot(a: Array, b: Array) -> Array:
    """Scalar products, shape (..., 1), of vectors whose shapes broadcast."""
    return (a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])[..., None]


def quaternions_to(direction: Array) -> Array:
    """Shortest rotations, shape (M, 4), w x y z, that carry z to unit vectors, shape (M, 3); to -z a half turn about x."""
    x, y, z = direction.T
    q = np.stack([1 + z, -y, x, np.zeros(len(z))], axis=-1)
    q[q[:, 0] < 1e-12] = [0.0, 1.0, 0.0, 0.0]  # rounding apart, -z
    return q / np.linalg.norm(q, axis=-1, keepdims=True)
