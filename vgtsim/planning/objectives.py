"""Objectives by name, as a scene or a command gives them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.constants import GRAVITY, SAFETY_FACTOR
from vgtsim.description.redundancy import OBJECTIVES, split_objective
from vgtsim.description.scene import Payload, Scene
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.planning.checks import surroundings_of
from vgtsim.positioning.analysis import condition_numbers
from vgtsim.positioning.goals import GoalSpace, evaluate
from vgtsim.positioning.kernel import Kernel
from vgtsim.positioning.objectives import (
    Clearance,
    Differences,
    LengthVariation,
    MidStroke,
    Objective,
    StrokeBarrier,
    WeightedSum,
)
from vgtsim.positioning.plane import goal_plane
from vgtsim.statics import find_use, make_load_model, make_sections, smooth_peak, solve_members

Array = NDArray[np.float64]

MARGIN = 0.02  # kept at the goals beyond the path's clearance, so that a path can leave them, m
_FORCE = 1e5  # N: actuator forces count in units of what a middling cylinder pushes


def make_objective(chain: Chain, goal: GoalSpace, names: tuple[str, ...], scene: Scene | None) -> Objective:
    """Objective of names such as `mid_stroke` or `clearance:2`.

    Args:
        chain: The arm.
        goal: A tool goal: its rows are those whose condition number is meant, its position gives the plane.
        names: At least one.
        scene: For payload, gravity, masses, safety factor and surroundings.

    Returns:
        One objective or their weighted sum.

    Raises:
        DescriptionError: A name is not known, a weight is no number above zero, or a scene is needed.
    """
    known: dict[str, Callable[[], Objective]] = {
        "stroke_barrier": StrokeBarrier,
        "mid_stroke": MidStroke,
        "length_variation": LengthVariation,
        "in_plane": lambda: goal_plane(chain, goal.parts[0].target),
        "condition_number": lambda: Differences("condition_number", lambda q: _condition(chain, goal, q)),
        "actuator_force": lambda: Differences("actuator_force", _forces(chain, scene, utilisation=False)),
        "utilisation": lambda: Differences("utilisation", _forces(chain, scene, utilisation=True)),
    }
    if scene is not None:
        # of the unloaded shape: where an elastic arm sags to costs a solve for every look
        known["clearance"] = lambda: Clearance(
            replace(surroundings_of(scene, chain), sag=None), scene.task.motion.clearance + MARGIN, payload=False
        )
    assert set(known) | {"clearance"} == set(OBJECTIVES)
    parts = []
    for text in names:
        try:
            name, weight = split_objective(text)
        except ValueError as error:
            raise DescriptionError(None, "objective", repr(text), str(error)) from None
        if name not in known:
            raise DescriptionError(None, "objective", repr(text), "clearance with a scene, which has surroundings")
        parts.append((weight, known[name]()))
    return parts[0][1] if len(parts) == 1 and parts[0][0] == 1 else WeightedSum(tuple(parts))


def _condition(chain: Chain, goal: GoalSpace, q: Array) -> Array:
    """Condition number of the goal rows, lengths counted in straight arms, shape (b,)."""
    J = evaluate(chain, goal, Kernel(chain).state(q), np.zeros(len(q), int))[1]
    reach = float(np.linalg.norm(chain.tool(chain.straight)[0] - chain.mount[:3, 3]))
    return condition_numbers(np.concatenate([J[:, :3] / reach, J[:, 3:]], axis=1))


def _forces(chain: Chain, scene: Scene | None, utilisation: bool) -> Callable[[Array], Array]:
    """Smooth stand-in for the greatest actuator force, 100 kN, or utilisation of any member, at rest."""
    safety, sections = SAFETY_FACTOR, make_sections(chain.manipulator, chain.truss)
    if scene is None:
        model = make_load_model(chain, Payload(mass=0.0, radius=1e-3), GRAVITY)
    else:
        task, safety = scene.task, scene.task.limits.safety_factor
        split, lumped = task.simulation.members == "elastic", task.simulation.lumped
        model = make_load_model(chain, task.payload, task.simulation.gravity, split=split, lumped=lumped)

    def value(q: Array) -> Array:
        nodes = chain.nodes(q)
        if utilisation:
            return smooth_peak(find_use(model, sections, nodes, safety).worst)
        return smooth_peak(np.abs(solve_members(model, nodes).bar[:, chain.truss.actuated]) / _FORCE)

    return value
