"""The kinds of modules an arm is made of, and the face triangles at which they meet (chapter 3)."""

from __future__ import annotations

from math import pi, sqrt
from typing import Annotated, Literal

from pydantic import Field, model_validator

from vgtsim.description.schema import Description, Name
from vgtsim.units import Angle, Length, Number

Sides = tuple[float, float, float]
_Sides = tuple[Length, Length, Length]


def _pair_offset(module: str, offset: float, block: str | None) -> None:
    if bool(offset) != (block is not None):
        found = f"joint_offset of {offset:.4g} m with {'no block' if block is None else f'block {block!r}'}"
        raise ValueError(f"module {module}: {found}; a joint offset and its block go together")


class DoubleOctahedral(Description):
    """A symmetric batten-actuated double-octahedral module (sections 3.5.3 and 3.5.4).

    Attributes:
        name: Unique in the arm.
        longeron: Length of its twelve longerons, m.
        joint_offset: Ljo of equation 3.54, m: distance between the two mid-plane node triangles.
        block: Joint block of its mid-plane nodes; one is given where there is an offset.
        longeron_tube: Tube of the longerons.
        batten_tube: Tube of the three battens of its top face.
        cylinder: Cylinder of its three mid-plane actuators.
        straight: Extension 2d of the straight working pose, m.
    """

    kind: Literal["double_octahedral"]
    name: Name
    longeron: Length = Field(gt=0)
    joint_offset: Length = Field(default=0.0, ge=0)
    block: Name | None = None
    longeron_tube: Name
    batten_tube: Name
    cylinder: Name
    straight: Length = Field(gt=0)

    @model_validator(mode="after")
    def _offset_has_blocks(self) -> DoubleOctahedral:
        _pair_offset(self.name, self.joint_offset, self.block)
        return self

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 3


class GeneralDoubleOctahedral(Description):
    """A batten-actuated double-octahedral module whose longerons and faces may all differ (sections 3.5.1 and 3.5.2).

    Attributes:
        name: Unique in the arm.
        base: Sides n1 n2, n2 n3, n3 n1 of its base, m; absent for the arm's face side.
        top: Sides n7 n8, n8 n9, n9 n7 of its top, m; absent for the arm's face side.
        longerons: Lengths of L1 to L12 = n1 n4, n2 n5, n3 n6, n3 n4, n1 n5, n2 n6, n5' n7, n6' n8, n4' n9, n4' n7,
            n5' n8, n6' n9, m; without a joint offset n4' is n4, and so on.
        joint_offset: Ljo, m: distance between the two mid-plane node triangles.
        block: Joint block of its mid-plane nodes; one is given where there is an offset.
        longeron_tube: Tube of the longerons.
        batten_tube: Tube of the three battens of its top face.
        cylinder: Cylinder of its three mid-plane actuators.
        straight: Length of the three actuators in the straight working pose, m.
    """

    kind: Literal["double_octahedral_general"]
    name: Name
    base: _Sides | None = None
    top: _Sides | None = None
    longerons: tuple[Length, ...] = Field(min_length=12, max_length=12)
    joint_offset: Length = Field(default=0.0, ge=0)
    block: Name | None = None
    longeron_tube: Name
    batten_tube: Name
    cylinder: Name
    straight: Length = Field(gt=0)

    @model_validator(mode="after")
    def _lengths_are_lengths(self) -> GeneralDoubleOctahedral:
        _pair_offset(self.name, self.joint_offset, self.block)
        for number, length in enumerate(self.longerons, 1):
            if length <= 0:
                raise ValueError(f"module {self.name}: longeron L{number} of {length:.4g} m, must be longer than 0")
        return self

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 3


class Tetrahedral(Description):
    """A hinge of two static triangles about the third side of its base (section 3.3).

    Its base and its top are the triangle of sides L1, L1, L2, apex at the second corner; the actuator joins the two
    apexes. It cannot end an arm: the tip plate would have to hold the hinge line too.

    Attributes:
        name: Unique in the arm.
        side: L1, m; absent for the arm's face side.
        hinge: L2, of the hinge line, m; absent for the arm's face side.
        batten_tube: Tube of the two sides of its top.
        cylinder: Cylinder of its actuator.
        straight: Hinge angle theta of the straight working pose, rad.
    """

    kind: Literal["tetrahedral"]
    name: Name
    side: Length | None = Field(default=None, gt=0)
    hinge: Length | None = Field(default=None, gt=0)
    batten_tube: Name
    cylinder: Name
    straight: Angle = Field(gt=0, lt=pi)

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 1


class Longeron(Description):
    """One longeron of an octahedral module: a cylinder, or a tube with its length.

    Attributes:
        cylinder: Name of its cylinder.
        tube: Name of its tube.
        length: Of the tube, m.
    """

    cylinder: Name | None = None
    tube: Name | None = None
    length: Length | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Longeron:
        if (self.cylinder is None) == (self.tube is None) or (self.tube is None) != (self.length is None):
            raise ValueError("either a cylinder, or a tube and its length")
        return self


class Octahedral(Description):
    """A longeron-actuated octahedral module, a Stewart platform (section 3.4).

    Attributes:
        name: Unique in the arm.
        base: Sides n1 n2, n2 n3, n3 n1 of its base, m; absent for the arm's face side.
        top: Sides n4 n5, n5 n6, n6 n4 of its top, m; absent for the arm's face side.
        longerons: l1 to l6 = n1 n4, n2 n5, n3 n6, n3 n4, n1 n5, n2 n6; at least one is a cylinder.
        batten_tube: Tube of the three battens of its top.
        straight: Length of the actuated longerons in the straight working pose, m.
    """

    kind: Literal["octahedral"]
    name: Name
    base: _Sides | None = None
    top: _Sides | None = None
    longerons: tuple[Longeron, ...] = Field(min_length=6, max_length=6)
    batten_tube: Name
    straight: Length = Field(gt=0)

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return sum(longeron.cylinder is not None for longeron in self.longerons)

    @model_validator(mode="after")
    def _something_moves(self) -> Octahedral:
        if all(longeron.cylinder is None for longeron in self.longerons):
            raise ValueError(f"module {self.name}: one to six longerons with a cylinder; none has")
        return self

    @property
    def actuated(self) -> tuple[int, ...]:
        """Indices of the actuated longerons."""
        return tuple(i for i, longeron in enumerate(self.longerons) if longeron.cylinder is not None)


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


class Section(Description):
    """A static section of any shape: tapered, twisted, with end faces that are not parallel, or as measured.

    Attributes:
        name: Unique in the arm.
        base: Sides 12, 23, 31 of its base, m; absent for the arm's face side.
        top: Sides 12, 23, 31 of its top, m; absent for those of the base.
        length: Distance between the centroids of the faces along the base's normal, m; absent with a transform.
        tilt: Roll about X and pitch about Y of the top face, rad.
        twist: Turn of the top face about its own normal, rad; -60 degrees makes an antiprism.
        transform: Measured T_BT in place of length, tilt and twist: four rows of four, the last column in m.
        longeron_tube: Tube of the three longerons.
        cross_longeron_tube: Tube of the three diagonals.
        batten_tube: Tube of the three battens of its top face.
    """

    kind: Literal["section"]
    name: Name
    base: _Sides | None = None
    top: _Sides | None = None
    length: Length | None = Field(default=None, gt=0)
    tilt: tuple[Angle, Angle] = (0.0, 0.0)
    twist: Angle = 0.0
    transform: tuple[tuple[Number, Number, Number, Number], ...] | None = Field(
        default=None, min_length=4, max_length=4
    )
    longeron_tube: Name
    cross_longeron_tube: Name
    batten_tube: Name

    @model_validator(mode="after")
    def _one_shape(self) -> Section:
        if (self.length is None) == (self.transform is None):
            raise ValueError(f"module {self.name}: either a length or a measured transform")
        if self.transform is not None:
            if self.tilt != (0.0, 0.0) or self.twist:
                raise ValueError(f"module {self.name}: a measured transform leaves no tilt or twist to give")
            if self.transform[3] != (0.0, 0.0, 0.0, 1.0):
                raise ValueError(f"module {self.name}: the transform's last row must be 0, 0, 0, 1")
        return self


Actuated = DoubleOctahedral | GeneralDoubleOctahedral | Tetrahedral | Octahedral
Module = Annotated[
    Actuated | Prism | Section,
    Field(discriminator="kind"),
]
KINDS = ("double_octahedral", "double_octahedral_general", "tetrahedral", "octahedral", "prism", "section")


def face_sides(module: Module, default: float) -> tuple[Sides, Sides]:
    """Sides 12, 23, 31 of a module's end faces.

    Args:
        module: The module.
        default: The arm's face side, m, which stands wherever the module says nothing.

    Returns:
        Of the base and of the top, m.
    """
    whole = (default, default, default)
    if isinstance(module, Tetrahedral):
        side, hinge = module.side or default, module.hinge or default
        return (side, side, hinge), (side, side, hinge)
    if isinstance(module, Octahedral | GeneralDoubleOctahedral):
        return module.base or whole, module.top or whole
    if isinstance(module, Section):
        base = module.base or whole
        return base, module.top or base
    return whole, whole


def joint_offset(module: Module) -> float:
    """Ljo of a module, m: its mid-plane nodes are joint blocks where it is not zero."""
    return module.joint_offset if isinstance(module, DoubleOctahedral | GeneralDoubleOctahedral) else 0.0


def altitude(module: Tetrahedral, default: float) -> float:
    """Altitude h of a tetrahedral module's triangles on their hinge (3.1).

    Args:
        module: The module; its triangles must close.
        default: The arm's face side, m.

    Returns:
        m.
    """
    (side, _, hinge), _ = face_sides(module, default)
    return sqrt(side**2 - hinge**2 / 4)
