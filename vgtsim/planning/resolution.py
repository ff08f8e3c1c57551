"""From a tool goal to a configuration, by the method and objectives of a scene or a command."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass

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
    NewtonSettings,
    Objective,
    Position,
    Problem,
    RowReport,
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
    solve_goal,
    tool_goal,
)
from vgtsim.site import Place
from vgtsim.statics import find_use, smooth_peak, solve_members

Facts = dict[str, str | float | int | bool | list[str]]

_TURNED = 1e-6  # angle between base frames from which modules count as turned, rad
_STEPS = 300  # a goal by a wall makes the valley of the optimum narrow and curved
MARGIN = 0.02  # m kept at the goals beyond the path's clearance, so that a path can leave them
_FORCE = 1e5  # N: actuator forces count in units of what a middling cylinder pushes


@dataclass(frozen=True)
class Resolution:
    """How redundancy is resolved: a method, and names of objectives, each with `:weight` or without.

    `coupling` is for the coupled method, and the anchored one of a scene that couples: pairs of the active module that
    follows and the one that it follows.
    """

    method: Method
    objective: tuple[str, ...]
    coupling: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Answer:
    """The answer to a request: inputs, shape (n,), lengths, shape (J,), m, goal rows, and facts by name."""

    q: Array
    lengths: Array
    rows: tuple[RowReport, ...]
    facts: Facts


def default_resolution(place: Place) -> Resolution:
    """How a site's scene resolves redundancy; an arm alone keeps its actuators near mid-stroke."""
    if place.scene is None:
        return Resolution(Method.NULLSPACE, ("mid_stroke",))
    motion = place.scene.task.motion
    return Resolution(motion.method, motion.objective, place.coupling)


def goal_keep(place: Place) -> Keep | None:
    """Minimum clearance at a goal: the path's and a margin. It is checked on the unloaded shape; sag is added later."""
    return place.surroundings and Keep(place.surroundings.unloaded, place.clearance + MARGIN)


def aim_tool(position: ArrayLike, direction: ArrayLike | None) -> GoalSpace:
    """Goal rows of a tool point, m, and a direction, as `tool_goal`; without one the tool points anywhere."""
    return GoalSpace((Position(np.asarray(position, float)),)) if direction is None else tool_goal(position, direction)


def resolve_goal(
    place: Place,
    how: Resolution,
    name: str,
    goal: tuple[ArrayLike, ArrayLike | None],
    start: ArrayLike,
    keep: Keep | None = None,
) -> Solution:
    """Find a configuration for a tool point, m, and direction in frame G, shape (3,) each, from inputs of shape (n,).

    Without a direction the tool points anywhere.

    Raises:
        DescriptionError: An objective is not known, or needs a scene; or coupled modules are turned to each
            other.
        GoalError: The goal is no goal.
        ReachError: It cannot be met, or not clear of the surroundings of `keep`.
    """
    chain = place.chain
    rows = aim_tool(*goal)
    objective = make_objective(place, rows, how.objective)
    reduction = None
    if how.coupling:
        _require_alike(place, how.coupling)
        reduction = couple(chain.straight, how.coupling, owner=chain.layout.owner)
    problem = Problem(place.box, rows, objective, reduction=reduction)
    return solve_goal(name, problem, how.method, start, keep, NewtonSettings(most=_STEPS))


def solve_request(
    place: Place,
    position: ArrayLike,
    direction: ArrayLike,
    method: Method = Method.NULLSPACE,
    objectives: tuple[str, ...] = ("mid_stroke",),
) -> Answer:
    """Solve one goal from the start of a site, clear of its surroundings, or from a straight arm alone.

    The tool point, m, and the direction, of any length but zero, are in frame G, shape (3,).

    Raises:
        DescriptionError: An objective is not known, or needs a scene.
        GoalError: The goal is no goal.
        ReachError: It is not met, or not clear of the surroundings.
    """
    chain, goal = place.chain, tool_goal(position, direction)
    how = _asked_resolution(place, method, objectives)
    found = resolve_goal(place, how, "ik", (position, direction), place.start, goal_keep(place))
    facts = _facts(place, goal, found, objectives)
    if place.surroundings:
        facts["clearance, m"], facts["nearest"] = place.surroundings.least(found.q)
    return Answer(found.q, chain.lengths(found.q), report_rows(chain, goal, found.q), facts)


def answer_as_json(answer: Answer) -> str:
    """The answer as JSON: arrays as nested lists, SI units."""
    whole = asdict(answer) | {"q": answer.q.tolist(), "lengths": answer.lengths.tolist()}
    return json.dumps(whole, indent=2) + "\n"


def _asked_resolution(place: Place, method: Method, objectives: tuple[str, ...]) -> Resolution:
    """A method and objectives; coupled modules are those of a coupled scene, or else of section 8.1."""
    scene = place.scene
    if method is not Method.COUPLED and not (scene and scene.task.motion.method is method):
        return Resolution(method, objectives)
    if place.coupling or method is not Method.COUPLED:
        return Resolution(method, objectives, place.coupling)
    arm = place.chain.manipulator
    try:
        return Resolution(method, objectives, choose_coupling(None, arm.active))
    except ValueError as error:
        raise DescriptionError(None, "method", f"'coupled' for {arm.name}", str(error)) from None


def _facts(place: Place, goal: GoalSpace, found: Solution, objectives: tuple[str, ...]) -> Facts:
    J = evaluate(place.chain, goal, place.box.chain.state(found.q[None]), np.zeros(1, int))[1][0]
    return {
        "objective": " + ".join(objectives),
        "value": float(found.value),
        "iterations": int(found.iterations),
        "optimal": bool(found.optimal),
        "stationarity": float(found.stationarity),
        "condition number": float(condition_numbers(J)),
        "lost directions": list(lost_directions(J, goal.names)),
        "binding": list(binding_actuators(place.box, found.q)),
        **found.notes,
    }


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
