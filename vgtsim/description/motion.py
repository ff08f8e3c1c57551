"""The task of an arm: where it starts, the goals of its tool, how it is driven to them, and how it uses its redundancy."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from vgtsim.constants import Method
from vgtsim.description.figures import Acceleration, Angle, Gap, Length, Number, Speed, Wait
from vgtsim.description.modules import Module
from vgtsim.description.schema import Description, Name, closest, require_distinct

Vector = tuple[Length, Length, Length]
BENDS, POSTURE, WORD = "list of bends", "table of a posture", "word for a posture"  # the forms of `motion.start`
OBJECTIVES = (
    "actuator_force",
    "clearance",
    "condition_number",
    "in_plane",
    "length_variation",
    "mid_stroke",
    "stroke_barrier",
    "utilisation",
)
TOOL_ROWS = 5  # of a tool goal: three of the position, two of the direction

Pairs = tuple[tuple[str, str], ...]


def _unit(value: tuple[float, float, float]) -> tuple[float, float, float]:
    length = hypot(*value)
    if length < 1e-9:  # rounding of a figure such as "0 m", not a short vector
        raise ValueError("a direction that is not zero")
    x, y, z = value
    return (x / length, y / length, z / length)


Direction = Annotated[tuple[Number, Number, Number], AfterValidator(_unit)]


class GoalPlace(Description):
    """A pose of the tool by a named place of the tank; azimuths are from +x of frame G, counter-clockwise from above.

    Attributes:
        place: `"wall"` with `azimuth`, `height` and `distance`. `"waste"` with `azimuth`, `radius` and `height`. The name of
            equipment with `distance` and `height`. The name of an earlier goal with `offset`.
        azimuth: Of the tool point about the tank axis; at equipment, the side of it that the tool is on, by default that
            of the mast.
        radius: Distance of the tool point from the tank axis.
        height: Height of the tool point: z of frame G, but over the waste above its surface.
        distance: From the tool point to the wall or to the surface of equipment, horizontally.
        offset: From the tool point of the earlier goal, along the axes of its tool frame: x up, y level, z its direction.
        elevation: Angle of the tool's direction above the horizontal; by default -30 degrees over waste, that of the earlier
            goal, or 0.
        heading: Azimuth of the tool's direction; by default towards wall or equipment, over waste away from the mast, or
            that of the earlier goal.
    """

    place: Name
    azimuth: Angle | None = None
    radius: Gap | None = None
    height: Length | None = None
    distance: Gap | None = None
    offset: Vector | None = None
    elevation: Angle | None = None
    heading: Angle | None = None


class Goal(Description):
    """A tool pose to reach and hold.

    Attributes:
        position: Tool point in frame G; with `direction`, or else `at`.
        direction: Outward normal of the tip plate in frame G, of any length.
        at: The pose by a named place, in place of `position`; with a `direction`, the place gives the tool point alone.
    """

    name: Name
    position: Vector = (0.0, 0.0, 0.0)  # stands for none until the place is looked up
    direction: Direction = (0.0, 0.0, -1.0)
    at: GoalPlace | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Goal:
        if self.at is None and not {"position", "direction"} <= self.model_fields_set:
            raise ValueError("position and direction, or at")
        if self.at is not None and "position" in self.model_fields_set:
            raise ValueError("position or at, not both")
        return self


class Bend(Description):
    """Shape of one active module: a symmetric bend, whose mid-plane is inclined by half the angle.

    Attributes:
        angle: Angle between the end faces. A hinge opens by this angle beyond its straight pose.
        azimuth: Direction of the bend, from the x axis of the arm's base frame while the arm is straight. A hinge has
            none.
        extension: Double octahedron: 2d of equation 3.54. Octahedron: distance between the centroids of its faces.
            Absent for the straight extension.
    """

    angle: Angle = 0.0
    azimuth: Angle = 0.0
    extension: Length | None = None


class StartPosture(Description):
    """The posture that a scene starts from, in one of three forms.

    Attributes:
        lengths: Length of each actuator, from the mast to the tool.
        inputs: Canonical inputs, from the mast to the tool, m and rad: what `vgtsim ik` prints.
        position: Tool point in frame G. The posture is solved for it, clear of everything.
        direction: Outward normal of the tip plate in frame G, with `position`.
    """

    lengths: tuple[Length, ...] | None = Field(default=None, max_length=1000)
    inputs: tuple[float, ...] | None = Field(default=None, max_length=1000)
    position: Vector | None = None
    direction: Direction | None = None

    @model_validator(mode="after")
    def _one_form(self) -> StartPosture:
        given = [name for name in ("lengths", "inputs", "position") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"one of lengths, inputs and position, not {' and '.join(given) or 'none of them'}")
        if (self.position is None) != (self.direction is None):
            raise ValueError("position and direction together")
        return self


def _form_of_start(value: object) -> str | None:
    """The form in which a start is written."""
    if isinstance(value, str):
        return WORD
    if isinstance(value, list | tuple):
        return BENDS
    return POSTURE if isinstance(value, dict | StartPosture) else None


STARTS = 'a list of bends, a table with lengths, inputs or a tool pose, "stowed", a file that `vgtsim ik --json` left, or no key'


def _require_word(value: str) -> str:
    if value != "stowed":
        raise ValueError(STARTS)
    return value


Start = Annotated[
    Annotated[tuple[Bend, ...], Field(max_length=100), Tag(BENDS)]
    | Annotated[StartPosture, Tag(POSTURE)]
    | Annotated[Literal["stowed"], BeforeValidator(_require_word), Tag(WORD)],
    Discriminator(_form_of_start, custom_error_type="start", custom_error_message=STARTS),
]


def split_objective(text: str) -> tuple[str, float]:
    """Split an objective written `NAME` or `NAME:WEIGHT` into name and weight; the weight is 1 if none is written.

    Raises:
        ValueError: The name is not known, or the weight is no number above zero. The message says what is allowed.
    """
    name, colon, number = text.partition(":")
    if name not in OBJECTIVES:
        raise ValueError(f"NAME or NAME:WEIGHT of an objective{closest(name, OBJECTIVES)}")
    try:
        weight = float(number) if colon else 1.0
    except ValueError:
        weight = -1.0
    if not 0 < weight < inf:
        raise ValueError(f"{name} with a weight that is a number above zero")
    return name, weight


def _known(text: str) -> str:
    split_objective(text)
    return text


ObjectiveName = Annotated[str, AfterValidator(_known)]


class Motion(Description):
    """The tour and how it is driven.

    Attributes:
        start: Posture at the start. A list has the shape of each active module, from the mast to the tool. A table has
            lengths, inputs or a pose of the tool. A text is `"stowed"`, or the path of a file of `vgtsim ik --json` beside the
            scene. Absent, a posture clear of everything is searched, the same one every time.
        objective: Terms of the objective at the goals, each `NAME` or `NAME:WEIGHT`.
        coupling: Names (follower, leader) of coupled modules, for the methods `coupled` and `anchored`. Windows of the anchored
            method count coupled modules as one; see `choose_coupling`.
        rate_fraction: Part of the cylinders' rated speed that the plan may use.
        acceleration: Greatest acceleration of a cylinder.
        stroke_margin: Distance that the plan keeps from the ends of the strokes.
        clearance: Distance that the plan keeps from tank, riser, obstacles and the arm itself.
        settle_speed: A goal is settled when no node is faster than this; it is then held for the time `hold`.
        patience: Longest wait for settling.
        goals: In the order of the tour; none where an operator drives the arm.
    """

    start: Start | None = None
    method: Method = Method.NULLSPACE
    objective: tuple[ObjectiveName, ...] = Field(
        default=("clearance", "stroke_barrier:0.01", "in_plane:10"), min_length=1
    )
    coupling: tuple[tuple[Name, Name], ...] | None = None
    rate_fraction: Number = Field(default=0.4, gt=0, ge=1e-3, le=1)
    acceleration: Acceleration = Field(default=0.02, gt=0)  # full speed of a slow cylinder in about two seconds
    stroke_margin: Gap = 0.005
    clearance: Gap = 0.1
    settle_speed: Speed = 1e-7  # an arm this slow is within 1e-6 of its forces at rest
    hold: Wait = 2.0
    patience: Wait = 10.0
    goals: tuple[Goal, ...] = Field(default=(), max_length=1000)

    @property
    def couples(self) -> bool:
        """Whether active modules move as one."""
        return self.method is Method.COUPLED or self.coupling is not None

    @model_validator(mode="after")
    def _entries_fit(self) -> Motion:
        require_distinct("goal", self.goals)
        if self.coupling is not None and self.method not in (Method.COUPLED, Method.ANCHORED):
            raise ValueError(f'coupling with method = "coupled" or "anchored" only, not {self.method.value!r}')
        return self


def choose_coupling(pairs: Pairs | None, modules: Sequence[Module]) -> tuple[tuple[int, int], ...]:
    """Choose the active modules that follow others: indices (follower, leader) from pairs of such names.

    No pairs stand for those of section 8.1: the two modules nearest the mast and the two nearest the tool, as far as
    these differ.

    Raises:
        ValueError: The arm cannot be coupled so, or too few inputs are left for a tool goal. The message says what is
            allowed.
    """
    names, freedom = tuple(module.name for module in modules), [module.freedom for module in modules]
    if pairs is None:
        ends = ((0, 1), (len(names) - 1, len(names) - 2))[: min(len(names) // 2, 2)]
        chosen = tuple(pair for pair in ends if modules[pair[0]].kind == modules[pair[1]].kind)
    else:
        chosen = tuple((_index(follower, names), _index(leader, names)) for follower, leader in pairs)
    if not chosen:
        raise ValueError(f"at least one pair [follower, leader] of the active modules: {', '.join(names)}")
    followers, leaders = [pair[0] for pair in chosen], {pair[1] for pair in chosen}
    if len(set(followers)) < len(followers) or leaders & set(followers):
        raise ValueError("pairs [follower, leader] in which no module follows twice, or leads and follows")
    for follower, leader in chosen:
        if modules[follower].kind != modules[leader].kind:
            kinds = f"{names[follower]} is {modules[follower].kind}, {names[leader]} {modules[leader].kind}"
            raise ValueError(f"pairs of modules of one kind; {kinds}")
    left = sum(freedom) - sum(freedom[follower] for follower in followers)
    if left < TOOL_ROWS:
        most = max(0, len(names) - -(-TOOL_ROWS // max(freedom)))
        raise ValueError(f"at most {most} pairs: a tool goal has {TOOL_ROWS} rows, and {left} inputs would be left")
    return chosen


def _index(name: str, modules: tuple[str, ...]) -> int:
    if name not in modules:
        raise ValueError(f"pairs [follower, leader] of active modules; {name!r} is none{closest(name, modules)}")
    return modules.index(name)
