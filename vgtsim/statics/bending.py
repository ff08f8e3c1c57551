"""Strength in bending, and with axial force, of actuators between joint blocks.

The bending moment of such an actuator runs straight from one block to the other. Its barrel has the part up to its mouth,
its rod the rest. Bending by an actuator's own weight is left out, as it is for every other member.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ALPHA = 1.6  # AISC 360-22 C2.1: allowable loads are taken times this for second-order effects


def rod_bending_strength(diameter: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a solid round in bending: Mn = Fy Z, at most 1.6 Fy S, shape (...), N·m; Z is 1.70 S.

    Diameter in m, Fy in Pa. Source: AISC 360-22 equation F11-1.
    """
    d, fy = np.asarray(diameter, float), np.asarray(yield_strength, float)
    return np.minimum(fy * d**3 / 6, 1.6 * fy * pi * d**3 / 32)


def tube_bending_strength(outer: ArrayLike, inner: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a compact round tube in bending: Mn = Fy Z, shape (...), N·m, for diameters in m and Fy in Pa.

    Source: AISC 360-22 equation F8-1. A cylinder's barrel is compact by far: D/t below 0.07 E/Fy, 44 for this steel.
    """
    shape = np.asarray(outer, float) ** 3 - np.asarray(inner, float) ** 3
    return np.asarray(yield_strength, float) * shape / 6


def interact(axial: ArrayLike, bending: ArrayLike) -> Array:
    """Use of a member in axial force (Pr/Pc) and bending (Mr/Mc) together, shape (...); at most 1 is strong enough.

    Source: AISC 360-22 equations H1-1a and H1-1b.
    """
    p, m = np.asarray(axial, float), np.asarray(bending, float)
    return np.where(p >= 0.2, p + 8 / 9 * m, p / 2 + m)


def amplify(push: ArrayLike, euler: ArrayLike) -> Array:
    """Factor B1, with Cm = 1, by which compression raises the moment of a member whose ends do not move apart sideways.

    Of compression under allowable loads and Euler load, shape (...), N; infinite where the member buckles.
    Source: AISC 360-22 equation A-8-3.
    """
    ratio = ALPHA * np.asarray(push, float) / np.asarray(euler, float)
    return np.where(ratio < 1, 1 / np.maximum(1 - ratio, 1e-12), np.inf)


def greatest_moments(near: Array, far: Array, mouth: Array) -> tuple[Array, Array]:
    """Greatest bending moments in barrels and in rods, shapes (..., M), N·m.

    `near` and `far` are the actuators' moments on their blocks, shape (..., M, 3), N·m; `mouth` is the place of the barrel's
    mouth in parts of the length from the near end, shape (..., M).
    """
    there = near + mouth[..., None] * (-far - near)
    begin, middle, end = (np.linalg.norm(item, axis=-1) for item in (near, there, far))
    return np.maximum(begin, middle), np.maximum(middle, end)
