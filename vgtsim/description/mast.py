"""The mast that carries an arm through the riser, its hoist and its turn."""

from __future__ import annotations

from math import pi

from pydantic import Field, field_validator

from vgtsim.constants import STEEL
from vgtsim.description.figures import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Density,
    Force,
    Moment,
    Size,
    Speed,
)
from vgtsim.description.schema import Description, Name
from vgtsim.description.sections import Pipe


class Feed(Description):
    """The hoist that lifts the mast, and the arm with it.

    Attributes:
        stroke: Greatest lift above the working depth.
        rate: Rated speed.
        acceleration: Greatest acceleration.
        force: Greatest pull.
    """

    stroke: Size
    rate: Speed
    acceleration: Acceleration = Field(gt=0)
    force: Force = Field(gt=0)

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest lift, m."""
        return 0.0, self.stroke


class Slew(Description):
    """The drive that turns the mast about its axis, and the arm with it; angles count counter-clockwise from above.

    Attributes:
        range: Least and greatest turn; none is the way in which the arm comes through the riser.
        rate: Rated speed.
        acceleration: Greatest acceleration.
        torque: Greatest torque about the axis.
    """

    range: tuple[Angle, Angle]
    rate: AngularSpeed
    acceleration: AngularAcceleration
    torque: Moment = Field(gt=0)

    @field_validator("range")
    @classmethod
    def _holds_zero(cls, value: tuple[float, float]) -> tuple[float, float]:
        """The arm comes in and goes out with a mast that is not turned; a whole turn would have two names for one posture."""
        if not -pi < value[0] <= 0 <= value[1] < pi or value[0] == value[1]:
            raise ValueError("a range that holds 0, by less than half a turn on either side")
        return value


class Mast(Pipe):
    """The pipe that carries the arm through the riser.

    Attributes:
        pivot_depth: Depth of the arm's base face below the dome's crown.
        riser: Name of the mast's riser; absent, the tank's `arm_riser`.
        riser_spare: Least gap between the stowed arm and the riser's bore; absent, 1.5 in.
        feed: Absent, the mast is held at its working depth.
        turn: Absent, the mast does not turn about its axis.
    """

    pivot_depth: Size
    riser: Name | None = None
    density: Density = STEEL
    riser_spare: Size | None = None
    feed: Feed | None = None
    turn: Slew | None = None
