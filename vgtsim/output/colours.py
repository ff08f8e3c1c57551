"""Colours that mean something: one signed map for axial force, one palette for lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Compression to tension. The hue already tells at a fifth of the greatest force, where most members are.
_KNOTS = np.array([-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0])
_RGB = np.array(
    [
        [0.55, 0.03, 0.08],
        [0.86, 0.22, 0.16],
        [0.93, 0.55, 0.42],
        [0.74, 0.74, 0.74],
        [0.42, 0.66, 0.93],
        [0.16, 0.42, 0.86],
        [0.05, 0.14, 0.58],
    ]
)

# Mid tones that hold on a white and on a dark ground.
LINES = ("#3b7dd8", "#d9822b", "#2a9d62", "#a05fc4", "#c2528b", "#4aa3b5")
LIMIT = "#d1453b"
REST = "#8a8f98"
HOLD = "#2a9d62"


def force_colours(force: ArrayLike, greatest: float) -> NDArray[np.float64]:
    """Map axial forces to colours: compression red, zero grey, tension blue.

    Args:
        force: Tension positive, shape (...), N.
        greatest: Magnitude at both ends of the scale, N; forces beyond it keep the end colour.

    Returns:
        Red, green, blue and opacity, shape (..., 4), 0 to 1.
    """
    part = np.clip(np.asarray(force, float) / greatest, -1.0, 1.0)
    colour = np.ones((*part.shape, 4))
    for channel in range(3):
        colour[..., channel] = np.interp(part, _KNOTS, _RGB[:, channel])
    return colour


def scale_end(force: ArrayLike) -> float:
    """Choose the end of a symmetric scale: the greatest magnitude, rounded up to two digits.

    Args:
        force: Shape (...), N; figures that are not finite are passed over.

    Returns:
        N; 1 when every force is zero.
    """
    magnitude = np.abs(np.asarray(force, float))
    greatest = float(np.max(magnitude, where=np.isfinite(magnitude), initial=0.0))
    if greatest == 0:
        return 1.0
    step = 10.0 ** (np.floor(np.log10(greatest)) - 1)
    return float(np.ceil(greatest / step - 1e-9) * step)
