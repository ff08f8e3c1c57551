"""What becomes of a run: the limits it is judged by, and how it is filmed."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from vgtsim.description.schema import Description
from vgtsim.units import Angle, Force, Length, Moment, Number, Pressure, Time

CameraName = Literal["overview", "cutaway", "riser", "tool"]


class Limits(Description):
    """What the run is judged by; each is named after its check.

    Attributes:
        closure: Greatest gap between a member's end and its hub, m.
        kinematics_agreement: Greatest distance of a node from forward kinematics, m.
        tracking_position: Tool from a settled goal, m.
        tracking_angle: Tool direction from a settled goal, rad.
        end_moment: Moment at a member's end, N·m.
        excess_shear: Shear beyond the member's own weight and inertia, N.
        lumped_shear: Shear of a member whose mass sits in its hubs, N.
        axial_force_settled: Error over the largest force, at rest.
        axial_force_moving: The same in motion.
        member_utilisation: Demand over capacity.
        actuator_force: Demand over capacity.
        actuator_stroke: Least distance to the end of a stroke, m.
        clearance: Least distance to anything, m.
        contacts: Number of logged contacts.
        safety_factor: On member strength, AISC 360 Omega.
        chamber_pressure: Least pressure in a chamber of a hydraulic cylinder, above the tank's, Pa.
        saturation: Part of the records in which a cylinder may be at its force, pressure, flow or stroke limit.
    """

    closure: Length = Field(gt=0)
    kinematics_agreement: Length = Field(gt=0)
    tracking_position: Length = Field(gt=0)
    tracking_angle: Angle = Field(gt=0)
    end_moment: Moment = Field(gt=0)
    excess_shear: Force = Field(gt=0)
    lumped_shear: Force = Field(default=1e-6, gt=0)
    axial_force_settled: Number = Field(gt=0)
    axial_force_moving: Number = Field(gt=0)
    member_utilisation: Number = Field(gt=0)
    actuator_force: Number = Field(gt=0)
    actuator_stroke: Length = Field(ge=0)
    clearance: Length = Field(ge=0)
    contacts: int = Field(ge=0)
    safety_factor: Number = Field(ge=1)
    chamber_pressure: Pressure = 0.0
    saturation: Number = Field(default=0.0, ge=0)


class Cut(Description):
    """One shot of the video.

    Attributes:
        camera: Name of a camera of the model.
        until: Simulated time at which the shot ends, s; absent for the last one.
    """

    camera: CameraName
    until: Time | None = None


class Video(Description):
    """How the run is filmed.

    Attributes:
        width: Pixels.
        height: Pixels.
        fps: Frames a second of film.
        speed: Simulated seconds in a second of film.
        cuts: Shots in order.
    """

    width: int = Field(default=1280, ge=160, le=3840)
    height: int = Field(default=720, ge=120, le=2160)
    fps: int = Field(default=25, ge=1, le=60)
    speed: Number = Field(default=2.0, gt=0)
    cuts: tuple[Cut, ...] = (Cut(camera="cutaway"),)

    @model_validator(mode="after")
    def _cuts_follow(self) -> Video:
        ends = [cut.until for cut in self.cuts[:-1]]
        known = [end for end in ends if end is not None]
        if len(known) < len(ends) or sorted(set(known)) != known:
            raise ValueError(f"every cut but the last needs an `until`, later than the one before: {ends}")
        return self
