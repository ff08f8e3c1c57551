"""An arm: modules from the mast flange to the tool, and what they are made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi, sqrt

from pydantic import Field, model_validator

from vgtsim.description.figures import Gap, Size
from vgtsim.description.modules import Module, Sides
from vgtsim.description.schema import Description, Name, Provenance, Title, closest, require_distinct
from vgtsim.description.sections import Block, Cylinder, Material, Tube

_MATCH = 1e-6  # relative difference of two sides that is taken for rounding of the figures in a file


class Hub(Description):
    """The ball node at which members meet."""

    radius: Size
    material: Name


class TipPlate(Description):
    """The rigid triangular plate that closes the last face and carries the tool point, `tool_offset` along its normal."""

    thickness: Size
    material: Name
    tool_offset: Gap


class Stowed(Description):
    """The pose that passes the riser: the length of every actuator of a double-octahedral module."""

    cylinder_length: Size


class Manipulator(Description):
    """A chain of truss modules, from a mast flange to a tip plate.

    Attributes:
        face_side: Side b of the equilateral face triangles: of the last face, and of every face whose module gives no
            other.
        stowed: Needed where a scene stows the arm's double-octahedral modules in a riser.
        blocks: Joint blocks; arms with a joint offset have them.
        provenance: Sources of the figures, by key path.
    """

    name: Name
    title: Title
    face_side: Size
    hub: Hub
    tip_plate: TipPlate
    stowed: Stowed | None = None
    materials: dict[Name, Material]
    tubes: dict[Name, Tube]
    cylinders: dict[Name, Cylinder]
    blocks: dict[Name, Block] = Field(default_factory=dict)
    modules: tuple[Module, ...] = Field(min_length=1, max_length=100)
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _names_resolve(self) -> Manipulator:
        for place, name, known in self._references():
            if name not in known:
                raise ValueError(f"{place} = {name!r}: no such name{closest(name, known)}")
        require_distinct("module", self.modules)
        last = self.modules[-1]
        if not last.ends:
            must_not = f"must not be {last.kind}: the tip plate replaces the top battens"
            raise ValueError(f"the last module, {last.name}, {must_not}")
        if 2 * self.hub.radius >= self.face_side:
            raise ValueError(
                f"hub.radius below half the face side, {self.face_side / 2:.4g} m, not {self.hub.radius:.4g} m"
            )
        return self

    @model_validator(mode="after")
    def _modules_fit(self) -> Manipulator:
        below, above = "the mast flange", self.modules[0].faces(self.face_side)[0]
        for module in self.modules:
            base, top = module.faces(self.face_side)
            for sides in (base, top):
                if 2 * max(sides) >= sum(sides):
                    raise ValueError(f"module {module.name}: a face with sides {_metres(sides)} does not close")
            if any(abs(a - b) > _MATCH * b for a, b in zip(base, above, strict=True)):
                here = f"the base of {module.name} has sides {_metres(base)}"
                raise ValueError(f"faces do not match: {here}, the top of {below} {_metres(above)}")
            below, above = module.name, top
        if any(abs(side - self.face_side) > _MATCH * self.face_side for side in above):
            here = f"the tip plate has sides of {self.face_side:.5g} m"
            raise ValueError(f"faces do not match: {here}, the top of {below} {_metres(above)}")
        for module in self.modules:
            module.check(self)
        return self

    def _references(self) -> Iterator[tuple[str, str, Mapping[str, Description]]]:
        """Give the key path, the name and the table of every part that the arm names."""
        yield "hub.material", self.hub.material, self.materials
        yield "tip_plate.material", self.tip_plate.material, self.materials
        for table in ("tubes", "cylinders", "blocks"):
            for key, part in getattr(self, table).items():
                yield f"{table}.{key}.material", part.material, self.materials
        for index, module in enumerate(self.modules):
            for field, name, table in module.parts():
                yield f"modules.{index}.{field}", name, getattr(self, table)

    @property
    def active(self) -> tuple[Module, ...]:
        """The modules with actuators, of every kind, from the mast to the tool."""
        return tuple(item for item in self.modules if item.freedom)

    @property
    def stowable(self) -> tuple[Cylinder, ...]:
        """Cylinders that are retracted where the arm passes the riser, one of each module that has such, from the mast on."""
        return tuple(self.cylinders[module.stowed_cylinder] for module in self.modules if module.stowed_cylinder)

    @property
    def stowed_length(self) -> float:
        """Length of the actuators of the double-octahedral modules in the stowed pose, m."""
        assert self.stowed is not None  # demanded by every scene of an arm that has such modules
        return self.stowed.cylinder_length

    def block_of(self, module: int) -> Block:
        """Joint block of a module with a joint offset, given by its index."""
        (name,) = (name for _, name, table in self.modules[module].parts() if table == "blocks")
        return self.blocks[name]

    @property
    def hub_mass(self) -> float:
        """Mass of one hub, kg: a solid ball."""
        return self.materials[self.hub.material].density * 4 / 3 * pi * self.hub.radius**3

    @property
    def tip_plate_mass(self) -> float:
        """Mass of the tip plate without hubs, kg."""
        plate = self.tip_plate
        return self.materials[plate.material].density * (sqrt(3) / 4 * self.face_side**2) * plate.thickness


def _metres(sides: Sides) -> str:
    return ", ".join(f"{side:.5g}" for side in sides) + " m"
