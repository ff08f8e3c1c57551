"""Colours that mean something: one signed map for axial force, one palette for lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array

# Compression to tension. The hue already tells at a fifth of the greatest force, where most members are.
_KNOTS = np.array([-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0])
_RED = np.array([0.55, 0.86, 0.93, 0.74, 0.42, 0.16, 0.05])
_GREEN = np.array([0.03, 0.22, 0.55, 0.74, 0.66, 0.42, 0.14])
_BLUE = np.array([0.08, 0.16, 0.42, 0.74, 0.93, 0.86, 0.58])

# Mid tones that hold on a white and on a dark ground.
LINES = ("#3b7dd8", "#d9822b", "#2a9d62", "#a05fc4", "#c2528b", "#4aa3b5")
LIMIT = "#d1453b"
REST = "#8a8f98"
HOLD = "#2a9d62"


def force_colours(force: ArrayLike, greatest: float) -> Array:
    """Map axial forces, tension positive, shape (...), N, to red, green, blue and opacity, shape (..., 4), 0 to 1.

    Compression is red, zero grey, tension blue. Forces beyond the greatest magnitude, N, keep the end colour.
    """
    part = np.clip(np.asarray(force, float) / greatest, -1.0, 1.0)
    colour = [np.interp(part, _KNOTS, channel) for channel in (_RED, _GREEN, _BLUE)]
    return np.stack([*colour, np.ones(part.shape)], axis=-1)


def scale_end(force: ArrayLike) -> float:
    """Choose the end of a symmetric scale, N: the greatest finite magnitude, rounded up to two digits; 1 if it is 0."""
    magnitude = np.abs(np.asarray(force, float))
    greatest = float(np.max(magnitude, where=np.isfinite(magnitude), initial=0.0))
    if greatest == 0:
        return 1.0
    step = 10.0 ** (np.floor(np.log10(greatest)) - 1)
    return float(np.ceil(greatest / step - 1e-9) * step)
