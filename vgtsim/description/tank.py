"""An underground single-shell tank, its risers, equipment and waste.

Tank frame G: origin on the tank axis at the lowest point of the floor, z up.
"""

from __future__ import annotations

from math import sqrt, tau
from random import Random

from pydantic import Field, model_validator

from vgtsim.description.figures import Angle, Density, Force, Gap, Length, Pressure, Size
from vgtsim.description.schema import Description, Name, Provenance, Title


class Shell(Description):
    """The liner and dome: a surface of revolution.

    Attributes:
        dish_depth: Height at which the dished floor meets the knuckle.
        knuckle_radius: Radius of the arc from the floor to the wall.
        wall_top: Height at which the wall ends and the dome starts.
        haunch_radius: Radius of the arc from the wall to the dome cap.
        crown: Height of the dome's underside on the axis.
        soil_cover: Depth of soil over the crown.
    """

    inner_diameter: Size
    dish_depth: Gap
    knuckle_radius: Size
    wall_top: Size
    haunch_radius: Size
    crown: Size
    dome_thickness: Size
    liner_thickness: Size
    soil_cover: Gap

    @model_validator(mode="after")
    def _profile_closes(self) -> Shell:
        radius, rise = self.inner_diameter / 2, self.crown - self.wall_top
        if self.knuckle_radius >= radius:
            raise ValueError(f"knuckle radius below the tank radius {radius:.4g} m")
        if self.wall_top <= self.dish_depth + self.knuckle_radius:
            raise ValueError(f"wall_top above dish and knuckle, {self.dish_depth + self.knuckle_radius:.4g} m")
        if not self.haunch_radius < rise < radius:
            between = f"between the haunch radius {self.haunch_radius:.4g} m and the tank radius {radius:.4g} m"
            raise ValueError(f"dome rise crown - wall_top = {rise:.4g} m {between}")
        return self


class Riser(Description):
    """A vertical pipe of inner diameter `bore` through soil and dome.

    Its axis stands at `radius` from the tank axis, at `azimuth` from +x about +z. Its flange is `above_grade` over the
    soil.
    """

    name: Name
    bore: Size
    radius: Gap = 0.0
    azimuth: Angle = 0.0
    above_grade: Gap
    wall: Size


class Equipment(Description):
    """A vertical cylinder in the tank, from the height `bottom` to `top`; `top` is absent when it hangs from the dome.

    Its axis stands at `radius` from the tank axis, at `azimuth` from +x about +z. With a `count` it is a ring of that many, at
    equal angles, the first at `azimuth`; their names end in numbers from `first` on, such as `alc_1`.
    """

    name: Name
    diameter: Size
    radius: Gap
    azimuth: Angle
    bottom: Gap
    top: Length | None = None
    count: int | None = Field(default=None, ge=2, le=200)
    first: int = Field(default=1, ge=0, le=10_000)

    @property
    def ring(self) -> tuple[Equipment, ...]:
        """Each of its cylinders, alone."""
        if self.count is None:
            return (self,)
        turns = [(self.azimuth + i * tau / self.count) % tau for i in range(self.count)]
        names = [f"{self.name}_{self.first + i}" for i in range(self.count)]
        return tuple(
            self.model_copy(update={"name": name, "azimuth": turn, "count": None, "first": 1})
            for name, turn in zip(names, turns, strict=True)
        )


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


class Guide(Description):
    """Two rings of rollers that hold the mast sideways, at the heights `lower` and `upper` over the soil; below it is negative.

    They are retracted while the arm passes. `force` is the greatest force of either ring; absent, it is not judged.
    """

    name: Name
    lower: Length
    upper: Length
    force: Force | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _rings_differ(self) -> Guide:
        if self.upper <= self.lower:
            raise ValueError(f"upper {self.upper:.4g} m above lower {self.lower:.4g} m")
        return self


class Tank(Description):
    """A tank; the arm enters through `arm_riser`, on the tank axis, and the equipment is in its way.

    `headroom` is the free height over the soil at the arm riser; absent, it is not limited. A `guide` holds the mast there;
    without one the mast may touch the bore. `provenance` gives the sources of the figures by key path.
    """

    name: Name
    title: Title
    shell: Shell
    arm_riser: Riser
    risers: tuple[Riser, ...] = Field(default=(), max_length=200)
    equipment: tuple[Equipment, ...] = Field(default=(), max_length=200)
    waste: Waste
    headroom: Size | None = None
    guide: Guide | None = None
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @property
    def grade(self) -> float:
        """Height of the ground above the lowest point of the floor, m."""
        return self.shell.crown + self.shell.dome_thickness + self.shell.soil_cover

    @property
    def standing(self) -> tuple[Equipment, ...]:
        """Each cylinder of the equipment, rings taken apart."""
        return tuple(single for item in self.equipment for single in item.ring)

    @model_validator(mode="after")
    def _contents_fit(self) -> Tank:
        if self.arm_riser.radius:
            raise ValueError(f"arm_riser.radius 0 (the arm enters on the tank axis), not {self.arm_riser.radius:.4g} m")
        if self.waste.level >= self.shell.wall_top:
            raise ValueError(f"waste.level below the top of the wall, {self.shell.wall_top:.4g} m")
        inner = self.shell.inner_diameter / 2
        for item in (*self.risers, *self.equipment):
            if item.radius >= inner:
                raise ValueError(f"{item.name}: radius {item.radius:.4g} m inside the tank radius {inner:.4g} m")
        for item in (self.arm_riser, *self.risers):
            if item.bore >= inner:
                raise ValueError(f"{item.name}: bore of {item.bore:.4g} m below the tank radius {inner:.4g} m")
        parts = [self.arm_riser, *self.risers, *self.standing, *([self.guide] if self.guide else [])]
        taken = [item.name for item in parts] + ["shell", "riser", "waste"]
        if len(set(taken)) != len(taken):
            raise ValueError(f"names of risers, equipment and guide must differ, and from shell, riser, waste: {taken}")
        for item in self.equipment:
            if item.top is not None and item.top <= item.bottom:
                raise ValueError(f"{item.name}: top {item.top:.4g} m above its bottom {item.bottom:.4g} m")
        return self
