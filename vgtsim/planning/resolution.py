"""From a tool goal to a problem, by the method and objectives of a scene or a command; and what is told of its solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.constants import Method
from vgtsim.description import OBJECTIVES, choose_coupling, split_objective
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.positioning import (
    ClearanceHinges,
    Differences,
    GoalSpace,
    Keep,
    LengthVariation,
    MidStroke,
    Objective,
    Position,
    Problem,
    Solution,
    StrokeBarrier,
    WeightedSum,
    binding_actuators,
    condition_numbers,
    couple,
    evaluate,
    goal_plane,
    lost_directions,
    report_rows,
    tool_goal,
)
from vgtsim.site import Place
from vgtsim.statics import find_use, smooth_peak, solve_members

_TURNED = 1e-6  # angle between base frames from which modules count as turned, rad
MARGIN = 0.02  # m kept at the goals beyond the path's clearance, so that a path can leave them
_FORCE = 1e5  # N: actuator forces count in units of what a middling cylinder pushes


def usual_way(place: Place) -> tuple[Method, tuple[str, ...]]:
    """Method and terms of the objective of a site's scene; an arm alone keeps its actuators near mid-stroke."""
    if place.scene is None:
        return Method.NULLSPACE, ("mid_stroke",)
    motion = place.scene.task.motion
    return motion.method, motion.objective


def goal_keep(place: Place) -> Keep | None:
    """Minimum clearance at a goal: the path's and a margin. It is checked on the unloaded shape; sag is added later."""
    return place.surroundings and Keep(place.surroundings.unloaded, place.clearance + MARGIN)


def aim_tool(position: ArrayLike, direction: ArrayLike | None) -> GoalSpace:
    """Goal rows of a tool point, m, and a direction, as `tool_goal`; without one the tool points anywhere."""
    return GoalSpace((Position(np.asarray(position, float)),)) if direction is None else tool_goal(position, direction)


def make_problem(
    place: Place, goal: GoalSpace, method: Method, terms: tuple[str, ...], keep: Keep | None = None
) -> Problem:
    """Problem of a goal of the tool, for `solve_by_method`; terms of the objective are those of `make_objective`.

    Configurations keep the clearance that goals have in the place, or that of `keep`. The coupled modules are those of a
    coupled scene, or else of section 8.1.

    Raises:
        DescriptionError: A term is not known, or needs a scene; or modules that cannot be coupled would be.
    """
    chain, pairs = place.chain, _find_pairs(place, method)
    objective = make_objective(place, goal, terms)
    if pairs:
        _require_alike(place, pairs)
    return Problem(
        box=place.box,
        goal=goal,
        objective=objective,
        reduction=couple(chain.straight, pairs, owner=chain.layout.owner) if pairs else None,
        method=method,
        keep=keep or goal_keep(place),
    )


def _find_pairs(place: Place, method: Method) -> tuple[tuple[int, int], ...]:
    """Pairs of active modules that move as one, follower and leader; none where the method couples none."""
    scene, arm = place.scene, place.chain.manipulator
    if place.coupling and scene is not None and method in (Method.COUPLED, scene.task.motion.method):
        return place.coupling
    if method is not Method.COUPLED:
        return ()
    try:
        return choose_coupling(None, arm.active)
    except ValueError as error:
        raise DescriptionError(None, "method", f"'coupled' for {arm.name}", str(error)) from None


def report_solution(place: Place, problem: Problem, found: Solution, terms: tuple[str, ...]) -> dict[str, Any]:
    """The solution of one goal as the `ik` verb writes it: lists and numbers, SI units.

    `q` are inputs, `lengths` actuator lengths, m, `rows` the goal rows, see `RowReport`, and `facts` what else is known, by name.
    """
    chain = place.chain
    J = evaluate(chain, problem.goal, chain.state(found.q[None]), np.zeros(1, int))[1][0]
    facts = {
        "objective": " + ".join(terms),
        "value": float(found.value),
        "iterations": int(found.iterations),
        "optimal": bool(found.optimal),
        "stationarity": float(found.stationarity),
        "condition number": float(condition_numbers(J)),
        "lost directions": list(lost_directions(J, problem.goal.names)),
        "binding": list(binding_actuators(place.box, found.q)),
        **found.notes,
    }
    if place.surroundings:
        facts["clearance, m"], facts["nearest"] = place.surroundings.least(found.q)
    rows = [asdict(row) for row in report_rows(chain, problem.goal, found.q)]
    return {"q": found.q.tolist(), "lengths": chain.lengths(found.q).tolist(), "rows": rows, "facts": facts}


def _require_alike(place: Place, pairs: tuple[tuple[int, int], ...]) -> None:
    """Refuse to couple modules turned to each other: equal inputs, each in its module's own frame, bend them apart."""
    yaws, seats, named = place.chain.straight_yaws, place.chain.seats, place.chain.layout.names
    for follower, leader in pairs:
        if seats[follower][0].modules.turns_alike:
            continue
        turn = np.angle(np.exp(1j * (yaws[follower] - yaws[leader])))
        if abs(turn) > _TURNED:
            names = f"{named[follower]} and {named[leader]} of {place.chain.manipulator.name}"
            found = f"{names}, turned by {np.degrees(turn):.4g} degrees to each other"
            allowed = "coupled modules whose base frames are parallel in the straight arm"
            scene = place.scene
            key = "motion.coupling" if scene and scene.task.motion.coupling is not None else "method"
            raise DescriptionError(scene and scene.file, key, found, allowed)


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
        "in_plane": lambda: goal_plane(chain, goal.groups[0].target),
        "condition_number": lambda: Differences("condition_number", lambda q: _condition(place, goal, q)),
        "actuator_force": lambda: Differences("actuator_force", lambda q: _greatest_force(place, q)),
        "utilisation": lambda: Differences("utilisation", lambda q: _greatest_use(place, q)),
    }
    if keep := goal_keep(place):  # of the unloaded shape: sag would cost a solve for every evaluation
        known["clearance"] = lambda: ClearanceHinges(keep.surroundings, keep.clearance, payload=False)
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
    return smooth_peak(find_use(place.load_model, place.sections, place.chain.nodes(q), place.safety_factor).worst)
