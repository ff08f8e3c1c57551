"""One tool goal, by a named method and named objectives: what the command line asks for."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.redundancy import Method
from vgtsim.description.scene import Scene
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.start import bend_start
from vgtsim.planning.checks import surroundings_of
from vgtsim.planning.resolution import asked_resolution, goal_keep, resolve_goal, stroke_box
from vgtsim.positioning.analysis import analyse
from vgtsim.positioning.goals import GoalSpace, RowReport, evaluate, report_rows, tool_goal
from vgtsim.positioning.kernel import Kernel
from vgtsim.positioning.solver import GoalSolution
from vgtsim.positioning.strokes import StrokeBox, binding_actuators

Array = NDArray[np.float64]

Facts = dict[str, str | float | int | bool | list[str]]


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
        q: Inputs, shape (n,).
        lengths: Of the actuators, shape (J,), m.
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
        scene: Gives start, payload, stroke margin and the surroundings to keep clear of; without one the arm starts straight.

    Returns:
        The answer.

    Raises:
        DescriptionError: An objective is not known, or needs a scene.
        GoalError: The goal is no goal.
        ReachError: It is not met, or not clear of the surroundings.
    """
    how = asked_resolution(chain, request.method, request.objectives, scene)
    start = bend_start(chain, scene.task.motion.start) if scene else chain.straight
    keep = goal_keep(scene, chain) if scene else None
    found = resolve_goal(chain, how, "ik", (request.position, request.direction), start, scene, keep)
    goal, box = tool_goal(request.position, request.direction), stroke_box(chain, scene)
    facts = _facts(chain, box, goal, found, request.objectives)
    if scene:
        facts["clearance, m"], facts["nearest"] = surroundings_of(scene, chain).least(found.q)
    return Answer(found.q, chain.lengths(found.q), report_rows(chain, goal, found.q), facts)


def answer_as_json(answer: Answer) -> str:
    """The answer as JSON: arrays as nested lists, SI units."""
    whole = asdict(answer) | {"q": answer.q.tolist(), "lengths": answer.lengths.tolist()}
    return json.dumps(whole, indent=2) + "\n"


def _facts(chain: Chain, box: StrokeBox, goal: GoalSpace, found: GoalSolution, objectives: tuple[str, ...]) -> Facts:
    J = evaluate(chain, goal, Kernel(chain).state(found.q[None]), np.zeros(1, int))[1][0]
    seen = analyse(J, goal.names)
    return {
        "objective": " + ".join(objectives),
        "value": found.value,
        "iterations": found.iterations,
        "optimal": found.optimal,
        "stationarity": found.stationarity,
        "condition number": seen.condition,
        "lost directions": list(seen.lost_names),
        "binding": list(binding_actuators(chain, box, found.q)),
        **found.notes,
    }
