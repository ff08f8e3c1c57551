"""From a tool goal to a configuration, by the method and objectives of a scene or a command."""

from __future__ import annotations

from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from vgtsim.control.checks import require_positionable, surroundings_of
from vgtsim.control.objectives import MARGIN, make_objective
from vgtsim.description.resolution import Method, choose_coupling
from vgtsim.description.scene import Scene
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.goals import tool_goal
from vgtsim.redundancy.newton import NewtonSettings
from vgtsim.redundancy.positioning import Positioning
from vgtsim.redundancy.reduction import couple
from vgtsim.redundancy.solver import GoalSolution, Keep, solve_goal
from vgtsim.redundancy.strokes import StrokeBox, make_box

_STROKE_MARGIN = 0.005  # kept at the ends of strokes when no scene says, m
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


def usual_resolution(chain: Chain, method: Method, objective: tuple[str, ...]) -> Resolution:
    """A method and objectives with the coupling of section 8.1.

    Args:
        chain: The arm.
        method: By which method.
        objective: Names, each with `:weight` or without.

    Returns:
        The resolution.

    Raises:
        DescriptionError: The arm has too few modules to couple any.
    """
    if method is not Method.COUPLED:
        return Resolution(method, objective)
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
        start: Present inputs, shape (*q).
        scene: Gives stroke margin, payload and surroundings.
        keep: Clearance that the configuration has to keep.

    Returns:
        The configuration.

    Raises:
        DescriptionError: An objective is not known, or needs a scene; or the arm cannot be positioned.
        GoalError: The goal is no goal.
        ReachError: It cannot be met, or not clear of the surroundings.
    """
    require_positionable(chain)
    rows = tool_goal(*goal)
    objective = make_objective(chain, rows, how.objective, scene)
    reduction = couple(chain.straight.ravel(), how.coupling, owner=chain.layout.owner) if how.coupling else None
    problem = Positioning(chain, stroke_box(chain, scene), rows, objective, reduction=reduction)
    return solve_goal(name, problem, how.method, start, keep, NewtonSettings(most=_STEPS))
