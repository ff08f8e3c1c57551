"""Materials, tubes, joint blocks and cylinders of the members."""

from __future__ import annotations

from math import pi, sqrt
from typing import Self

from pydantic import Field, model_validator

from vgtsim.description.figures import Density, Number, Pressure, Size, Speed, Stiffness, Strength
from vgtsim.description.schema import Description, Name


class Material(Description):
    """An isotropic structural material: density, E and Fy.

    Attributes:
        design_wall: Part of a tube's nominal wall that counts for its strength: 0.93 by AISC 360-22 B4.2, but 1 for ASTM A1065
            and A1085, whose walls are closer to nominal. Mass and stiffness take the nominal wall.
    """

    density: Density
    youngs_modulus: Stiffness
    yield_strength: Strength
    design_wall: Number = Field(default=0.93, gt=0, le=1)


class Pipe(Description):
    """A round pipe."""

    outer_diameter: Size
    wall: Size

    @model_validator(mode="after")
    def _wall_fits(self) -> Self:
        if 2 * self.wall > self.outer_diameter:
            raise ValueError(f"wall of {self.wall:.4g} m at most half the outer diameter {self.outer_diameter:.4g} m")
        return self


class Tube(Pipe):
    """A round hollow section, with pins in double shear at its ends."""

    material: Name
    pin: Size | None = None

    @model_validator(mode="after")
    def _pin_fits(self) -> Tube:
        if self.pin is not None and self.pin >= self.outer_diameter:
            raise ValueError(f"pin of {self.pin:.4g} m thinner than the tube {self.outer_diameter:.4g} m")
        return self

    @property
    def inner_diameter(self) -> float:
        """Inner diameter, m."""
        return self.outer_diameter - 2 * self.wall

    @property
    def area(self) -> float:
        """Area of the section, m²."""
        return pi / 4 * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def gyration_radius(self) -> float:
        """Radius of gyration r = sqrt(I/A), m."""
        return sqrt(self.outer_diameter**2 + self.inner_diameter**2) / 4


class Block(Description):
    """The joint block of a mid-plane node with a joint offset: a round post with a joint ball at each end.

    Lower longerons end at the ball of its foot, upper longerons at the ball of its head. The actuators are pinned to the
    middle of the post and turn about its axis. `pin_damping` is torque over speed of a pin that turns on the post,
    N·m·s/rad. It is all that resists a turn of the block about its axis; no load acts there.
    """

    diameter: Size
    material: Name
    pin_damping: float = Field(default=0.05, ge=1e-6, le=1e6)  # a greased bush


class Cylinder(Description):
    """A double-acting hydraulic cylinder used as an extensible member.

    Attributes:
        bore, rod: Diameters: `bore` of the piston, `rod` of the rod.
        head: Total thickness of steel at bore diameter in the two heads and the piston.
        eye: Distance from a pin to the barrel or to the full rod.
        retracted: Least length from pin to pin.
        pressure: Supply pressure.
        rate: Greatest speed of the rod.
        leakage: Flow of oil across the piston per pressure while the lock valve is open, m³/(s·Pa).
        pin: Diameter of the pins at its ends, in double shear; absent where the joint is not rated.
    """

    bore: Size
    rod: Size
    barrel_wall: Size
    head: Size
    eye: Size
    retracted: Size
    stroke: Size
    pressure: Pressure = Field(gt=0)
    rate: Speed
    bulk_modulus: Stiffness = 1.4e9  # low end of makers' data for mineral oil without air
    leakage: float = Field(default=0.0, ge=0, le=1e-6)
    material: Name
    pin: Size | None = None

    @model_validator(mode="after")
    def _parts_fit(self) -> Cylinder:
        if self.rod >= self.bore:
            raise ValueError(f"rod of {self.rod:.4g} m thinner than the bore {self.bore:.4g} m")
        needed = self.stroke + self.head + 2 * self.eye
        if self.retracted < needed - 1e-9:  # m, rounding of inches
            parts = f"stroke, heads with piston, and two eyes: {needed:.4g} m"
            raise ValueError(f"retracted length {self.retracted:.4g} m at least {parts}")
        if self.barrel_diameter >= self.barrel_length:
            wider = f"bore and walls of {self.barrel_diameter:.4g} m"
            raise ValueError(f"{wider} thinner than the barrel is long, {self.barrel_length:.4g} m")
        if self.pin is not None and self.pin >= self.barrel_diameter:
            raise ValueError(f"pin of {self.pin:.4g} m thinner than the barrel, {self.barrel_diameter:.4g} m")
        return self

    @property
    def extended(self) -> float:
        """Greatest length from pin to pin, m."""
        return self.retracted + self.stroke

    @property
    def span(self) -> str:
        """The two ends of the stroke as text."""
        return f"{self.retracted:.4g} to {self.extended:.4g} m"

    @property
    def barrel_diameter(self) -> float:
        """Outer diameter of the barrel, m."""
        return self.bore + 2 * self.barrel_wall

    @property
    def barrel_length(self) -> float:
        """Distance from the base pin to the mouth of the barrel, m: the retracted length less the rod's eye."""
        return self.retracted - self.eye

    @property
    def rod_length(self) -> float:
        """Distance from the rod pin to the piston, m: the piston stays in the barrel at full extension."""
        return self.stroke + (self.retracted - self.stroke) / 2  # half of heads, piston and eyes

    @property
    def bore_area(self) -> float:
        """Area of the piston, m²."""
        return pi / 4 * self.bore**2

    @property
    def rod_area(self) -> float:
        """Area of the rod, m²."""
        return pi / 4 * self.rod**2

    @property
    def ring_area(self) -> float:
        """Area of the piston about the rod, m²."""
        return pi / 4 * (self.bore**2 - self.rod**2)

    def rod_stiffness(self, modulus: float) -> float:
        """Axial stiffness of the rod, N/m, for a modulus of elasticity in Pa."""
        return modulus * self.rod_area / self.rod_length

    def barrel_mass(self, density: float) -> float:
        """Mass of barrel and heads, kg, for a density in kg/m³."""
        # the two heads take two thirds of the steel in `head`, the piston one third
        shell = pi / 4 * (self.barrel_diameter**2 - self.bore**2) * (self.barrel_length - self.eye)
        return density * (shell + self.bore_area * self.head * 2 / 3)

    def rod_mass(self, density: float) -> float:
        """Mass of rod and piston, kg, for a density in kg/m³."""
        return density * (self.rod_area * self.rod_length + self.bore_area * self.head / 3)

    @property
    def push(self) -> float:
        """Greatest compressive member force, N: pressure on the full bore."""
        return self.pressure * self.bore_area

    @property
    def pull(self) -> float:
        """Greatest tensile member force, N: pressure on the annulus."""
        return self.pressure * self.ring_area
