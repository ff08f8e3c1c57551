"""The tour as a program: for every leg the actuator lengths at every step of the simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Goal, Scene
from vgtsim.errors import ReachError, TrussError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.start import bend_start
from vgtsim.planning.checks import check_scene, elastic_model_of, sags, surroundings_of
from vgtsim.planning.objectives import MARGIN
from vgtsim.planning.path import PathSettings, plan_path
from vgtsim.planning.resolution import goal_keep, resolve_goal, scene_resolution
from vgtsim.planning.timing import make_limits, time_lengths
from vgtsim.positioning.solver import Keep
from vgtsim.positioning.surroundings import Surroundings
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.loads import tool_point
from vgtsim.statics.settling import settle

Array = NDArray[np.float64]

_AIMS, _AIMED = 6, 1e-4  # corrections for the sag of an elastic arm, and what may be left of it, m and rad


@dataclass(frozen=True)
class Leg:
    """The way to one goal.

    Attributes:
        name: Of the goal.
        goal: Its index in the scene.
        lengths: Actuator lengths at every step, the first and last included, shape (n, 3 A), m.
        q: Inputs at its end, shape (n,).
        clearance: Least clearance planned on the way, m.
        place: What is that near.
    """

    name: str
    goal: int
    lengths: Array
    q: Array
    clearance: float
    place: str

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self.lengths.flags.writeable = False
        self.q.flags.writeable = False


@dataclass(frozen=True)
class LengthProgram:
    """The whole tour.

    Attributes:
        start: Inputs at the start, shape (n,).
        legs: In the order of the goals; each begins with the lengths the last one ended with.
        timestep: Of the rows of each leg, s.
    """

    start: Array
    legs: tuple[Leg, ...]
    timestep: float

    def __post_init__(self) -> None:
        """Make the start read-only."""
        self.start.flags.writeable = False

    @property
    def duration(self) -> float:
        """Time in motion, holds not counted, s."""
        return self.timestep * sum(len(leg.lengths) - 1 for leg in self.legs)


def solve_first_goal(scene: Scene, chain: Chain) -> Array:
    """Configuration at the first goal, without planning the way to it.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Returns:
        Inputs, shape (n,).

    Raises:
        ReachError: The goal cannot be met.
    """
    goal, start = scene.task.motion.goals[0], bend_start(chain, scene.task.motion.start)
    return _configuration(scene, chain, goal, start, goal_keep(scene, chain))


def _configuration(
    scene: Scene, chain: Chain, goal: Goal, start: Array, keep: Keep, aim: tuple[Array, Array] | None = None
) -> Array:
    """Inputs with the tool at a goal, or at an aim in its place, shape (n,)."""
    pose = aim or (np.array(goal.position), np.array(goal.direction))
    return np.array(resolve_goal(chain, scene_resolution(scene), goal.name, pose, start, scene, keep).q)


def _aim_above(
    scene: Scene, chain: Chain, elastic: ElasticModel, goal: Goal, q: Array, surroundings: Surroundings
) -> Array:
    """Inputs with which an arm that gives, sagging, holds its tool at a goal: the aim is moved by what is left over."""
    keep = Keep(surroundings, scene.task.motion.clearance + MARGIN / 2)
    left = _left_over(chain, elastic, goal, q)
    aim = np.array([goal.position, goal.direction])
    for _ in range(_AIMS):
        if np.abs(left).max() < _AIMED:
            return q
        aim += left
        q = _configuration(scene, chain, goal, q, keep, (aim[0], aim[1]))
        left = _left_over(chain, elastic, goal, q)
    if np.abs(left).max() < _AIMED:
        return q
    short, turn = np.linalg.norm(left, axis=1)
    detail = f"sagging, after {_AIMS} corrections of the aim; direction off by {np.degrees(turn):.3g} degrees"
    raise ReachError(goal.name, float(short), (), detail)


def _left_over(chain: Chain, elastic: ElasticModel, goal: Goal, q: Array) -> Array:
    """What the settled tool lacks of a goal's position, m, and direction, shape (2, 3)."""
    try:
        nodes = settle(elastic, chain.nodes(q))
    except TrussError as error:
        raise TrussError(error.rank, error.members, f"the arm at goal {goal.name!r}: {error.detail}") from None
    corner = nodes[chain.truss.tip]
    normal = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    return np.array([goal.position, goal.direction]) - [
        tool_point(elastic.loads, nodes),
        normal / np.linalg.norm(normal),
    ]


def make_program(scene: Scene, chain: Chain) -> LengthProgram:
    """Plan the tour of a scene.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Returns:
        The program; the same scene gives the same program, bit for bit.

    Raises:
        DescriptionError: The scene cannot work, see `check_scene`.
        ReachError: A goal cannot be met, or not by an arm that gives.
        TrussError: The arm does not settle at a goal.
        PathError: A goal cannot be come to without touching anything.
    """
    check_scene(scene, chain)
    motion = scene.task.motion
    surroundings = surroundings_of(scene, chain)
    planning = PathSettings(clearance=motion.clearance, stroke_margin=motion.stroke_margin)
    limits = make_limits(chain, motion.rate_fraction, motion.acceleration)
    timestep = scene.task.simulation.timestep
    start = bend_start(chain, scene.task.motion.start)
    shapes = [start]
    elastic = elastic_model_of(scene, chain) if sags(scene) else None
    stiff = goal_keep(scene, chain)
    for goal in motion.goals:  # all goals before the first path: what is out of reach is said soon
        q = _configuration(scene, chain, goal, shapes[-1], stiff)
        if elastic is not None:
            q = _aim_above(scene, chain, elastic, goal, q, surroundings)
        shapes.append(q)
    legs = []
    for index, goal in enumerate(motion.goals):
        path = plan_path(chain, surroundings, shapes[index], shapes[index + 1], goal.name, planning)
        lengths = time_lengths(chain, path.spline, limits, timestep)
        legs.append(Leg(goal.name, index, lengths, shapes[index + 1], path.clearance, path.place))
    return LengthProgram(start, tuple(legs), timestep)
