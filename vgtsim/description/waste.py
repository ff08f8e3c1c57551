"""Waste in a tank: its level, its mounds and roughness, its density and strength."""

from __future__ import annotations

from math import sqrt, tau
from random import Random

from pydantic import Field

from vgtsim.description.figures import Angle, Density, Gap, Pressure, Size
from vgtsim.description.schema import Description, Title


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
        seed: Another one draws other mounds.
        height: Greatest height of a top over the level; the least is a third of it.
        foot: Greatest radius of a mound's foot; the least is a third of it.
    """

    seed: int = Field(ge=0, le=2**31)
    count: int = Field(ge=1, le=500)
    height: Size
    foot: Size


class Waste(Description):
    """The waste left in the tank (sludge, saltcake), with a level surface at the height `level`, or mounds over it.

    `strength` is that in compression: what a tool has to overcome; absent where the waste is a liquid. `mounds` stand on the
    level, those of `roughness` are drawn. `grid` is the distance of the heights that stand for the surface:
    waste that is to be cut needs it, at most half the tool's width; absent, mounds have theirs 0.2 m apart.
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
