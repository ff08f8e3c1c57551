"""An underground single-shell tank, its risers, equipment and waste.

Tank frame G: origin on the tank axis at the lowest point of the floor, z up.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import atan2, cos, pi, sin, tau
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from vgtsim.description.figures import Angle, Force, Gap, Length, Size, Wait
from vgtsim.description.schema import Description, Name, Provenance, Title, closest
from vgtsim.description.waste import Waste
from vgtsim.units import to_si

_ROUNDED = 0.05  # m: of the corners of a profile table, less than a weld and a plate's edge take
Corner = tuple[Length, Length, Length]
Part = Annotated[tuple[Corner, ...], Field(min_length=4, max_length=1000)]


class Shell(Description):
    """The liner and dome: a surface of revolution.

    Attributes:
        inner_diameter: Diameter of the wall inside.
        dish_depth: Height at which the dished floor meets the knuckle.
        knuckle_radius: Radius of the arc from the floor to the wall.
        wall_top: Height at which the wall ends and the dome starts.
        haunch_radius: Radius of the arc from the wall to the dome cap.
        crown: Height of the dome's underside on the axis.
        soil_cover: Depth of soil over the crown.
        profile: Rows of height and radius in place of `inner_diameter`, `dish_depth` and `wall_top`, from [0, 0] to the edge of
            the dome cap, a part of a sphere that ends at `crown`. Arcs round the corners: of `knuckle_radius` up to the widest
            place, of `haunch_radius` above; absent, 5 cm.
        open: A test stand above ground: the arm stays inside wall and dome, which are not drawn.
    """

    profile: tuple[tuple[Gap, Gap], ...] | None = Field(default=None, min_length=3, max_length=1000)
    inner_diameter: Size
    dish_depth: Gap
    knuckle_radius: Size
    wall_top: Size
    haunch_radius: Size
    crown: Size
    dome_thickness: Size
    liner_thickness: Size
    soil_cover: Gap
    open: bool = False

    @model_validator(mode="before")
    @classmethod
    def _take_table(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or data.get("profile") is None:
            return data
        try:
            rows = [(to_si(high, "m"), to_si(wide, "m")) for high, wide in data["profile"]]
        except (TypeError, ValueError) as error:
            raise ValueError(f"profile: rows of a height and a radius: {error}") from None
        widest = max((wide for _, wide in rows), default=0.0)
        top = max((high for high, wide in rows if wide == widest), default=0.0)
        told = {"inner_diameter": 2 * widest, "dish_depth": 0.0, "wall_top": top}
        for key, value in told.items():
            if key in data and data[key] != value:
                raise ValueError(f"{key} or a profile, not both")
        return {"knuckle_radius": _ROUNDED, "haunch_radius": _ROUNDED} | dict(data) | told

    @model_validator(mode="after")
    def _profile_closes(self) -> Shell:
        if self.profile is not None:
            self._require_convex(self.profile)
            return self
        radius, rise = self.inner_diameter / 2, self.crown - self.wall_top
        if self.knuckle_radius >= radius:
            raise ValueError(f"knuckle radius below the tank radius {radius:.4g} m")
        if self.wall_top <= self.dish_depth + self.knuckle_radius:
            raise ValueError(f"wall_top above dish and knuckle, {self.dish_depth + self.knuckle_radius:.4g} m")
        if not self.haunch_radius < rise < radius:
            between = f"between the haunch radius {self.haunch_radius:.4g} m and the tank radius {radius:.4g} m"
            raise ValueError(f"dome rise crown - wall_top = {rise:.4g} m {between}")
        return self

    def _require_convex(self, rows: tuple[tuple[float, float], ...]) -> None:
        if rows[0] != (0.0, 0.0):
            raise ValueError(f"profile: a first row [0, 0], the lowest point on the axis, not {list(rows[0])}")
        high, wide = rows[-1]
        rise = self.crown - high
        if not 0 < rise < wide:
            raise ValueError(
                f"profile: a last row {0:g} to {wide:.4g} m below the crown, {self.crown:.4g} m, not {rise:.4g} m"
            )
        headings = [atan2(top - low, out - near) for (low, near), (top, out) in pairwise(rows)]
        headings.append(pi - 2 * atan2(rise, wide))  # of the cap at its edge
        for index, (before, after) in enumerate(pairwise(headings), start=1):
            if not 0 <= before < after:
                raise ValueError(
                    f"profile: a tank without inward corners and without rows in line; row {index} is {list(rows[index])}"
                )


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

    @property
    def place(self) -> tuple[float, float]:
        """X and y of its axis in frame G, m."""
        return (self.radius * cos(self.azimuth), self.radius * sin(self.azimuth)) if self.radius else (0.0, 0.0)


class Placed(Description):
    """A thing in the tank, or a ring of them.

    Its axis, its middle or its mesh's origin is at `radius` from the tank axis, at `azimuth` from +x about +z. With a `count` it
    is a ring of that many, at equal angles, the first at `azimuth`. Names in a ring end in numbers from `first` on, such as
    `alc_1`.

    Attributes:
        appears: Time of the run at which it comes in; nothing is planned for it before. Absent, it is there from the beginning.
    """

    name: Name
    radius: Gap
    azimuth: Angle
    appears: Wait | None = None
    count: int | None = Field(default=None, ge=2, le=200)
    first: int = Field(default=1, ge=0, le=10_000)

    @property
    def ring(self) -> tuple[Self, ...]:
        """Each of a ring, alone: azimuths and headings turn with it."""
        if self.count is None:
            return (self,)
        found = []
        for i in range(self.count):
            turn = i * tau / self.count
            changes = {"name": f"{self.name}_{self.first + i}", "count": None, "first": 1}
            turned = {key: getattr(self, key, None) for key in ("azimuth", "top_azimuth", "heading")}
            changes |= {key: (angle + turn) % tau for key, angle in turned.items() if angle is not None}
            found.append(self.model_copy(update=changes))
        return tuple(found)


class Equipment(Placed):
    """A cylinder in the tank, from the height `bottom` to `top`: upright, or a pipe that leans.

    Attributes:
        bottom: Absent when it stands on the floor.
        top: Absent when it hangs from the dome.
        top_radius, top_azimuth: Place of the upper end of an axis that leans; absent, as the lower end.
    """

    diameter: Size
    bottom: Gap | None = None
    top: Length | None = None
    top_radius: Gap | None = None
    top_azimuth: Angle | None = None

    @property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Radius, m, and azimuth, rad, of its lower and upper end."""
        radius = self.radius if self.top_radius is None else self.top_radius
        return (self.radius, self.azimuth), (radius, self.azimuth if self.top_azimuth is None else self.top_azimuth)


class Box(Placed):
    """An upright box in the tank, from the height `bottom` to `top`.

    Attributes:
        length, width: Sizes: `length` along its heading, `width` across.
        heading: Of its length from +x about +z; absent, away from the tank axis.
        bottom: Absent when it stands on the floor.
        top: Absent when it hangs from the dome.
    """

    length: Size
    width: Size
    heading: Angle | None = None
    bottom: Gap | None = None
    top: Length | None = None


class MeshThing(Placed):
    """A thing of any shape in the tank, from a mesh in a file whose z axis is upright; it is felt as convex parts.

    Attributes:
        file: An STL file, or another that trimesh reads; its path is relative to the tank's file.
        unit: Size of the file's unit, such as "1 mm".
        heading: Of the mesh's x axis from +x about +z; absent, away from the tank axis.
        height: Of the mesh's origin; absent, its lowest point stands on the floor.
        parts: Corners of its convex parts about its origin; the file gives them, or they take its place.
    """

    file: str | None = None
    unit: Size = 1.0
    heading: Angle | None = None
    height: Length | None = None
    parts: tuple[Part, ...] = Field(default=(), max_length=1000)

    @model_validator(mode="after")
    def _has_a_shape(self) -> MeshThing:
        if self.file is None and not self.parts:
            raise ValueError("a `file`, or the `parts` themselves")
        return self


Thing = Equipment | Box | MeshThing


class Guide(Description):
    """Two rings of rollers that hold the mast sideways, at the heights `lower` and `upper` over the soil; below it is negative.

    They are retracted while the arm passes. `force` is the greatest force of either ring, which is not judged if absent.
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


class Clamp(Description):
    """Jaws over the riser's flange that hold an arm by its uppermost face while a module is set on or taken off.

    Attributes:
        above_flange: Height of the face that is held over the riser's flange.
        force: Greatest weight that the jaws carry; absent, it is not judged.
    """

    name: Name
    above_flange: Size
    force: Force | None = Field(default=None, gt=0)


class Tank(Description):
    """A tank, its risers, its waste and its equipment.

    Attributes:
        arm_riser: Riser through which the arm enters, unless a scene's mast names another.
        boxes, meshes: Equipment that is no cylinder.
        headroom: Free height over the soil at the arm's riser; absent, it is not limited.
        guide: Holds the mast at the riser; without one the mast may touch the bore.
        clamp: Holds an arm that is assembled over the riser.
    """

    name: Name
    title: Title
    shell: Shell
    arm_riser: Riser
    risers: tuple[Riser, ...] = Field(default=(), max_length=200)
    equipment: tuple[Equipment, ...] = Field(default=(), max_length=200)
    boxes: tuple[Box, ...] = Field(default=(), max_length=200)
    meshes: tuple[MeshThing, ...] = Field(default=(), max_length=50)
    waste: Waste
    headroom: Size | None = None
    guide: Guide | None = None
    clamp: Clamp | None = None
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @property
    def grade(self) -> float:
        """Height of the ground above the lowest point of the floor, m."""
        return self.shell.crown + self.shell.dome_thickness + self.shell.soil_cover

    @property
    def clamp_height(self) -> float:
        """Height of the face that the clamp holds above the lowest point of the floor, m; there must be a clamp."""
        assert self.clamp is not None  # a mission that adds modules has one
        return self.grade + self.arm_riser.above_grade + self.clamp.above_flange

    @property
    def standing(self) -> tuple[Equipment, ...]:
        """Each cylinder of the equipment, rings taken apart."""
        return tuple(single for item in self.equipment for single in item.ring)

    @property
    def solids(self) -> tuple[Box | MeshThing, ...]:
        """Each box and then each mesh, rings taken apart."""
        return tuple(single for item in (*self.boxes, *self.meshes) for single in item.ring)

    @property
    def things(self) -> tuple[Thing, ...]:
        """Everything in the tank that has a name: cylinders and then solids, rings taken apart."""
        return (*self.standing, *self.solids)

    @property
    def appearances(self) -> dict[str, float]:
        """When each thing appears that is not there from the beginning, s, by its name."""
        return {item.name: item.appears for item in self.things if item.appears is not None}

    def known_at(self, time: float) -> Tank:
        """The tank without the things that appear after a time of the run, s."""
        if all(when <= time for when in self.appearances.values()):
            return self
        kept = {
            kind: tuple(item for item in getattr(self, kind) if (item.appears or 0.0) <= time)
            for kind in ("equipment", "boxes", "meshes")
        }
        return self.model_copy(update=kept)

    def enter_by(self, name: str | None) -> Tank:
        """The tank with another of its risers as the arm's; its own stays among the risers.

        Raises:
            ValueError: It has no such riser; with the nearest name.
        """
        if name is None or name == self.arm_riser.name:
            return self
        risers = {item.name: item for item in self.risers}
        if name not in risers:
            raise ValueError(f"a riser of {self.name}{closest(name, [self.arm_riser.name, *risers])}")
        others = tuple(self.arm_riser if item.name == name else item for item in self.risers)
        return self.model_copy(update={"arm_riser": risers[name], "risers": others})

    @model_validator(mode="after")
    def _contents_fit(self) -> Tank:
        if self.waste.level >= self.shell.wall_top:
            raise ValueError(
                f"waste.level below the top of the wall, {self.shell.wall_top:.4g} m, not {self.waste.level:.4g} m"
            )
        inner = self.shell.inner_diameter / 2
        for item in (self.arm_riser, *self.risers, *self.equipment, *self.boxes, *self.meshes):
            if item.radius >= inner:
                raise ValueError(f"{item.name}: radius {item.radius:.4g} m inside the tank radius {inner:.4g} m")
        for item in self.equipment:
            if item.ends[1][0] >= inner:
                raise ValueError(
                    f"{item.name}: top_radius {item.ends[1][0]:.4g} m inside the tank radius {inner:.4g} m"
                )
        for item in (self.arm_riser, *self.risers):
            if item.bore >= inner:
                raise ValueError(f"{item.name}: bore of {item.bore:.4g} m below the tank radius {inner:.4g} m")
            aside = item.radius + item.bore / 2 + item.wall
            if aside > inner:
                raise ValueError(f"{item.name}: a pipe inside the tank radius {inner:.4g} m; it comes to {aside:.4g} m")
        parts = [self.arm_riser, *self.risers, *self.things, *(item for item in (self.guide, self.clamp) if item)]
        taken = [item.name for item in parts] + ["shell", "riser", "waste"]
        if len(set(taken)) != len(taken):
            raise ValueError(
                f"names of risers, equipment, guide and clamp must differ, and from shell, riser, waste: {taken}"
            )
        for item in (*self.equipment, *self.boxes):
            if item.top is not None and item.bottom is not None and item.top <= item.bottom:
                raise ValueError(f"{item.name}: top {item.top:.4g} m above its bottom {item.bottom:.4g} m")
        return self
