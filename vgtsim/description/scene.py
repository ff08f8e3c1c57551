"""A scene: an arm on a mast in a tank, its load, its task and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, field_validator, model_validator

from vgtsim.constants import GRAVITY, Method
from vgtsim.description.figures import (
    Acceleration,
    Angle,
    Density,
    Force,
    Frequency,
    Gap,
    Length,
    Mass,
    Moment,
    Number,
    Size,
    Speed,
    Step,
    Wait,
)
from vgtsim.description.judging import Limits, Video
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mission import MissionStep, MoveStep, RunStage, find_disorder
from vgtsim.description.operator import Operator, OperatorCommand
from vgtsim.description.redundancy import ObjectiveName, choose_coupling
from vgtsim.description.schema import Description, Name, Provenance, Title, closest, require_distinct
from vgtsim.description.sections import Pipe
from vgtsim.description.tank import Tank
from vgtsim.errors import DescriptionError

Vector = tuple[Length, Length, Length]
Direction = tuple[Number, Number, Number]
BENDS, POSTURE, WORD = "list of bends", "table of a posture", "word for a posture"  # the forms of `motion.start`


class Feed(Description):
    """The hoist that lifts the mast, and the arm with it.

    Attributes:
        stroke: Greatest lift above the working depth.
        rate: Rated speed.
        acceleration: Greatest acceleration.
        force: Greatest pull.
    """

    stroke: Size
    rate: Speed
    acceleration: Acceleration = Field(gt=0)
    force: Force = Field(gt=0)


class Mast(Pipe):
    """The pipe that carries the arm through the riser; the arm's base face is `pivot_depth` below the dome's crown.

    `riser_spare` is the least gap between the stowed arm and the riser's bore, 1.5 in if absent. Without a `feed` the mast is
    held at its working depth.
    """

    pivot_depth: Size
    density: Density = 7850.0  # structural steel
    riser_spare: Size | None = None
    feed: Feed | None = None


class Payload(Description):
    """The load at the tool point, a ball about it."""

    mass: Mass
    radius: Size


class Conveyance(Description):
    """A hose or a chain of conveyors that carries waste up through the open truss.

    Attributes:
        diameter: Its greatest outer diameter, couplings included.
        bend_radius: Least radius that it may be bent to; 0 for conveyors whose universal joints stand in active modules.
    """

    diameter: Size
    bend_radius: Gap = 0.0


class GoalPlace(Description):
    """A pose of the tool by a named place of the tank; azimuths are from +x of frame G, counter-clockwise from above.

    Attributes:
        place: `"wall"`, needs `azimuth`, `height` and `distance`; `"waste"`, needs `azimuth`, `radius` and `height`; the name
            of equipment, needs `distance` and `height`; or the name of an earlier goal, needs `offset`.
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

    @field_validator("direction")
    @classmethod
    def _unit(cls, value: Direction) -> Direction:
        return _unit(value)

    @model_validator(mode="after")
    def _one_form(self) -> Goal:
        if self.at is None and not {"position", "direction"} <= self.model_fields_set:
            raise ValueError("position and direction, or at")
        if self.at is not None and "position" in self.model_fields_set:
            raise ValueError("position or at, not both")
        return self


def _unit(value: Direction) -> Direction:
    length = hypot(*value)
    if length < 1e-9:
        raise ValueError("a direction that is not zero")
    x, y, z = value
    return (x / length, y / length, z / length)


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

    @field_validator("direction")
    @classmethod
    def _unit(cls, value: Direction | None) -> Direction | None:
        return value and _unit(value)

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


class Motion(Description):
    """The tour and how it is driven.

    Attributes:
        start: Posture at the start: a list with the shape of each active module, from the mast to the tool; a table with
            lengths, inputs or a pose of the tool; `"stowed"`; or the path of a file that `vgtsim ik --json` left, beside
            the scene. Absent: a posture clear of everything is searched, the same one every time.
        objective: Terms of the objective at the goals, each `NAME` or `NAME:WEIGHT`.
        coupling: Names (follower, leader) of coupled modules, for the coupled method; see `choose_coupling`.
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

    @model_validator(mode="after")
    def _entries_fit(self) -> Motion:
        require_distinct("goal", self.goals)
        if self.coupling is not None and self.method is not Method.COUPLED:
            raise ValueError(f'coupling with method = "coupled" only, not {self.method.value!r}')
        return self


class Simulation(Description):
    """Settings of the step loop.

    Attributes:
        timestep: Absent for the longest that members, drives, records and plan allow.
        log_rate: Records a second.
        weight_scale: Factor on the inverse weights that regularise the constraints.
        drive: The cylinder lengths are imposed (`rigid`), held by a spring and damper (`servo`), or moved by valve and
            oil (`hydraulic`, elastic members only).
        servo_stiffness: N/m; `servo_damping` is in N·s/m.
        members: `rigid` members keep their lengths; `elastic` ones are springs along their axes. Under the `rigid`
            drive an elastic cylinder is its oil column and rod in series, set to the commanded length. `sections` is a
            model of a tenth of the cost: static modules are rigid bodies, members of active ones are lengths, forces
            inside static modules come from statics and contacts from distances. For rigid drives.
        member_mass: The mass of a member is spread along it (`distributed`), or sits in its two hubs (`lumped`) and
            leaves a massless bar.
        damping_ratio: Structural damping of the slowest mode of an elastic arm in its start posture. It is proportional
            to stiffness, so faster modes are damped more. 0 for the least that the step can hold.
        valve_gain: Speed of a hydraulic cylinder per length error, 1/s.
        lock_band: Length error below which a cylinder at rest is locked.
    """

    timestep: Step | None = None
    log_rate: Frequency = Field(default=25.0, gt=0)
    gravity: Acceleration = Field(default=GRAVITY, ge=0)
    weight_scale: Number = Field(default=1e-5, ge=1e-9, le=1)
    drive: Literal["rigid", "servo", "hydraulic"] = "rigid"
    servo_stiffness: Annotated[float, Field(ge=1, le=1e13)] = 1e8
    servo_damping: Annotated[float, Field(ge=1e-3, le=1e13)] = 1e6
    members: Literal["rigid", "elastic", "sections"] = "rigid"
    member_mass: Literal["distributed", "lumped"] = "distributed"
    damping_ratio: Number = Field(default=0.02, ge=0, lt=1)
    valve_gain: Frequency = Field(default=1.0, gt=0)
    lock_band: Gap = 5e-5

    @property
    def lumped(self) -> bool:
        """Whether the members' mass sits in their hubs."""
        return self.member_mass == "lumped"

    @model_validator(mode="after")
    def _entries_fit(self) -> Simulation:
        if self.members == "sections" and self.drive != "rigid":
            raise ValueError(
                f'drive = "rigid" with members = "sections", whose lengths are imposed, not {self.drive!r}'
            )
        if self.drive == "hydraulic" and self.members != "elastic":
            raise ValueError('members = "elastic" with a hydraulic drive: its oil is a spring')
        if self.timestep is None:
            return self
        ratio = 1 / (self.log_rate * self.timestep)
        if abs(ratio - round(ratio)) > 1e-6 or ratio < 1 - 1e-6:
            raise ValueError(f"log_rate a whole fraction of the step rate {1 / self.timestep:.6g} Hz")
        return self


class LoadCase(Description):
    """A combination of static loads that the arm must carry in every pose of its run.

    Attributes:
        dead: Factor on the arm's weight; `payload` on the payload's.
        dynamic: Factor on all weight, for jerks and sudden stops.
        seismic: Accelerations of all masses along x, y and z of frame G, parts of gravity.
        shaking: Horizontal acceleration of all masses, part of gravity; each member takes its worst direction.
        force: On the tool in frame G, as is `moment`.
        reaction: Force on the tool; each member takes its worst direction.
    """

    name: Name
    dead: Number = Field(default=1.0, gt=0, le=100)
    payload: Number = Field(default=1.0, ge=0, le=100)
    dynamic: Number = Field(default=1.0, gt=0, le=100)
    seismic: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    shaking: Number = Field(default=0.0, ge=0)
    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    moment: tuple[Moment, Moment, Moment] = (0.0, 0.0, 0.0)
    reaction: Force = Field(default=0.0, ge=0)


class AllowedContact(Description):
    """A part of the arm that may touch a place.

    Attributes:
        part: The `tool` with the tip plate and its hubs, the other `hubs`, the `members` or the `mast`.
        place: `shell`, `riser`, `waste` or the name of a piece of equipment.
        force: Greatest force of the contact; absent, it is not judged.
    """

    part: Literal["tool", "hubs", "members", "mast"]
    place: str
    force: Force | None = Field(default=None, gt=0)


class SceneFile(Description):
    """A scene as written; `manipulator` and `tank` are shipped names, or paths relative to the scene's file.

    `provenance` gives the sources of the figures by key path. `loads` are load cases besides the run. `mission` are steps
    from above the riser and back, which stand for the tour of the goals; its start is then above the riser.
    `operator` is for an
    arm that a person drives, in place of goals. Whatever touches and is not among the `contacts` is a collision, which ends a
    run. `conveyance` is the line through the truss; absent where there is none.
    """

    name: Name
    title: Title
    manipulator: str
    tank: str
    mast: Mast
    payload: Payload
    conveyance: Conveyance | None = None
    motion: Motion
    simulation: Simulation = Simulation()
    limits: Limits = Limits()
    operator: Operator | None = None
    loads: tuple[LoadCase, ...] = Field(default=(), max_length=100)
    mission: tuple[MissionStep, ...] = Field(default=(), max_length=1000)
    contacts: tuple[AllowedContact, ...] = Field(default=(), max_length=100)
    video: Video = Video()
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _entries_fit(self) -> SceneFile:
        require_distinct("load case", self.loads)
        if self.operator is None and not self.motion.goals:
            raise ValueError("motion.goals, or a table [operator] for an arm that a person drives")
        if self.operator is not None:
            if self.motion.goals:
                raise ValueError("either motion.goals or a table [operator]")
            step, rate = self.simulation.timestep, self.simulation.log_rate
            if step is None or abs(step * rate - 1) > 1e-6:
                raise ValueError("simulation.timestep of 1 / log_rate with an operator, whose every step is recorded")
        return self

    @property
    def stages(self) -> tuple[RunStage, ...]:
        """Stages of the run: the goals in turn, or the steps of the mission."""
        poses = {goal.name: RunStage(goal.name, goal.position, goal.direction) for goal in self.motion.goals}
        if not self.mission:
            return tuple(poses.values())
        return tuple(
            poses.get(step.goal, RunStage("")) if isinstance(step, MoveStep) else RunStage(step.do)
            for step in self.mission
        )


@dataclass(frozen=True)
class Scene:
    """A scene's file with the arm, the tank and the operator's commands that it names."""

    task: SceneFile
    manipulator: Manipulator
    tank: Tank
    file: Path
    commands: tuple[OperatorCommand, ...] = ()

    def __post_init__(self) -> None:
        """Check that the three files fit together.

        Raises:
            DescriptionError: The pivot is outside the tank, the mast is too thick, or the start does not fit the arm.
        """
        mast, tank, arm = self.task.mast, self.tank, self.manipulator
        wrong = find_disorder(self.task.mission, [goal.name for goal in self.task.motion.goals])
        if wrong is not None:
            raise self.error(f"mission.{wrong[0]}", wrong[1], wrong[2])
        if not 0 < self.pivot_height < tank.shell.crown:
            found = f"{mast.pivot_depth:.4g} m, a pivot at z = {self.pivot_height:.4g} m"
            allowed = f"a depth that leaves the pivot inside the tank, 0 to {tank.shell.crown:.4g} m"
            raise self.error("mast.pivot_depth", found, allowed)
        if mast.outer_diameter >= tank.arm_riser.bore:
            allowed = f"less than the riser's bore, {tank.arm_riser.bore:.4g} m"
            raise self.error("mast.outer_diameter", f"{mast.outer_diameter:.4g} m", allowed)
        if arm.stowable and arm.stowed is None:
            allowed = f"a table [stowed] in {arm.name}: it passes the riser with its double octahedra retracted"
            raise self.error("manipulator.stowed", "nothing", allowed)
        start = self.task.motion.start
        if isinstance(start, tuple) and len(start) != len(arm.active):
            allowed = f"one for each active module of {arm.name}, {len(arm.active)}"
            raise self.error("motion.start", f"{len(start)} module shapes", allowed)
        if self.task.motion.method is Method.COUPLED:
            self.coupled_modules()
        places = ("shell", "riser", "waste", *(item.name for item in tank.equipment))
        for index, contact in enumerate(self.task.contacts):
            if contact.place not in places:
                raise self.error(
                    f"contacts.{index}.place", f"unknown place {contact.place!r}", closest(contact.place, places)[2:]
                )

    @property
    def pivot_height(self) -> float:
        """Height of the arm's base face above the lowest point of the floor, m."""
        return self.tank.shell.crown - self.task.mast.pivot_depth

    def coupled_modules(self) -> tuple[tuple[int, int], ...]:
        """Indices (follower, leader) of each pair of coupled modules among the active ones, from the mast.

        Raises:
            DescriptionError: The arm cannot be coupled so.
        """
        pairs = self.task.motion.coupling
        try:
            return choose_coupling(pairs, self.manipulator.active)
        except ValueError as error:
            key, found = ("method", "'coupled'") if pairs is None else ("coupling", str([*map(list, pairs)]))
            raise self.error(f"motion.{key}", found, str(error)) from None

    def error(self, key: str, found: str, allowed: str) -> DescriptionError:
        """Make an error that names this scene's file."""
        return DescriptionError(self.file, key, found, allowed)
