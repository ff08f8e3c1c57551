"""Configurations to look for a goal from: the arm swung about its mast, and a few ways to spread its bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.bending import azimuth, bend_all, swing
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]

# Bend of the modules from the mast to the tool, in degrees, at five stations along the arm.
_BENDS = (
    (35.0, 30.0, 15.0, 5.0, 0.0),
    (30.0, 15.0, 0.0, 10.0, 35.0),
    (40.0, 38.0, 25.0, -20.0, -35.0),
    (20.0, 30.0, 30.0, 30.0, 30.0),
)


def make_seeds(chain: Chain, start: Array, target: Array) -> Array:
    """Configurations from which to look for a goal, best first.

    Args:
        chain: The arm.
        start: Present configuration, shape (n,).
        target: Tool position wanted, in frame G, shape (3,), m.

    Returns:
        Inputs, shape (S, n), some perhaps outside the strokes: the present ones swung to the target's azimuth, the
        present ones, then bend patterns in the plane of the target.
    """
    there = azimuth(chain, target)
    count = len(chain.layout.names)
    stations, marks = np.linspace(0, 1, count), np.linspace(0, 1, 5)
    part = min(1.0, len(marks) / count)  # more modules need less each
    patterns = [bend_all(chain, part * np.radians(np.interp(stations, marks, bends)), there) for bends in _BENDS]
    return np.array([swing(chain, start, there - azimuth(chain, chain.tool(start)[0])), start, *patterns])
