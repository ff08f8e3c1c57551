"""The site of a scene: its arm on its mast in its tank, and every model that is made of them, each made once.

A `Site` is made from a scene and handed down the spine in its place. Its properties are worked out on first use and kept,
so no function needs to build a chain, a stiffness model or the surroundings again. Whether a scene can work is checked
in `planning.checks`; a property here raises only where it cannot be made at all.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from vgtsim.arrays import Array
from vgtsim.constants import GRAVITY, SAFETY_FACTOR
from vgtsim.description import (
    CutStep,
    Manipulator,
    Payload,
    RunStage,
    Scene,
    SceneFile,
    Tank,
    load_manipulator,
    load_scene,
)
from vgtsim.errors import DescriptionError
from vgtsim.geometry import (
    Bed,
    Diggings,
    MastPipe,
    Stretch,
    make_bed,
    make_diggings,
    make_mast,
    make_profile,
    make_stretches,
    place_goals,
)
from vgtsim.kinematics import Chain, Subspace, Truss, hanging_mount
from vgtsim.positioning import Keep, Reduction, StrokeBox, Surroundings, couple, find_start, make_box, search_start
from vgtsim.statics import (
    ElasticModel,
    LoadModel,
    MemberSections,
    damping_time,
    deflect,
    hold_cylinders,
    make_elastic_model,
    make_load_model,
    make_sections,
)

_START_MARGIN = 0.02  # m beyond the planned clearance, so that a path can leave a start that is looked for
_STROKE_MARGIN = 0.005  # m at the ends of strokes of an arm alone: what the shipped scenes keep

# Longest steps, s: of an arm of imposed lengths, whose loops, nodes and greatest forces at twice the step still pass on the
# reference tour but with forces 0.2 % off; and of one that rings at about 1 Hz, whose period is then right to 0.2 % and its
# damping to 2 %; with valves and oil the greatest forces at 10 ms are those at 4 ms to 2e-5.
_RIGID_STEP, _SOFT_STEP, _SECTION_STEP = 0.02, 0.01, 0.04
_ROUNDING = 1e-9  # of a quotient of times: what is whole but for it is not rounded up to the next number


@dataclass(frozen=True, eq=False)
class Site:
    """A scene, arm, tank and task as described, with everything that is made of it once.

    Attributes:
        heights: Heights of the waste in the diggings, shape (P,), m, where some is cut away already.
        turn: Angle of the mast, rad.
        until: Plans do not know things that appear in the tank after this time, s.
    """

    scene: Scene
    heights: Array | None = None
    turn: float = 0.0
    until: float = 0.0

    def __post_init__(self) -> None:
        """Look up the places of goals; errors are those of `place_goals`."""
        object.__setattr__(self, "scene", place_goals(self.scene))

    @property
    def task(self) -> SceneFile:
        """Payload, motion, simulation, limits and load cases."""
        return self.scene.task

    @property
    def arm(self) -> Manipulator:
        """Description of the arm."""
        return self.scene.manipulator

    @property
    def tank(self) -> Tank:
        """Description of the tank."""
        return self.scene.tank

    @cached_property
    def chain(self) -> Chain:
        """Kinematics of the arm, which hangs from the scene's pivot."""
        return Chain(self.arm, hanging_mount(self.scene.pivot_height, self.tank.arm_riser.place, self.turn))

    @property
    def gravity(self) -> float:
        """Size of gravity, m/s²."""
        return self.task.simulation.gravity

    @cached_property
    def timestep(self) -> float:
        """Step of the simulation, s: the scene's, or the longest that a plan may shorten."""
        return self.task.simulation.timestep or self.fit_step(np.inf)

    def fit_step(self, longest: float) -> float:
        """Longest step, s, up to a given one, that members and drives allow and that divides the time between records."""
        longest, period = min(longest, *self.step_bounds.values()), 1 / self.task.simulation.log_rate
        return float(period / np.ceil(period / longest * (1 - _ROUNDING)))

    @cached_property
    def step_bounds(self) -> dict[str, float]:
        """Longest step, s, by what bounds it in any plan: members and drives, damping, and the time between records."""
        simulation = self.task.simulation
        stiff = simulation.members != "elastic" and simulation.drive == "rigid"
        stiffest = _SECTION_STEP if simulation.members == "sections" else _RIGID_STEP
        bounds = {"members_and_drives": stiffest if stiff else _SOFT_STEP, "records": 1 / simulation.log_rate}
        if simulation.members == "elastic" and simulation.damping_ratio:
            bounds["damping"] = 2 * self.damper
        return bounds

    @cached_property
    def damper(self) -> float:
        """Damper of elastic members over their stiffness, s, by which the start posture has the damping ratio, above 0."""
        simulation = self.task.simulation
        held = self.held_model if simulation.drive == "servo" else self.elastic_model
        return damping_time(held, self.chain.nodes(self.start), simulation.damping_ratio)

    @property
    def yields(self) -> bool:
        """Whether the arm gives way where it touches something: by its drives or its members."""
        return self.task.simulation.drive != "rigid" or self.task.simulation.members == "elastic"

    @property
    def safety_factor(self) -> float:
        """Omega of AISC 360 that members are held to."""
        return self.task.limits.safety_factor

    @property
    def clearance(self) -> float:
        """Least planned distance from everything, m."""
        return self.task.motion.clearance

    @cached_property
    def coupling(self) -> tuple[tuple[int, int], ...]:
        """Pairs of active modules that move as one, follower and leader; none where the scene couples none."""
        return self.scene.coupled_modules() if self.task.motion.couples else ()

    @cached_property
    def subspace(self) -> Subspace:
        """Inputs that a way may use: static longerons keep their lengths, and coupled modules move as one."""
        return Subspace(self.chain) if self.reduction is None else Subspace(self.chain, *self.reduction.rows)

    @cached_property
    def reduction(self) -> Reduction | None:
        """Inputs of coupled modules by those that are left; absent where the scene couples none."""
        return couple(self.chain.straight, self.coupling, owner=self.chain.layout.owner) if self.coupling else None

    @property
    def truss(self) -> Truss:
        """Nodes and members of the arm."""
        return self.chain.truss

    @cached_property
    def start(self) -> Array:
        """Inputs of the posture in which the scene starts, shape (n,).

        Raises:
            DescriptionError: The scene gives a posture that the arm does not have.
            ReachError: The scene gives a pose of the tool that the arm does not come to.
        """
        given = self.task.motion.start
        try:
            keep = self._start_keep
            q = self.searched_start[0] if given is None else find_start(self.box, keep, given, self.reduction)
        except DescriptionError as error:
            raise self.scene.error(error.key, error.found, error.allowed) from None
        start = np.array(q)
        start.flags.writeable = False
        return start

    @cached_property
    def searched_start(self) -> tuple[Array, int]:
        """Inputs of a posture clear of everything near the first goal, shape (n,), and the number of postures tried."""
        places = [stage.position for stage in self.stages if stage.position is not None]
        places = places or [goal.position for goal in self.task.motion.goals]
        if not places:
            raise self.scene.error("motion.start", "nothing", "a posture, where there are neither goals nor paths")
        near = np.array(places[0])
        return search_start(self.box, self._start_keep, near, self.subspace)

    @property
    def _start_keep(self) -> Keep:
        return Keep(self.surroundings, self.clearance + _START_MARGIN)

    @cached_property
    def stages(self) -> tuple[RunStage, ...]:
        """What the run settles at the end of, in turn: goals, or steps of the mission."""
        return self.task.stages

    @cached_property
    def stretches(self) -> tuple[tuple[Stretch, ...], ...]:
        """Parts of the tool's path in each stage of the run, none where the tool follows no path."""
        return tuple(make_stretches(stage.path) if stage.path else () for stage in self.stages)

    @cached_property
    def stage_poses(self) -> Array:
        """Position, m, and direction of the tool at the end of each stage, shape (S, 6); NaN where a stage has none."""
        poses = np.full((len(self.stages), 6), np.nan)
        for row, stage, path in zip(poses, self.stages, self.stretches, strict=True):
            if path:
                row[:3], row[3:] = path[-1].points(2)[-1], path[-1].last
            elif stage.position is not None:
                row[:3], row[3:] = stage.position, stage.direction or (np.nan,) * 3
        return poses

    @cached_property
    def box(self) -> StrokeBox:
        """Actuator lengths that a plan may use: the strokes less the scene's margin."""
        return make_box(self.chain, self.task.motion.stroke_margin)

    @property
    def sags(self) -> bool:
        """Whether the arm gives under its load: by its members and oil, or by its servos."""
        return self.task.simulation.members == "elastic" or self.task.simulation.drive == "servo"

    @cached_property
    def load_model(self) -> LoadModel:
        """Masses and gravity of the arm as it is simulated: tubes are split where members are elastic."""
        return self._weigh(split=self.task.simulation.members == "elastic")

    @cached_property
    def case_model(self) -> LoadModel:
        """The same for the load cases, in which tubes are whole."""
        return self._weigh(split=False)

    def _weigh(self, *, split: bool) -> LoadModel:
        task, lumped, line = self.task, self.task.simulation.lumped, self.task.conveyance
        return make_load_model(self.chain, task.payload, self.gravity, split=split, lumped=lumped, line=line)

    @cached_property
    def sections(self) -> MemberSections:
        """Section properties of the members, which their strength follows from."""
        return make_sections(self.chain)

    @cached_property
    def mast(self) -> MastPipe:
        """The pipe that carries the arm."""
        return make_mast(self.scene)

    @cached_property
    def elastic_model(self) -> ElasticModel:
        """Masses and stiffnesses of the arm, its cylinders as soft as their oil and rods."""
        task, lumped = self.task, self.task.simulation.lumped
        return make_elastic_model(self.chain, task.payload, self.gravity, lumped=lumped, line=task.conveyance)

    @cached_property
    def held_model(self) -> ElasticModel:
        """The elastic model with cylinders as stiff as their drives hold them at rest."""
        return hold_cylinders(self.elastic_model, self.task.simulation)

    @cached_property
    def diggings(self) -> Diggings | None:
        """The part of the waste that the whole mission cuts, as it is described; None where it cuts none."""
        task, waste = self.task, self.tank.waste
        cut = {step.patch for step in task.mission if isinstance(step, CutStep)}
        cut |= set(task.phase.patches if task.phase else ())
        bed = make_bed(self.tank)
        if not cut or task.tool is None or bed is None:
            return None
        patches = [patch for patch in task.patches if patch.name in cut]
        return make_diggings(bed, make_profile(self.tank.shell), task.tool, task.tool.rate_in(waste), patches)

    @property
    def begun(self) -> Array | None:
        """Heights of the waste in the diggings as a run begins, shape (P,), m; None where none is cut."""
        return self.heights if self.heights is not None or self.diggings is None else self.diggings.start

    @cached_property
    def bed(self) -> Bed | None:
        """The surface of the waste, where some of it is cut away already."""
        return None if self.heights is None or self.diggings is None else self.diggings.cut_bed(self.heights)

    @cached_property
    def surroundings(self) -> Surroundings:
        """Everything that the arm must keep clear of: tank, equipment, waste, mast and itself.

        An arm that gives is judged where it sags to; `surroundings.unloaded` judges the shape of the inputs alone.
        """
        task, sag = self.task, self._sag if self.sags else None
        return Surroundings(
            chain=self.chain,
            tank=self.tank.known_at(self.until),
            payload_radius=task.payload.radius,
            mast_radius=task.mast.outer_diameter / 2,
            sag=sag,
            bed=self.bed,
        )

    def lower_waste(self, heights: Array | None) -> Site:
        """The site with waste of some heights in its diggings, shape (P,), m, if given; what does not depend on them is kept."""
        assert self.diggings is not None or heights is None
        return self if heights is None else self._change("heights", heights, "bed", "surroundings")

    def turn_mast(self, turn: float) -> Site:
        """The site with its mast at an angle, rad."""
        return self if turn == self.turn else replace(self, turn=turn)

    def learn(self, until: float) -> Site:
        """The same site with what has appeared in the tank up to a time of the run, s."""
        return self._change("until", until, "surroundings")

    def _change(self, name: str, value: object, *stale: str) -> Site:
        later = copy(self)
        object.__setattr__(later, name, value)
        for item in stale:
            later.__dict__.pop(item, None)
        return later

    def _sag(self, nodes: Array) -> Array:
        """Displacements of nodes and tool point at rest, to first order, shape (..., N + 1, 3), m.

        One linear solve; it is some millimetres off where arms sag most.
        """
        moved = deflect(self.held_model, nodes)
        return np.concatenate([moved.nodes, moved.tool[..., None, :3]], axis=-2)


@dataclass(frozen=True, eq=False)
class ArmAlone:
    """An arm without a scene, which hangs straight and carries nothing. Its properties have the names of those of a `Site`."""

    chain: Chain
    gravity = GRAVITY
    timestep = 0.01
    safety_factor = SAFETY_FACTOR
    scene = None
    surroundings = None
    clearance = 0.0
    coupling = ()
    reduction = None

    @property
    def start(self) -> Array:
        """Inputs of the straight arm, shape (n,)."""
        return self.chain.straight

    @cached_property
    def box(self) -> StrokeBox:
        """Actuator lengths that a plan may use: the strokes less a usual margin."""
        return make_box(self.chain, _STROKE_MARGIN)

    @cached_property
    def subspace(self) -> Subspace:
        """Inputs that a way may use: those with which static longerons keep their lengths."""
        return Subspace(self.chain)

    @cached_property
    def load_model(self) -> LoadModel:
        """Masses of the arm with nothing at its tool."""
        return make_load_model(self.chain, Payload(mass=0.0, radius=1e-3), self.gravity)

    @cached_property
    def sections(self) -> MemberSections:
        """Section properties of the members."""
        return make_sections(self.chain)


Place = Site | ArmAlone


def load_site(scene: str | Path) -> Site:
    """Load a scene: the path of its TOML file, or the name of a shipped one such as "type_ii_reach".

    Raises:
        DescriptionError: There is no such scene, or one of its files is wrong.
    """
    return Site(load_scene(scene))


def load_arm(arm: str | Path, height: float = 0.0) -> Chain:
    """Load an arm: the path of its TOML file, or the name of a shipped one such as "arm15".

    It hangs down from a height, z of its base face in frame G, m. Inputs q have shape (..., n), actuator lengths shape
    (..., J), m, nodes shape (..., N, 3), m; leading dimensions are batches.

    Raises:
        DescriptionError: There is no such arm, or its file is wrong.
    """
    return Chain(load_manipulator(arm), hanging_mount(height))
