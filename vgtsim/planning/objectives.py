"""Objectives by name, as a scene or a command gives them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.redundancy import OBJECTIVES, split_objective
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.planning.arm_alone import Place, safety_factor_of
from vgtsim.positioning import (
    ClearanceHinges,
    Differences,
    GoalSpace,
    LengthVariation,
    MidStroke,
    Objective,
    StrokeBarrier,
    WeightedSum,
    evaluate,
    goal_plane,
)
from vgtsim.positioning.kkt import condition_numbers
from vgtsim.site import Site
from vgtsim.statics import find_use, smooth_peak, solve_members

Array = NDArray[np.float64]

MARGIN = 0.02  # m kept at the goals beyond the path's clearance, so that a path can leave them
_FORCE = 1e5  # N: actuator forces count in units of what a middling cylinder pushes


def make_objective(place: Place, goal: GoalSpace, names: tuple[str, ...]) -> Objective:
    """Objective of names such as `mid_stroke` or `clearance:2`: one objective, or the weighted sum of several.

    `goal` is a tool goal: `condition_number` is that of its rows, and `in_plane` takes its position.

    Raises:
        DescriptionError: A name is not known, a weight is no number above zero, or a scene is needed.
    """
    chain = place.chain
    known: dict[str, Callable[[], Objective]] = {
        "stroke_barrier": StrokeBarrier,
        "mid_stroke": MidStroke,
        "length_variation": LengthVariation,
        "in_plane": lambda: goal_plane(chain, goal.parts[0].target),
        "condition_number": lambda: Differences("condition_number", lambda q: _condition(place, goal, q)),
        "actuator_force": lambda: Differences("actuator_force", lambda q: _greatest_force(place, q)),
        "utilisation": lambda: Differences("utilisation", lambda q: _greatest_use(place, q)),
    }
    if isinstance(place, Site):
        # of the unloaded shape: the sag of an elastic arm would cost a solve for every evaluation
        wanted = place.task.motion.clearance + MARGIN
        known["clearance"] = lambda: ClearanceHinges(place.unsagged_surroundings, wanted, payload=False)
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


def _condition(place: Place, goal: GoalSpace, q: Array) -> Array:
    """Condition number of the goal rows, lengths counted in straight arms, shape (b,)."""
    chain: Chain = place.chain
    J = evaluate(chain, goal, place.box.chain.state(q), np.zeros(len(q), int))[1]
    reach = float(np.linalg.norm(chain.tool(chain.straight)[0] - chain.mount[:3, 3]))
    return condition_numbers(np.concatenate([J[:, :3] / reach, J[:, 3:]], axis=1))


def _greatest_force(place: Place, q: Array) -> Array:
    """Smooth stand-in for the greatest actuator force at rest, shape (b,), in 100 kN."""
    bar = solve_members(place.load_model, place.chain.nodes(q)).bar
    return smooth_peak(np.abs(bar[:, place.chain.truss.actuated]) / _FORCE)


def _greatest_use(place: Place, q: Array) -> Array:
    """Smooth stand-in for the greatest utilisation of any member at rest, shape (b,)."""
    return smooth_peak(find_use(place.load_model, place.sections, place.chain.nodes(q), safety_factor_of(place)).worst)
