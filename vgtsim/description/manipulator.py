"""An arm: modules from the mast flange to the tool, and what they are made of."""

from __future__ import annotations

from math import pi, sqrt
from typing import Annotated, Literal

from pydantic import Field, model_validator

from vgtsim.description.schema import Description, Name, Provenance, closest
from vgtsim.description.sections import Cylinder, Material, Tube
from vgtsim.units import Length


class Hub(Description):
    """The ball node at which members meet.

    Attributes:
        radius: m.
        material: Name of its material.
    """

    radius: Length = Field(gt=0)
    material: Name


class DoubleOctahedral(Description):
    """A symmetric batten-actuated double-octahedral module (sections 3.5.3 and 3.5.4).

    Attributes:
        name: Unique in the arm.
        longeron: Length of its twelve longerons, m.
        joint_offset: Ljo of equation 3.54, m: distance between the two mid-plane node triangles.
        longeron_tube: Tube of the longerons.
        batten_tube: Tube of the three battens of its top face.
        cylinder: Cylinder of its three mid-plane actuators.
        straight: Extension 2d of the straight working pose, m.
    """

    kind: Literal["double_octahedral"]
    name: Name
    longeron: Length = Field(gt=0)
    joint_offset: Length = Field(default=0.0, ge=0)
    longeron_tube: Name
    batten_tube: Name
    cylinder: Name
    straight: Length = Field(gt=0)


class Prism(Description):
    """A static section: a triangular prism with one diagonal in each side (section 3.6).

    Attributes:
        name: Unique in the arm.
        length: Distance between its end faces, m.
        longeron_tube: Tube of the three longerons.
        cross_longeron_tube: Tube of the three diagonals.
        batten_tube: Tube of the three battens of its top face.
    """

    kind: Literal["prism"]
    name: Name
    length: Length = Field(gt=0)
    longeron_tube: Name
    cross_longeron_tube: Name
    batten_tube: Name


Module = Annotated[DoubleOctahedral | Prism, Field(discriminator="kind")]


class TipPlate(Description):
    """The rigid triangular plate that closes the last face and carries the tool.

    Attributes:
        thickness: m.
        material: Name of its material.
        tool_offset: Distance from the last face to the tool point along its normal, m.
    """

    thickness: Length = Field(gt=0)
    material: Name
    tool_offset: Length = Field(ge=0)


class Stowed(Description):
    """The pose that passes the riser.

    Attributes:
        cylinder_length: Length of every actuator, m.
    """

    cylinder_length: Length = Field(gt=0)


class Manipulator(Description):
    """A chain of truss modules between a mast flange and a tip plate.

    Attributes:
        name: Short name.
        title: One line for people.
        face_side: Side b of the equilateral face triangles, m.
        hub: The nodes.
        tip_plate: The end of the arm.
        stowed: The pose that passes the riser.
        materials: By name.
        tubes: By name.
        cylinders: By name.
        modules: From the mast to the tool.
        provenance: Where the figures come from, by key path.
    """

    name: Name
    title: str
    face_side: Length = Field(gt=0)
    hub: Hub
    tip_plate: TipPlate
    stowed: Stowed
    materials: dict[Name, Material]
    tubes: dict[Name, Tube]
    cylinders: dict[Name, Cylinder]
    modules: tuple[Module, ...] = Field(min_length=1)
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _names_resolve(self) -> Manipulator:
        for place, name, known in self._references():
            if name not in known:
                raise ValueError(f"{place} = {name!r}: no such name{closest(name, known)}")
        names = [module.name for module in self.modules]
        if len(set(names)) != len(names):
            raise ValueError(f"module names must differ: {names}")
        if not isinstance(self.modules[-1], Prism):
            raise ValueError(f"the last module, {names[-1]}, must be a prism: the tip plate replaces its top battens")
        return self

    @model_validator(mode="after")
    def _lengths_close(self) -> Manipulator:
        for module in self.active:
            least = self.face_side / 2
            if module.longeron <= least:
                raise ValueError(
                    f"module {module.name}: longerons of {module.longeron:.4g} m do not close a triangle on a face "
                    f"side of {self.face_side:.4g} m; longer than {least:.4g} m"
                )
            height = 2 * sqrt(module.longeron**2 - least**2) + module.joint_offset
            if module.straight >= height:
                raise ValueError(
                    f"module {module.name}: straight extension {module.straight:.4g} m below that of upright "
                    f"longerons, {height:.4g} m"
                )
        return self

    def _references(
        self,
    ) -> list[tuple[str, str, dict[Name, Material] | dict[Name, Tube] | dict[Name, Cylinder]]]:
        found: list[tuple[str, str, dict[Name, Material] | dict[Name, Tube] | dict[Name, Cylinder]]] = [
            ("hub.material", self.hub.material, self.materials),
            ("tip_plate.material", self.tip_plate.material, self.materials),
        ]
        found += [(f"tubes.{key}.material", tube.material, self.materials) for key, tube in self.tubes.items()]
        found += [(f"cylinders.{key}.material", item.material, self.materials) for key, item in self.cylinders.items()]
        for index, module in enumerate(self.modules):
            for field in type(module).model_fields:
                if field.endswith("_tube"):
                    found.append((f"modules.{index}.{field}", getattr(module, field), self.tubes))
            if isinstance(module, DoubleOctahedral):
                found.append((f"modules.{index}.cylinder", module.cylinder, self.cylinders))
        return found

    @property
    def active(self) -> tuple[DoubleOctahedral, ...]:
        """The actuated modules, from the mast to the tool."""
        return tuple(module for module in self.modules if isinstance(module, DoubleOctahedral))

    @property
    def hub_mass(self) -> float:
        """Mass of one hub, kg: a solid ball."""
        return self.materials[self.hub.material].density * 4 / 3 * pi * self.hub.radius**3

    @property
    def tip_plate_mass(self) -> float:
        """Mass of the tip plate without hubs, kg."""
        area = sqrt(3) / 4 * self.face_side**2
        return self.materials[self.tip_plate.material].density * area * self.tip_plate.thickness
