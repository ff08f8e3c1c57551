"""The line through the open truss, which carries waste up to the ground: section 1.2.2 and figure 1.6."""

from __future__ import annotations

from math import pi
from typing import Literal

from pydantic import Field, model_validator

from vgtsim.description.figures import Angle, BendingStiffness, Density, Gap, LineMass, Size
from vgtsim.description.schema import Description


class Conveyance(Description):
    """A line that carries waste up through the open truss, whose weight hangs on the faces that it passes.

    Attributes:
        kind: A `hose` bends in an arc between faces; `screws` are conveyors in stiff shells, one for each straight section,
            with a universal joint in every module that bends.
        diameter: Greatest outer diameter, couplings included.
        bore: Inner diameter, which the contents fill.
        mass: Of the empty line, per length.
        contents: Density of what fills it; absent for an empty line.
        bend_radius: Least radius that a hose may be bent to.
        bending_stiffness: Of a hose, EI: bent, it loads the faces with couples.
        joint_angle: Greatest angle of a universal joint between screws.
    """

    kind: Literal["hose", "screws"] = "hose"
    diameter: Size
    bore: Size | None = None
    mass: LineMass = 0.0
    contents: Density | None = None
    bend_radius: Gap = 0.0
    bending_stiffness: BendingStiffness = 0.0
    joint_angle: Angle | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _entries_fit(self) -> Conveyance:
        if self.bore is not None and self.bore >= self.diameter:
            raise ValueError(f"bore less than the diameter, {self.diameter:.4g} m, not {self.bore:.4g} m")
        if self.contents is not None and self.bore is None:
            raise ValueError("a bore for the contents to fill")
        if self.kind == "hose" and self.joint_angle is not None:
            raise ValueError('bend_radius for a hose; joint_angle is for kind = "screws"')
        if self.kind == "screws":
            if self.joint_angle is None:
                raise ValueError("joint_angle of the universal joints between screws")
            if self.bend_radius or self.bending_stiffness:
                raise ValueError('joint_angle for screws; bend_radius and bending_stiffness are for kind = "hose"')
        return self

    @property
    def density(self) -> float:
        """Mass of the line with its contents per length, kg/m."""
        filled = pi / 4 * self.bore**2 * self.contents if self.bore and self.contents else 0.0
        return self.mass + filled
