"""Figures and choices that several rooms share; each figure with its unit and its source."""

from __future__ import annotations

from enum import StrEnum

GRAVITY = 9.80665  # m/s², standard gravity (CGPM, 1901), where no scene gives one
SAFETY_FACTOR = 1.67  # Omega of AISC 360-22 for members, allowable strength design, where no scene gives one
STEEL = 7850.0  # kg/m³, density of structural steel (AISC Manual), where no scene gives one
PAYLOAD = 453.59237  # kg, 1000 lb: what the reference arm is laid out to carry
PAYLOAD_RADIUS = 0.15  # m, of the ball that stands for a payload where no scene gives one
MAST_STICK_UP = 0.5  # m of mast above the riser's flange at the working depth


class Method(StrEnum):
    """How redundancy is resolved."""

    NULLSPACE = "nullspace"
    COUPLED = "coupled"
    ANCHORED = "anchored"
    SHAPE = "shape"
