"""A scene: an arm on a mast in a tank, its load, its task and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from vgtsim.constants import GRAVITY
from vgtsim.description.conveyance import Conveyance
from vgtsim.description.figures import (
    Acceleration,
    Force,
    Frequency,
    Gap,
    Mass,
    Moment,
    Number,
    Size,
    Step,
)
from vgtsim.description.judging import Limits, Video
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mast import Mast
from vgtsim.description.mission import (
    AddStep,
    CutStep,
    FollowStep,
    InsertStep,
    MissionStep,
    MoveStep,
    RunStage,
    find_disorder,
    find_stray_turn,
)
from vgtsim.description.motion import Motion, choose_coupling
from vgtsim.description.operator import Operator, OperatorCommand
from vgtsim.description.schema import Description, Name, Provenance, Title, closest, require_distinct
from vgtsim.description.tank import Tank
from vgtsim.description.waste import CuttingTool, Patch
from vgtsim.errors import DescriptionError


class Payload(Description):
    """The load at the tool point, a ball about it."""

    mass: Mass
    radius: Size


class Simulation(Description):
    """Settings of the step loop.

    Attributes:
        timestep: Absent for the longest that members, drives, records and plan allow.
        log_rate: Records a second.
        weight_scale: Factor on the inverse weights that regularise the constraints.
        drive: The cylinder lengths are imposed (`rigid`), held by a spring and damper (`servo`), or moved by valve and
            oil (`hydraulic`, elastic members only).
        servo_stiffness, servo_damping: Of a servo: stiffness in N/m, damping in N·s/m.
        members: `rigid` members keep their lengths; `elastic` ones are springs along their axes. Under the `rigid`
            drive an elastic cylinder is its oil column and rod in series, set to the commanded length. `sections`, for rigid
            drives, cost a tenth: static modules are rigid bodies, members of active modules are lengths. Forces inside static
            modules then come from statics, contacts from distances.
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
        dead, payload: Factors on weight: `dead` of the arm, `payload` of the payload.
        dynamic: Factor on all weight, for jerks and sudden stops.
        seismic: Accelerations of all masses along x, y and z of frame G, parts of gravity.
        shaking: Horizontal acceleration of all masses, part of gravity; each member takes its worst direction.
        force, moment: On the tool, in frame G.
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


class Phase(Description):
    """A part of a mission in which the arm keeps its length; the program writes it into the scene of that part's log.

    Attributes:
        number, count: The phase is `number`, from 1, of `count`.
        stands: Whether the arm stands in the clamp, at the end or at the beginning.
        patches: Names of those that the whole mission cuts.
    """

    number: int = Field(ge=1)
    count: int = Field(ge=1)
    stands: bool
    patches: tuple[Name, ...] = ()


class SceneFile(Description):
    """A scene as written.

    Attributes:
        manipulator, tank: Shipped name, or path relative to the scene's file.
        conveyance: Line through the truss; absent where there is none.
        operator: For an arm that a person drives, in place of goals.
        loads: Load cases besides the run.
        mission: Steps in place of the tour of the goals. They start above the riser, or, without `insert` and `withdraw`, at the
            start of the motion.
        phase: Written by the program; absent in a scene of a user.
        tool: Removes waste from the `patches`.
        patches: Places that steps of the mission cut.
        contacts: Allowed contacts. Any other contact is a collision, which ends a run.
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
    phase: Phase | None = None
    tool: CuttingTool | None = None
    patches: tuple[Patch, ...] = Field(default=(), max_length=100)
    contacts: tuple[AllowedContact, ...] = Field(default=(), max_length=100)
    video: Video = Video()
    provenance: dict[str, Provenance] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _entries_fit(self) -> SceneFile:
        require_distinct("load case", self.loads)
        require_distinct("patch", self.patches)
        if self.operator is None and not self.motion.goals and not self.mission:
            raise ValueError("motion.goals, a [[mission]], or a table [operator] for an arm that a person drives")
        if self.operator is not None:
            if self.motion.goals:
                raise ValueError("either motion.goals or a table [operator]")
            step, rate = self.simulation.timestep, self.simulation.log_rate
            if step is None or abs(step * rate - 1) > 1e-6:
                raise ValueError("simulation.timestep of 1 / log_rate with an operator, whose every step is recorded")
        return self

    @property
    def stages(self) -> tuple[RunStage, ...]:
        """Stages of the run: the goals in turn, or the steps of the mission; a path is two, the way to it and itself."""
        poses = {goal.name: RunStage(goal.name, goal.position, goal.direction) for goal in self.motion.goals}
        if not self.mission:
            return tuple(poses.values())
        stages: list[RunStage] = []
        for step in self.mission:
            if isinstance(step, MoveStep):
                stages.append(poses.get(step.goal, RunStage("")))
            elif isinstance(step, FollowStep):
                path = step.path
                stages += [RunStage(f"to {path.name}", path.start, path.direction), RunStage(path.name, path=path)]
            else:
                stages.append(RunStage(step.do))
        return tuple(stages)


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
        if self.task.phase is None:
            self._check_mission()
        self._check_cuts()
        if tank.appearances and (self.task.operator is not None or self._changes_arm()):
            found = f"{next(iter(tank.appearances))}, which appears during the run"
            raise self.error(
                "tank",
                found,
                "what is there from the beginning, or a tour or mission of an arm that keeps its length: these are planned anew",
            )
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
        if self.task.motion.couples:
            self.coupled_modules()
        places = ("shell", "riser", "waste", *(item.name for item in tank.things))
        for index, contact in enumerate(self.task.contacts):
            if contact.place not in places:
                raise self.error(
                    f"contacts.{index}.place", f"unknown place {contact.place!r}", closest(contact.place, places)[2:]
                )

    def _changes_arm(self) -> bool:
        """Whether the arm of a mission grows or is a shorter one at times, so that it runs in phases."""
        task, whole = self.task, len(self.manipulator.active)
        shorter = any(isinstance(step, InsertStep) and (step.modules or whole) != whole for step in task.mission)
        deeper = any(isinstance(step, InsertStep) and step.pivot_depth is not None for step in task.mission)
        return task.phase is not None or shorter or deeper or any(isinstance(step, AddStep) for step in task.mission)

    def _check_mission(self) -> None:
        """Refuse steps that cannot be carried out one after the other, and modules that are added without a clamp."""
        task, goals = self.task, [goal.name for goal in self.task.motion.goals]
        wrong = find_disorder(task.mission, goals, len(self.manipulator.active), fed=task.mast.feed is not None)
        wrong = wrong or find_stray_turn(task.mission, None if task.mast.turn is None else task.mast.turn.range)
        if wrong is not None:
            raise self.error(f"mission.{wrong[0]}", wrong[1], wrong[2])
        if self.tank.clamp is None and any(isinstance(step, AddStep) for step in task.mission):
            allowed = "a table [clamp] in the tank's file: it holds the arm while a module is added"
            raise self.error("tank.clamp", "nothing", allowed)

    def _check_cuts(self) -> None:
        """Refuse a step that cuts without a tool, without waste that can be cut, or nowhere."""
        task, waste = self.task, self.tank.waste
        names = [patch.name for patch in task.patches]
        for index, step in enumerate(task.mission):
            if not isinstance(step, CutStep):
                continue
            if task.tool is None:
                raise self.error(f"mission.{index}.do", "cut without a tool", "a table [tool]: a jet or a scarifier")
            if not waste.level:
                raise self.error("tank.waste.level", "0 m: no waste", f"waste, which step {index} of the mission cuts")
            if step.patch not in names:
                found = f"unknown patch {step.patch!r}"
                raise self.error(f"mission.{index}.patch", found, closest(step.patch, names)[2:])
            if waste.grid is None or waste.grid > task.tool.width / 2:
                found = "nothing" if waste.grid is None else f"{waste.grid:.4g} m"
                allowed = f"at most {task.tool.width / 2:.4g} m, half the tool's width: heights of waste that is cut"
                raise self.error("tank.waste.grid", found, allowed)

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
