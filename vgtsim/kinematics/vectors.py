"""Products of many short vectors, quicker than NumPy's own for a single pose."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled


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


@compiled
def find_across(direction: Array, out: Array) -> None:
    """A unit vector across a direction, shape (3,), within compiled functions; near ties of its parts are one everywhere."""
    axis, least = np.zeros(3), 0
    for k in range(1, 3):  # the first of equals, on every processor
        if np.rint(1e9 * abs(direction[k])) < np.rint(1e9 * abs(direction[least])):
            least = k
    axis[least] = 1.0
    cross_into(direction, axis, out)
    size = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    for k in range(3):
        out[k] /= size


def quaternions_to(direction: Array) -> Array:
    """Shortest rotations, shape (M, 4), w x y z, that carry z to unit vectors, shape (M, 3); to -z a half turn about x."""
    x, y, z = direction.T
    q = np.stack([1 + z, -y, x, np.zeros(len(z))], axis=-1)
    q[q[:, 0] < 1e-12] = [0.0, 1.0, 0.0, 0.0]  # rounding apart, -z
    return q / np.linalg.norm(q, axis=-1, keepdims=True)
