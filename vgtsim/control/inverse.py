"""One tool goal, by a named method and named objectives: what the command line asks for."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from vgtsim.control.checks import start_inputs, surroundings_of
from vgtsim.description.scene import Payload, Scene
from vgtsim.errors import DescriptionError, ReachError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.analysis import analyse, condition_numbers
from vgtsim.redundancy.anchoring import anchor_successively
from vgtsim.redundancy.goals import GoalSpace, RowReport, evaluate, report_rows, tool_goal
from vgtsim.redundancy.kernel import Kernel
from vgtsim.redundancy.newton import NewtonSettings
from vgtsim.redundancy.objectives import (
    Clearance,
    Differences,
    LengthVariation,
    MidStroke,
    Objective,
    StrokeBarrier,
    WeightedSum,
)
from vgtsim.redundancy.positioning import Positioning, Positions
from vgtsim.redundancy.reduction import couple
from vgtsim.redundancy.restarts import solve_anywhere
from vgtsim.redundancy.shape import solve_shape
from vgtsim.redundancy.strokes import StrokeBox, binding_actuators, make_box
from vgtsim.statics import make_load_model, make_sections, rate, solve, utilise

Array = NDArray[np.float64]

_MARGIN = 0.005  # kept at the ends of strokes when no scene says, m
_GRAVITY = 9.80665
_SAFETY = 1.67  # AISC 360, allowable strength
_POWER = 12  # of the mean that stands for a greatest value: smooth, and above a tenth of 132 equal ones
_FREE = 3  # modules free at a time in successive anchoring
_STEPS = 300

Facts = dict[str, str | float | int | bool | list[str]]


class Method(StrEnum):
    """How redundancy is resolved."""

    NULLSPACE = "nullspace"
    COUPLED = "coupled"
    ANCHORED = "anchored"
    SHAPE = "shape"


@dataclass(frozen=True)
class Request:
    """What is asked.

    Attributes:
        position: Tool point in frame G, m.
        direction: Tool direction in frame G.
        method: How.
        objectives: Names, each with `:weight` or without.
    """

    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    method: Method = Method.NULLSPACE
    objectives: tuple[str, ...] = ("mid_stroke",)


@dataclass(frozen=True)
class Answer:
    """What was found.

    Attributes:
        q: Inputs, shape (*q).
        lengths: Of the actuators, shape (*l), m.
        rows: Desired, reached and residual of every goal row.
        facts: Objective, iterations, condition number and what binds, by name.
    """

    q: Array
    lengths: Array
    rows: tuple[RowReport, ...]
    facts: Facts


def solve_request(chain: Chain, request: Request, scene: Scene | None = None) -> Answer:
    """Solve one goal.

    Args:
        chain: The arm.
        request: What is asked.
        scene: Gives start, payload, stroke margin and surroundings; without one the arm starts straight.

    Returns:
        The answer.

    Raises:
        DescriptionError: An objective is not known, or needs a scene.
        GoalError: The goal is no goal.
        ReachError: It is not met.
    """
    box = make_box(chain, scene.task.motion.stroke_margin if scene else _MARGIN)
    goal = tool_goal(request.position, request.direction)
    objective = make_objective(chain, goal, request.objectives, scene)
    start = start_inputs(scene, chain) if scene else chain.straight
    settings = NewtonSettings(most=_STEPS)
    problem = Positioning(chain, box, goal, objective)
    extra: Facts = {}
    if request.method is Method.SHAPE:
        shape = solve_shape(chain, box, request.position, request.direction, objective=objective)
        found = shape.solution
        extra["tangent magnitudes, m"] = str(np.round(shape.magnitudes, 3))
        extra["fit beyond strokes, m"] = shape.overrun
    elif request.method is Method.ANCHORED:
        begin = solve_anywhere(Positioning(chain, box, goal), start).q[0]
        cycle = anchor_successively(problem, begin, min(_FREE, len(chain.layout.names)), settings)
        found = cycle.solution
        extra["stages"] = cycle.stages
    else:
        if request.method is Method.COUPLED:
            row, owner = chain.straight.ravel(), chain.layout.owner
            reduction = couple(row, _pairs(len(chain.layout.names)), owner=owner)
            problem = Positioning(chain, box, goal, objective, reduction=reduction)
            start = chain.straight
        found = solve_anywhere(problem, start, settings)
    return _answer(chain, box, goal, found, objective.name, extra)


def make_objective(chain: Chain, goal: GoalSpace, names: tuple[str, ...], scene: Scene | None) -> Objective:
    """Objective of names such as `mid_stroke` or `clearance:2`.

    Args:
        chain: The arm.
        goal: Rows whose condition number is meant.
        names: At least one.
        scene: For payload and surroundings.

    Returns:
        One objective or their weighted sum.

    Raises:
        DescriptionError: A name is not known, a weight is no number above zero, or a scene is needed.
    """
    known: dict[str, Callable[[], Objective]] = {
        "stroke_barrier": StrokeBarrier,
        "mid_stroke": MidStroke,
        "length_variation": LengthVariation,
        "condition_number": lambda: Differences("condition_number", lambda q: _condition(chain, goal, q)),
        "actuator_force": lambda: Differences("actuator_force", _forces(chain, scene, utilisation=False)),
        "utilisation": lambda: Differences("utilisation", _forces(chain, scene, utilisation=True)),
    }
    if scene is not None:
        known["clearance"] = lambda: Clearance(surroundings_of(scene, chain), scene.task.motion.clearance + 0.02)
    parts = []
    for text in names:
        name, _, number = text.partition(":")
        if name not in known:
            raise DescriptionError(None, "objective", repr(name), ", ".join(known) + "; clearance needs a scene")
        try:
            weight = float(number or 1)
        except ValueError:
            weight = -1.0
        if not 0 < weight < np.inf:
            raise DescriptionError(None, f"objective {name}", f"weight {number!r}", "a number above zero")
        parts.append((weight, known[name]()))
    return parts[0][1] if len(parts) == 1 and parts[0][0] == 1 else WeightedSum(tuple(parts))


def answer_as_json(answer: Answer) -> str:
    """The answer as JSON: arrays as nested lists, SI units."""
    whole = asdict(answer) | {"q": answer.q.tolist(), "lengths": answer.lengths.tolist()}
    return json.dumps(whole, indent=2) + "\n"


def _pairs(count: int) -> tuple[tuple[int, int], ...]:
    """The two modules nearest the base, and the two nearest the tool (section 8.1), while they differ."""
    return ((0, 1), (count - 1, count - 2)) if count >= 4 else ((0, 1),)


def _condition(chain: Chain, goal: GoalSpace, q: Array) -> Array:
    """Condition number of the goal rows, lengths counted in straight arms, shape (b,)."""
    J = evaluate(chain, goal, Kernel(chain).state(q), np.zeros(len(q), int))[1]
    reach = float(np.linalg.norm(chain.tool(chain.straight)[0] - chain.mount[:3, 3]))
    return condition_numbers(np.concatenate([J[:, :3] / reach, J[:, 3:]], axis=1))


def _forces(chain: Chain, scene: Scene | None, utilisation: bool) -> Callable[[Array], Array]:
    """Smooth stand-in for the greatest actuator force, 100 kN, or utilisation of any member, at rest."""
    payload = scene.task.payload if scene else Payload(mass=0.0, radius=1e-3)
    model, sections = make_load_model(chain, payload, _GRAVITY), make_sections(chain.manipulator, chain.truss)

    def value(q: Array) -> Array:
        nodes = chain.nodes(q)
        forces = solve(model, nodes)
        if utilisation:
            ends = chain.truss.ends
            lengths = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
            used = utilise(rate(sections, lengths, _SAFETY), forces)
            size = np.maximum(used.strength, used.pressure)
        else:
            size = np.abs(forces.bar[:, chain.truss.actuated]) / 1e5
        return np.sum(size**_POWER, axis=1) ** (1 / _POWER)

    return value


def _answer(
    chain: Chain,
    box: StrokeBox,
    goal: GoalSpace,
    found: Positions,
    objective: str,
    extra: Facts,
) -> Answer:
    q = found.q[0]
    binding = binding_actuators(chain, box, q)
    if not found.met[0]:
        raise ReachError("ik", float(np.linalg.norm(found.error[0, :3])), binding, "nearest posture found")
    J = evaluate(chain, goal, Kernel(chain).state(q[None]), np.zeros(1, int))[1][0]
    seen = analyse(J, goal.names)
    facts: Facts = {
        "objective": objective,
        "value": float(found.value[0]),
        "iterations": int(found.iterations[0]),
        "optimal": bool(found.optimal[0]),
        "stationarity": float(found.stationarity[0]),
        "condition number": seen.condition,
        "lost directions": list(seen.lost_names),
        "binding": list(binding),
        **extra,
    }
    return Answer(q, chain.lengths(q), report_rows(chain, goal, q), facts)
