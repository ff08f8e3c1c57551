"""Configurations to start from: the arm swung about its mast, and a few ways to spread its bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]

# Bend of the modules from the mast to the tool, in degrees, at five stations along the arm.
_BENDS = (
    (35.0, 30.0, 15.0, 5.0, 0.0),
    (30.0, 15.0, 0.0, 10.0, 35.0),
    (40.0, 38.0, 25.0, -20.0, -35.0),
    (20.0, 30.0, 30.0, 30.0, 30.0),
)


def azimuth(chain: Chain, point: Array) -> float:
    """Direction of a point from the mast's axis.

    Args:
        chain: The arm.
        point: In frame G, shape (3,), m.

    Returns:
        Angle about Z of B_1 from X of B_1, rad; zero for a point on the axis.
    """
    local = chain.mount[:3, :3].T @ (point - chain.mount[:3, 3])
    return float(np.arctan2(local[1], local[0])) if np.hypot(local[0], local[1]) > 1e-6 else 0.0


def swing(q: Array, angle: float | Array) -> Array:
    """Swing the arm's centre line about the mast's axis.

    Turning every mid-plane's normal about Z turns each module's transform about Z; prisms commute with it.

    Args:
        q: Inputs, shape (..., A, 3).
        angle: About Z of B_1, scalar or shape (...), rad.

    Returns:
        Inputs, shape (..., A, 3).
    """
    cos, sin = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y = q[..., 0], q[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y, np.broadcast_to(q[..., 2], (cos * x).shape)], axis=-1)


def bend_all(chain: Chain, angles: Array, direction: float) -> Array:
    """Bend the modules in one plane through the mast's axis.

    Args:
        chain: The arm.
        angles: Bend of each active module, shape (A,), rad; positive away from the mast.
        direction: Azimuth of the plane in B_1, rad.

    Returns:
        Inputs at the straight extension, shape (A, 3).
    """
    q = np.array(chain.straight)
    q[:, 0] = np.sin(angles / 2) * np.cos(direction)
    q[:, 1] = np.sin(angles / 2) * np.sin(direction)
    return q


def make_seeds(chain: Chain, start: Array, target: Array) -> Array:
    """Configurations from which to look for a goal, best first.

    Args:
        chain: The arm.
        start: Present configuration, shape (A, 3).
        target: Tool position wanted, in frame G, shape (3,), m.

    Returns:
        Inputs, shape (S, A, 3), some perhaps outside the strokes: the present ones swung to the target's azimuth, the
        present ones, then bend patterns in the plane of the target.
    """
    there = azimuth(chain, target)
    stations, marks = np.linspace(0, 1, len(start)), np.linspace(0, 1, 5)
    patterns = [bend_all(chain, np.radians(np.interp(stations, marks, bends)), there) for bends in _BENDS]
    return np.array([swing(start, there - azimuth(chain, chain.tool(start)[0])), start, *patterns])
