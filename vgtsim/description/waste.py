"""Waste in a tank, its level, its mounds and its strength; what it is removed with, and where."""

from __future__ import annotations

from math import sqrt, tau
from random import Random
from typing import Literal

from pydantic import Field, model_validator

from vgtsim.description.figures import (
    Angle,
    Density,
    Flow,
    Force,
    Gap,
    JetPressure,
    Length,
    Number,
    Power,
    Pressure,
    Size,
    Wait,
)
from vgtsim.description.schema import Description, Name, Title

_WATER = 1000.0  # kg/m³, of a jet
_GIVEN = {"jet": ("pressure", "flow"), "scarifier": ("power", "reaction")}


class Mound(Description):
    """A mound on the waste: its middle at `radius` from the tank axis, at `azimuth` from +x about +z, over its level.

    Attributes:
        height: Of its top over the level.
        foot: Radius of the circle at which it begins.
    """

    radius: Gap
    azimuth: Angle
    height: Size
    foot: Size


class Roughness(Description):
    """Mounds drawn with a seed, `count` of them, evenly over the tank.

    Attributes:
        seed: Seed of the draw.
        height: Greatest height of a top over the level; the least is a third of it.
        foot: Greatest radius of a mound's foot; the least is a third of it.
    """

    seed: int = Field(ge=0, le=2**31)
    count: int = Field(ge=1, le=500)
    height: Size
    foot: Size


class Waste(Description):
    """The waste left in the tank (sludge, saltcake), with a level surface or mounds over it.

    Attributes:
        level: Height of the surface.
        strength: Strength in compression, which a tool must overcome; absent for a liquid.
        grid: Distance of the heights that stand for the surface. Waste that is cut needs it, at most half the tool's width.
            Absent, mounds have 0.2 m.
        mounds: Mounds that stand on the level.
        roughness: Mounds that are drawn with a seed.
    """

    kind: Title
    level: Gap
    density: Density
    strength: Pressure | None = None
    grid: Size | None = Field(default=None, ge=0.02, le=1.0)
    mounds: tuple[Mound, ...] = Field(default=(), max_length=200)
    roughness: Roughness | None = None

    def all_mounds(self, radius: float) -> tuple[Mound, ...]:
        """The mounds, those drawn included, inside a tank of a radius, m."""
        if self.roughness is None:
            return self.mounds
        rough = self.roughness
        draw, drawn = Random(rough.seed), []
        for _ in range(rough.count):
            size = draw.uniform(1 / 3, 1)
            place = {"radius": radius * sqrt(draw.random()), "azimuth": draw.uniform(0, tau)}
            drawn.append(Mound(**place, height=size * rough.height, foot=size * rough.foot))
        return (*self.mounds, *drawn)


class CuttingTool(Description):
    """A jet or a scarifier, which hangs plumb from the tool point and removes the waste below it.

    Attributes:
        kind: A `jet` of water has a `pressure` and a `flow`, from which its power and its reaction follow. A `scarifier`, a
            driven head, has its `power` and `reaction` given.
        width: Diameter of the round spot below the tool point in which it removes waste.
        reach: Greatest depth below the tool point at which it removes waste; the surface is never cut deeper.
        removal: Greatest volume of waste a second that its inlet takes away.
        energy: Energy for a volume of waste, over the waste's strength; in waste without strength `removal` alone counts.
        ramp: Time in which it comes to full power, and to rest.
        pressure: Of the water before the nozzle.
        flow: Volume of water a second.
        power: Power at the waste.
        reaction: Force of the waste on the tool at full power, upward.
    """

    kind: Literal["jet", "scarifier"]
    width: Size
    reach: Size
    removal: Flow
    energy: Number = Field(gt=0)
    ramp: Wait
    pressure: JetPressure | None = None
    flow: Flow | None = None
    power: Power | None = None
    reaction: Force | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _figures_fit(self) -> CuttingTool:
        for kind, names in _GIVEN.items():
            for name in names:
                given = getattr(self, name) is not None
                if given != (kind == self.kind):
                    found = f"no {name}" if given else name
                    raise ValueError(f"{found}: a {self.kind} has {' and '.join(_GIVEN[self.kind])}")
        return self

    @property
    def push(self) -> float:
        """Force on the tool at full power, upward, N: of a jet the momentum that its water takes away a second."""
        if self.pressure is None or self.flow is None:
            return self.reaction or 0.0
        return self.flow * sqrt(2 * _WATER * self.pressure)

    def rate_in(self, waste: Waste) -> float:
        """Volume of waste that it removes a second at full power, m³/s: as much as its power and its inlet allow."""
        if not waste.strength:
            return self.removal
        power = self.power if self.pressure is None or self.flow is None else self.pressure * self.flow
        return min(self.removal, (power or 0.0) / (self.energy * waste.strength))


class Patch(Description):
    """A part of the waste's surface, a parallelogram seen from above.

    Attributes:
        corner: X and y of its first corner, in frame G.
        along: X and y of a row, from the first corner on.
        across: X and y from the first row to the last one.
    """

    name: Name
    corner: tuple[Length, Length]
    along: tuple[Length, Length]
    across: tuple[Length, Length]

    @model_validator(mode="after")
    def _has_area(self) -> Patch:
        if abs(self.along[0] * self.across[1] - self.along[1] * self.across[0]) < 1e-6:  # mm²: no area to cut
            raise ValueError(f"along {self.along} and across {self.across} that span an area")
        return self

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Its four corners, m, in turn."""
        (x, y), (a, b), (c, d) = self.corner, self.along, self.across
        return (x, y), (x + a, y + b), (x + a + c, y + b + d), (x + c, y + d)
