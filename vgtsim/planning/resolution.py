"""From a tool goal to a configuration, by the method and objectives of a scene or a command."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.description.modules import Tetrahedral
from vgtsim.description.redundancy import Method, choose_coupling
from vgtsim.description.scene import Scene
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.bending import straight_yaws
from vgtsim.kinematics.chain import Chain
from vgtsim.planning.checks import require_positionable, surroundings_of
from vgtsim.planning.objectives import MARGIN, make_objective
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.positioning import Positioning
from vgtsim.positioning.reduction import couple
from vgtsim.positioning.solver import GoalSolution, Keep, solve_goal
from vgtsim.positioning.strokes import StrokeBox, make_box

_STROKE_MARGIN = 0.005  # kept at the ends of strokes when no scene says, m
_TURNED = 1e-6  # angle between base frames from which modules count as turned, rad
_STEPS = 300  # a goal by a wall makes the valley of the optimum narrow and curved


@dataclass(frozen=True)
class Resolution:
    """How redundancy is resolved.

    Attributes:
        method: By which method.
        objective: Names, each with `:weight` or without.
        coupling: For the coupled method: for each pair the active module that follows and the one it follows.
    """

    method: Method
    objective: tuple[str, ...]
    coupling: tuple[tuple[int, int], ...] = ()


def scene_resolution(scene: Scene) -> Resolution:
    """What a scene says of it."""
    motion = scene.task.motion
    return Resolution(
        motion.method, motion.objective, scene.coupled_modules() if motion.method is Method.COUPLED else ()
    )


def asked_resolution(
    chain: Chain, method: Method, objective: tuple[str, ...], scene: Scene | None = None
) -> Resolution:
    """A method and objectives with the coupling of a scene that has the coupled method, or else that of section 8.1.

    Args:
        chain: The arm.
        method: By which method.
        objective: Names, each with `:weight` or without.
        scene: Gives its coupling.

    Returns:
        The resolution.

    Raises:
        DescriptionError: The arm has too few modules to couple any.
    """
    if method is not Method.COUPLED:
        return Resolution(method, objective)
    if scene is not None and scene.task.motion.method is Method.COUPLED:
        return Resolution(method, objective, scene.coupled_modules())
    try:
        return Resolution(method, objective, choose_coupling(None, chain.manipulator.actuated))
    except ValueError as error:
        raise DescriptionError(None, "method", f"'coupled' for {chain.manipulator.name}", str(error)) from None


def goal_keep(scene: Scene, chain: Chain) -> Keep:
    """Clearance that postures at goals keep: the path's and a margin, of the unloaded shape, whose sag comes after."""
    return Keep(replace(surroundings_of(scene, chain), sag=None), scene.task.motion.clearance + MARGIN)


def stroke_box(chain: Chain, scene: Scene | None) -> StrokeBox:
    """Actuator lengths that a plan may use: the strokes less the scene's margin, or a usual one."""
    return make_box(chain, scene.task.motion.stroke_margin if scene else _STROKE_MARGIN)


def resolve_goal(
    chain: Chain,
    how: Resolution,
    name: str,
    goal: tuple[ArrayLike, ArrayLike],
    start: ArrayLike,
    scene: Scene | None = None,
    keep: Keep | None = None,
) -> GoalSolution:
    """Find a configuration for a tool goal.

    Args:
        chain: The arm.
        how: By which method and objectives.
        name: Of the goal, for errors.
        goal: Tool point in frame G, shape (3,), m, and tool direction, shape (3,), any length but zero.
        start: Present inputs, shape (n,).
        scene: Gives stroke margin, payload and surroundings.
        keep: Clearance that the configuration has to keep.

    Returns:
        The configuration.

    Raises:
        DescriptionError: An objective is not known, or needs a scene; the arm cannot be positioned; or coupled modules
            are turned to each other.
        GoalError: The goal is no goal.
        ReachError: It cannot be met, or not clear of the surroundings.
    """
    require_positionable(chain)
    rows = tool_goal(*goal)
    objective = make_objective(chain, rows, how.objective, scene)
    reduction = None
    if how.coupling:
        _require_alike(chain, how.coupling, scene)
        reduction = couple(chain.straight, how.coupling, owner=chain.layout.owner)
    problem = Positioning(chain, stroke_box(chain, scene), rows, objective, reduction=reduction)
    return solve_goal(name, problem, how.method, start, keep, NewtonSettings(most=_STEPS))


def _require_alike(chain: Chain, pairs: tuple[tuple[int, int], ...], scene: Scene | None) -> None:
    """Refuse to couple modules turned to each other: equal inputs, each in its module's own frame, bend them apart."""
    yaws, modules = straight_yaws(chain), chain.manipulator.actuated
    for follower, leader in pairs:
        if isinstance(modules[follower], Tetrahedral):  # whose hinges open alike wherever they stand
            continue
        turn = np.angle(np.exp(1j * (yaws[follower] - yaws[leader])))
        if abs(turn) > _TURNED:
            names = f"{modules[follower].name} and {modules[leader].name} of {chain.manipulator.name}"
            found = f"{names}, turned by {np.degrees(turn):.4g} degrees to each other"
            key = "motion.coupling" if scene is not None and scene.task.motion.coupling is not None else "method"
            allowed = "coupled modules whose base frames are parallel in the straight arm"
            raise DescriptionError(scene.file if scene else None, key, found, allowed)
