"""Face triangles of modules: corners from sides, and the frame that sits on three corners.

A face's corners come as first, second, third. Its frame has its origin at the centroid, X along first - third
and Z along (first - third) x (second - third) (equations 3.15 to 3.19), so seen from +Z the corners run
counter-clockwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError

Array = NDArray[np.float64]


def triangle_nodes(sides: ArrayLike) -> Array:
    """Corners of a triangle in its own frame, shape (..., 3 corners, 3), m; all z are zero.

    Sides are first-second, second-third, third-first, shape (..., 3), m.

    Raises:
        AssemblyError: The sides do not form a triangle; the residual is the excess of the longest side.
    """
    s = np.asarray(sides, float)
    excess = 2 * np.max(s, axis=-1) - np.sum(s, axis=-1)
    if np.any(~(excess < 0)) or np.any(s <= 0):
        worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
        raise AssemblyError("face triangle", float(np.max(excess)), f"sides {np.array2string(s[worst], precision=4)} m")
    return place_triangle(s)


def place_triangle(sides: Array) -> Array:
    """As `triangle_nodes`, but with corners that are not numbers where the sides do not close."""
    s = sides
    first, foot = s[..., 2], (s[..., 2] ** 2 + s[..., 1] ** 2 - s[..., 0] ** 2) / (2 * s[..., 2])
    nodes = np.zeros((*s.shape, 3))
    nodes[..., 0, 0] = first
    nodes[..., 1, 0] = foot
    nodes[..., 1, 1] = np.sqrt(s[..., 1] ** 2 - foot**2)
    return nodes - np.mean(nodes, axis=-2, keepdims=True)


def triangle_frame(nodes: ArrayLike) -> tuple[Array, Array]:
    """Rotation, shape (..., 3, 3), and origin, shape (..., 3), m, of the frame on three corners, shape (..., 3, 3), m.

    Both are in the frame of the corners. Source: equations 3.15 to 3.19, and 3.47 to 3.50 with the top nodes 7 to 9.
    """
    n = np.asarray(nodes, float)
    along, other = n[..., 0, :] - n[..., 2, :], n[..., 1, :] - n[..., 2, :]
    X = along / np.linalg.norm(along, axis=-1, keepdims=True)
    Z = np.cross(along, other)
    Z /= np.linalg.norm(Z, axis=-1, keepdims=True)
    return np.stack([X, np.cross(Z, X), Z], axis=-1), np.mean(n, axis=-2)
