"""The limits of a run, and its film."""

from __future__ import annotations

from math import radians
from typing import Literal

from pydantic import Field, model_validator

from vgtsim.constants import SAFETY_FACTOR
from vgtsim.description.figures import Angle, Force, Gap, Moment, Number, Pressure, Speed, Time, Tolerance
from vgtsim.description.schema import Description

CameraName = Literal["overview", "cutaway", "riser", "tool", "above"]


class Limits(Description):
    """Limits of the checks; each is named after its check.

    Attributes:
        closure: Greatest gap between a member's end and its hub.
        kinematics_agreement: Greatest distance of a node from forward kinematics.
        record_time: Greatest distance of a record from its instant.
        missing_records: Records or stages of the tour that may be missing.
        command: Greatest distance of a cylinder, or of its command, from the plan.
        actuator_speed: Speed of a cylinder over its rated speed.
        actuator_acceleration: Acceleration of a cylinder over the scene's.
        logged_speed: Difference of a logged speed from that of the lengths.
        tracking_position, tracking_angle: Distance of the tool from a settled goal, and angle of its direction.
        end_moment: Moment at a member's end.
        excess_shear: Shear beyond that of the member's weight and inertia.
        lumped_shear: Shear of a member whose mass sits in its hubs.
        axial_force_settled, axial_force_moving: Error of the axial forces over the largest one, at rest or in motion.
        pressure_force: Difference of chamber pressures from the drive forces, over the largest force.
        member_utilisation, actuator_force: Demand over capacity of members and of drives.
        actuator_stroke: Least distance to the end of a stroke.
        clearance: Least distance to anything.
        bore_clearance: Least distance from the riser of an arm that is fed through it.
        headroom: Least distance of the mast's top from the tank's headroom.
        leader: Distance of the arm's axis from the path of its leader, over the greatest planned one.
        passage: Least room that the open truss leaves about the line of conveyance.
        line_bend: Bend of the line of conveyance over its greatest bend.
        contacts: Number of logged contacts that the scene does not allow.
        contact_force: Force of an allowed contact over its limit.
        cutting_rate: Waste removed a second over the tool's greatest rate.
        cutting_depth: Depth beyond the tool's reach at which waste was removed.
        removed_volume: Error of the removed volume, part of the whole.
        safety_factor: On member strength, AISC 360 Omega.
        chamber_pressure: Least pressure in a chamber of a hydraulic cylinder, above that of the oil tank.
        saturation: Part of the records in which a cylinder may be at a limit of force, pressure, flow or stroke.
    """

    closure: Tolerance = 1e-6  # the shipped scenes, which know their clean runs, have a tenth of these
    kinematics_agreement: Tolerance = 1e-5
    record_time: Time = Field(default=1e-6, gt=0)  # a thousandth of a short step
    missing_records: int = Field(default=0, ge=0)
    command: Tolerance = 1e-5
    actuator_speed: Number = Field(default=1.0, gt=0)
    actuator_acceleration: Number = Field(default=1.0, gt=0)
    logged_speed: Speed = 1e-4  # a hundredth of a slow cylinder's speed
    tracking_position: Tolerance = 1e-3
    tracking_angle: Angle = Field(default=radians(0.1), gt=0)
    end_moment: Moment = Field(default=1e-6, gt=0)
    excess_shear: Force = Field(default=0.1, gt=0)  # a thousandth of what a light member weighs
    lumped_shear: Force = Field(default=1e-6, gt=0)
    axial_force_settled: Number = Field(default=1e-6, gt=0)
    axial_force_moving: Number = Field(default=1e-3, gt=0)
    pressure_force: Number = Field(default=0.01, gt=0)  # the damper beside the oil is of the start posture
    member_utilisation: Number = Field(default=1.0, gt=0)
    actuator_force: Number = Field(default=1.0, gt=0)
    actuator_stroke: Gap = 0.0
    clearance: Gap = 0.05  # half of what a plan keeps
    headroom: Gap = 0.0
    bore_clearance: Gap = 0.0
    leader: Number = Field(default=1.05, gt=0)  # an arm that gives sags off the path
    passage: Gap = 0.0
    line_bend: Number = Field(default=1.0, gt=0)
    contacts: int = Field(default=0, ge=0, le=1_000_000)
    contact_force: Number = Field(default=1.0, gt=0)
    cutting_rate: Number = Field(default=1 + 1e-6, gt=0)  # rounding of volumes
    cutting_depth: Gap = 1e-4  # the tool is known at records, and between them nearly
    removed_volume: Number = Field(default=1e-3, gt=0)
    safety_factor: Number = Field(default=SAFETY_FACTOR, ge=1, le=100)
    chamber_pressure: Pressure = 0.0
    saturation: Number = Field(default=0.0, ge=0)


class Cut(Description):
    """One shot of the video; it ends at the simulated time `until`, s. The last shot has none."""

    camera: CameraName
    until: Time | None = None


class Video(Description):
    """The film: size in pixels, frames a second, simulated seconds in a second of film, and the shots in order."""

    width: int = Field(default=1280, ge=160, le=3840)
    height: int = Field(default=720, ge=120, le=2160)
    fps: int = Field(default=25, ge=1, le=60)
    speed: Number = Field(default=2.0, ge=0.01, le=1e4)
    cuts: tuple[Cut, ...] = (Cut(camera="cutaway"),)

    @model_validator(mode="after")
    def _cuts_follow(self) -> Video:
        ends = [cut.until for cut in self.cuts[:-1]]
        known = [end for end in ends if end is not None]
        if len(known) < len(ends) or sorted(set(known)) != known:
            raise ValueError(f"every cut but the last needs an `until`, later than the one before: {ends}")
        return self
