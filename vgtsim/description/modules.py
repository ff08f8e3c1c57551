"""The kinds of modules an arm is made of, and the face triangles at which they meet (chapter 3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi, sin, sqrt
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

from vgtsim.description.figures import Angle, Gap, Number, Size, SizeOrZero
from vgtsim.description.schema import Description, Name, Note

if TYPE_CHECKING:
    from vgtsim.description.manipulator import Manipulator

Sides = tuple[float, float, float]
_Sides = tuple[Size, Size, Size]


class ModuleKind(Description):
    """The root of every kind of module; names are unique in the arm. `ends`: whether the module can be the last of an arm.

    Attributes:
        unproved: Reason to use all strokes without a proof that they hold no singularity. A run refuses a way that meets one.
    """

    ends: ClassVar[bool] = True
    name: Name
    unproved: Note | None = None

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 0

    @property
    def offset(self) -> float:
        """Ljo, m: its mid-plane nodes are joint blocks where it is not zero."""
        return 0.0

    @property
    def stowed_cylinder(self) -> str:
        """The kind of cylinder that is retracted where the module passes the riser; empty where none needs to be."""
        return ""

    def faces(self, side: float) -> tuple[Sides, Sides]:
        """Sides 12, 23, 31 of the base and of the top, m; `side` is the face side of the arm, m."""
        return (side, side, side), (side, side, side)

    def parts(self) -> Iterator[tuple[str, str, str]]:
        """Give for each part that the module names: the field, the name, and the arm's table that must hold the name."""
        for field in type(self).model_fields:
            if field.endswith("_tube"):
                yield field, getattr(self, field), "tubes"
            elif field in ("cylinder", "block") and getattr(self, field) is not None:
                yield field, getattr(self, field), f"{field}s"

    def sections(self) -> dict[str, str]:
        """Names of its tubes and cylinders by field; members that share a section stand once, under their first field."""
        return {field: name for field, name, table in self.parts() if table != "blocks"}

    def section_of(self, role: str, number: int) -> str:  # noqa: ARG002  # for kinds whose longerons differ
        """Field of `sections` that a member has its section from, by its role and its number, from 1, within the role."""
        return "cylinder" if role == "actuator" else f"{role}_tube"

    def with_sections(self, names: Mapping[str, str]) -> Self:
        """The module with other tubes and cylinders, named by the fields of `sections`."""
        return self.model_copy(update=dict(names))

    def check(self, arm: Manipulator) -> None:
        """Check that the module fits the arm's parts; a ValueError says which dimension is wrong."""

    def wrong(self, text: str) -> ValueError:
        """Make an error that names the module."""
        return ValueError(f"module {self.name}: {text}")

    def require_straight(self, length: float, name: str, arm: Manipulator) -> None:
        """Check that the stroke of a cylinder holds the length of the straight pose, m."""
        cylinder = arm.cylinders[name]
        if not cylinder.retracted <= length <= cylinder.extended:
            raise self.wrong(f"straight length {length:.4g} m outside the stroke of {name}, {cylinder.span}")


class FreeFaces(ModuleKind):
    """A module with end faces of its own: sides 12, 23, 31 of its base and of its top; absent for the arm's face side."""

    base: _Sides | None = None
    top: _Sides | None = None

    def faces(self, side: float) -> tuple[Sides, Sides]:
        """Sides of its own faces, or those of the arm, m."""
        return self.base or (side, side, side), self.top or (side, side, side)


class BattenActuated(ModuleKind):
    """A double-octahedral module of any shape: three actuators among its mid-plane nodes.

    Attributes:
        joint_offset: Ljo of equation 3.54: distance between the two mid-plane node triangles.
        block: Joint block of the mid-plane nodes; a module has one if it has an offset.
        longeron_tube: Tube of the twelve longerons.
        batten_tube: Tube of the three battens of its top face.
    """

    joint_offset: Gap = 0.0
    block: Name | None = None
    longeron_tube: Name
    batten_tube: Name
    cylinder: Name

    @model_validator(mode="after")
    def _offset_has_blocks(self) -> Self:
        if bool(self.joint_offset) != (self.block is not None):
            found = "no block" if self.block is None else f"block {self.block!r}"
            together = "a joint offset and its block go together"
            raise self.wrong(f"joint_offset of {self.joint_offset:.4g} m with {found}; {together}")
        return self

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 3

    @property
    def offset(self) -> float:
        """Ljo, m."""
        return self.joint_offset

    @property
    def stowed_cylinder(self) -> str:
        """That of all three actuators."""
        return self.cylinder

    def check(self, arm: Manipulator) -> None:
        """Check that the joint block keeps the balls of the longerons apart."""
        if self.block is None:
            return
        ball, post = 2 * arm.hub.radius, arm.blocks[self.block].diameter
        if self.joint_offset <= ball:
            keeps = f"keeps the balls at both ends of {self.block} apart only above their diameter, {ball:.4g} m"
            raise self.wrong(f"joint offset of {self.joint_offset:.4g} m {keeps}")
        if post > ball:
            raise ValueError(f"block {self.block}: post of {post:.4g} m at most as thick as its balls, {ball:.4g} m")


class DoubleOctahedral(BattenActuated):
    """A symmetric batten-actuated double-octahedral module with twelve equal longerons (sections 3.5.3 and 3.5.4).

    `straight` is the extension 2d of its straight working pose.
    """

    kind: Literal["double_octahedral"]
    longeron: Size
    straight: Size

    def check(self, arm: Manipulator) -> None:
        """Check the joint block, and that the longerons close on the arm's faces and reach the straight pose."""
        super().check(arm)
        least = arm.face_side / 2
        if self.longeron <= least:
            side = f"a face side of {arm.face_side:.4g} m; longer than {least:.4g} m"
            raise self.wrong(f"longerons of {self.longeron:.4g} m do not close a triangle on {side}")
        height = 2 * sqrt(self.longeron**2 - least**2) + self.joint_offset
        if self.straight >= height:
            raise self.wrong(
                f"straight extension {self.straight:.4g} m below that of upright longerons, {height:.4g} m"
            )


class GeneralDoubleOctahedral(FreeFaces, BattenActuated):
    """A batten-actuated double-octahedral module whose longerons and faces may all differ (sections 3.5.1 and 3.5.2).

    Its base is n1 n2 n3, its top n7 n8 n9.

    Attributes:
        longerons: Lengths of L1 to L12 = n1 n4, n2 n5, n3 n6, n3 n4, n1 n5, n2 n6, n5' n7, n6' n8, n4' n9, n4' n7,
            n5' n8, n6' n9, m; without a joint offset n4' is n4, and so on.
        straight: Length of the three actuators in the straight working pose.
    """

    kind: Literal["double_octahedral_general"]
    longerons: tuple[SizeOrZero, ...] = Field(min_length=12, max_length=12)
    straight: Size

    @model_validator(mode="after")
    def _lengths_are_lengths(self) -> GeneralDoubleOctahedral:
        for number, length in enumerate(self.longerons, 1):
            if length <= 0:
                raise self.wrong(f"longeron L{number} of {length:.4g} m, must be longer than 0")
        return self

    def check(self, arm: Manipulator) -> None:
        """Check the joint block and that the stroke holds the straight pose."""
        super().check(arm)
        self.require_straight(self.straight, self.cylinder, arm)


class Tetrahedral(ModuleKind):
    """A hinge of two static triangles about the third side of its base (section 3.3).

    Its base and its top are the triangle of sides L1, L1, L2, apex at the second corner; the actuator joins the two
    apexes. It cannot end an arm: the tip plate would have to hold the hinge line too.

    Attributes:
        side: L1; absent for the arm's face side.
        hinge: L2, of the hinge line; absent for the arm's face side.
        batten_tube: Tube of the two sides of its top.
        straight: Hinge angle theta of the straight working pose.
    """

    ends = False
    kind: Literal["tetrahedral"]
    side: Size | None = None
    hinge: Size | None = None
    batten_tube: Name
    cylinder: Name
    straight: Angle = Field(gt=0, lt=pi)

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return 1

    def faces(self, side: float) -> tuple[Sides, Sides]:
        """Sides of both triangles."""
        whole = (self.side or side, self.side or side, self.hinge or side)
        return whole, whole

    def altitude(self, side: float) -> float:
        """Altitude h of the triangles on their hinge (3.1), m; they must close."""
        (leg, _, hinge), _ = self.faces(side)
        return sqrt(leg**2 - hinge**2 / 4)

    def check(self, arm: Manipulator) -> None:
        """Check that the stroke holds the straight pose and ends below the flat pose."""
        flat, cylinder = 2 * self.altitude(arm.face_side), arm.cylinders[self.cylinder]
        if cylinder.extended >= flat:
            end = f"the stroke of {self.cylinder} ends at {cylinder.extended:.4g} m"
            raise self.wrong(f"{end} and crosses the singular flat pose at l = 2 h = {flat:.4g} m")
        straight = flat * sin(self.straight / 2)
        if not cylinder.retracted <= straight <= cylinder.extended:
            raise self.wrong(f"straight pose needs {straight:.4g} m of {self.cylinder}, which has {cylinder.span}")


class Longeron(Description):
    """One longeron of an octahedral module: a cylinder, or a tube with its length."""

    cylinder: Name | None = None
    tube: Name | None = None
    length: Size | None = None

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Longeron:
        if (self.cylinder is None) == (self.tube is None) or (self.tube is None) != (self.length is None):
            raise ValueError("either a cylinder, or a tube and its length")
        return self


class Octahedral(FreeFaces):
    """A longeron-actuated octahedral module, a Stewart platform (section 3.4): base n1 n2 n3, top n4 n5 n6.

    Attributes:
        longerons: l1 to l6 = n1 n4, n2 n5, n3 n6, n3 n4, n1 n5, n2 n6; at least one is a cylinder.
        batten_tube: Tube of the three battens of its top.
        straight: Length of the actuated longerons in the straight working pose.
    """

    kind: Literal["octahedral"]
    longerons: tuple[Longeron, ...] = Field(min_length=6, max_length=6)
    batten_tube: Name
    straight: Size

    @property
    def freedom(self) -> int:
        """Number of actuators."""
        return len(self.actuated)

    @model_validator(mode="after")
    def _something_moves(self) -> Octahedral:
        if not self.actuated:
            raise self.wrong("one to six longerons with a cylinder; none has")
        return self

    @property
    def actuated(self) -> tuple[int, ...]:
        """Indices of the actuated longerons."""
        return tuple(i for i, longeron in enumerate(self.longerons) if longeron.cylinder is not None)

    def sections(self) -> dict[str, str]:
        """As of any module; longerons that name the same tube or cylinder share it."""
        found = super().sections()
        shared = {self.section_of("longeron", number) for number in range(1, 7)}
        return {field: name for field, name in found.items() if field in shared or "longerons" not in field}

    def section_of(self, role: str, number: int) -> str:
        """As of any module; of longerons and actuators the field of the first that names the same section."""
        if role == "batten":
            return super().section_of(role, number)
        mine = self.longerons[number - 1]
        alike = [(other.cylinder, other.tube) == (mine.cylinder, mine.tube) for other in self.longerons]
        return f"longerons.{alike.index(True)}.{'tube' if mine.cylinder is None else 'cylinder'}"

    def with_sections(self, names: Mapping[str, str]) -> Self:
        """As of any module."""
        longerons = []
        for number, longeron in enumerate(self.longerons, 1):
            field = self.section_of("longeron", number)
            longerons.append(longeron.model_copy(update={field.split(".")[-1]: names[field]} if field in names else {}))
        others = {field: name for field, name in names.items() if "longerons" not in field}
        return self.model_copy(update={"longerons": tuple(longerons), **others})

    def parts(self) -> Iterator[tuple[str, str, str]]:
        """Parts of the module and of each longeron."""
        yield from super().parts()
        for i, longeron in enumerate(self.longerons):
            if longeron.cylinder is not None:
                yield f"longerons.{i}.cylinder", longeron.cylinder, "cylinders"
            elif longeron.tube is not None:
                yield f"longerons.{i}.tube", longeron.tube, "tubes"

    def check(self, arm: Manipulator) -> None:
        """Check that each stroke holds the straight pose."""
        for i in self.actuated:
            cylinder = self.longerons[i].cylinder
            assert cylinder is not None  # of an actuated longeron
            self.require_straight(self.straight, cylinder, arm)


class StaticKind(ModuleKind):
    """A static section: tubes of three longerons, of three diagonals, and of the three battens of its top face."""

    longeron_tube: Name
    cross_longeron_tube: Name
    batten_tube: Name


class Prism(StaticKind):
    """A static section: a triangular prism with one diagonal in each side (section 3.6)."""

    kind: Literal["prism"]
    length: Size


class SectionModule(FreeFaces, StaticKind):
    """A static section of any shape: tapered, twisted, with end faces that are not parallel, or as measured.

    Attributes:
        length: Distance between the centroids of the faces along the base's normal; absent with a transform.
        tilt: Roll about X and pitch about Y of the top face.
        twist: Turn of the top face about its own normal; -60 degrees makes an antiprism.
        transform: Measured T_BT in place of length, tilt and twist: four rows of four, the last column in m.
    """

    kind: Literal["section"]
    length: Size | None = None
    tilt: tuple[Angle, Angle] = (0.0, 0.0)
    twist: Angle = 0.0
    transform: tuple[tuple[Number, Number, Number, Number], ...] | None = Field(
        default=None, min_length=4, max_length=4
    )

    @model_validator(mode="after")
    def _one_shape(self) -> SectionModule:
        if (self.length is None) == (self.transform is None):
            raise self.wrong("either a length or a measured transform")
        if self.transform is not None:
            if self.tilt != (0.0, 0.0) or self.twist:
                raise self.wrong("a measured transform leaves no tilt or twist to give")
            if self.transform[3] != (0.0, 0.0, 0.0, 1.0):
                raise self.wrong("the transform's last row must be 0, 0, 0, 1")
        return self

    def faces(self, side: float) -> tuple[Sides, Sides]:
        """Sides of its own faces; the top is like the base where it is not given."""
        base = self.base or (side, side, side)
        return base, self.top or base


_Kinds = DoubleOctahedral | GeneralDoubleOctahedral | Tetrahedral | Octahedral | Prism | SectionModule
Module = Annotated[_Kinds, Field(discriminator="kind")]
KIND_NAMES = tuple(get_args(kind.model_fields["kind"].annotation)[0] for kind in get_args(_Kinds))
