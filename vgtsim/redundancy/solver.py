"""Goal solver: a configuration that puts the tool at a goal, with strokes to spare and clear of everything.

One entry, `solve_goal`: plain arrays in, a result out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import ReachError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.descent import Iterate, descend, nearest
from vgtsim.redundancy.problem import Problem
from vgtsim.redundancy.seeds import seeds
from vgtsim.redundancy.strokes import binding_actuators, make_box
from vgtsim.redundancy.surroundings import Surroundings

Array = NDArray[np.float64]

_NEARLY = 0.2  # goal error, m or rad, at which the preference for one plane may be what keeps the arm from the goal
_WITHIN_REACH = 1e-3  # the same when only its surroundings keep the arm from the goal


@dataclass(frozen=True)
class SolverSettings:
    """How a goal is solved.

    Attributes:
        stroke_margin: Distance kept from the ends of the strokes, m.
        clearance: Clearance wanted, m.
        softness: Width over which the clearance hinge rises before the wanted clearance is reached, m.
        sideways: Weight of bends out of the goal's vertical plane against the stroke barrier.
        tolerance: Greatest error of a solved goal, m and rad.
        most: Greatest number of steps for each penalty of a descent.
    """

    stroke_margin: float = 0.005
    clearance: float = 0.10
    softness: float = 0.10
    sideways: float = 1000.0
    tolerance: float = 1e-9
    most: int = 60


@dataclass(frozen=True)
class GoalSolution:
    """A configuration that meets a goal.

    Attributes:
        q: Inputs, shape (A, 3).
        position_error: Tool from the goal, m.
        direction_error: Tool direction from the goal's, rad.
        converged: Whether both are within the tolerance.
        iterations: Steps taken, over all starts.
        binding: Names of the actuators at the ends of their boxes, such as `m3/actuator/2 retracted`.
        clearance: Least clearance, m; infinite without surroundings.
        nearest: What is that near; empty without surroundings.
    """

    q: Array
    position_error: float
    direction_error: float
    converged: bool
    iterations: int
    binding: tuple[str, ...]
    clearance: float
    nearest: str

    def __post_init__(self) -> None:
        """Make the inputs read-only."""
        self.q.flags.writeable = False


def solve_goal(
    chain: Chain,
    name: str,
    position: ArrayLike,
    direction: ArrayLike,
    start: ArrayLike,
    surroundings: Surroundings | None = None,
    settings: SolverSettings | None = None,
) -> GoalSolution:
    """Find a configuration that meets a goal.

    The descent starts from the present configuration swung to the goal's azimuth; when it does not meet the
    goal clear of the surroundings, from the present one as it is, and then from a few bend patterns.

    Args:
        chain: The arm.
        name: Of the goal, for errors.
        position: Tool point in frame G, shape (3,), m.
        direction: Tool direction in frame G, shape (3,); any length but zero.
        start: Present inputs, shape (A, 3).
        surroundings: What to keep clear of.
        settings: How to solve.

    Returns:
        The solution; its clearance is at least the one wanted.

    Raises:
        ReachError: No start leads to the goal, or none clear of the surroundings; it holds the shortfall and
            what binds.

    Source: the null-space descent of chapter 6. Differs: damped least squares and a stroke barrier in place
    of the undamped pseudo-inverse.
    """
    settings = settings or SolverSettings()
    wanted = np.asarray(direction, float)
    box = make_box(chain, settings.stroke_margin)
    problem = Problem(
        chain,
        box,
        np.asarray(position, float),
        wanted / np.linalg.norm(wanted),
        surroundings,
        settings.clearance,
        settings.softness,
        settings.sideways,
    )
    count, met, missed = 0, [], []
    for seed in seeds(chain, box, np.asarray(start, float), problem.position):
        end, steps = descend(problem, seed, settings.most)
        count += steps
        if settings.tolerance < np.linalg.norm(end.error) < _NEARLY:
            end, steps = descend(replace(problem, sideways=0.0), end.q, settings.most)
            count += steps
        found = _solution(problem, end.q, count, settings.tolerance)
        if not found.converged:
            missed.append(end)
        elif found.clearance >= settings.clearance:
            return found
        else:
            met.append(found)
    raise _reach_error(problem, name, met, missed, settings.most)


def _solution(problem: Problem, q: Array, count: int, tolerance: float) -> GoalSolution:
    position, direction = problem.chain.tool(q)
    sine = np.linalg.norm(np.cross(direction, problem.direction))
    off = float(np.linalg.norm(position - problem.position))
    turn = float(np.arctan2(sine, direction @ problem.direction))
    clearance, place = np.inf, ""
    if problem.surroundings is not None:
        clearance, place = problem.surroundings.least(q)
    met = max(off, turn) <= tolerance
    return GoalSolution(
        np.array(q), off, turn, met, count, binding_actuators(problem.chain, problem.box, q), clearance, place
    )


def _reach_error(problem: Problem, name: str, met: list[GoalSolution], missed: list[Iterate], most: int) -> ReachError:
    shapes = [(item.clearance, item.nearest) for item in met]
    if not met:
        missed.sort(key=lambda item: float(np.linalg.norm(item.error)))
        ends = [nearest(problem, item.q, most) for item in missed[:2]]
        best = min(ends, key=lambda item: float(np.linalg.norm(item.error)))
        if problem.surroundings is None or np.linalg.norm(best.error) > _WITHIN_REACH:
            shortfall = float(np.linalg.norm(best.error[:3]))
            turn = np.degrees(2 * np.arctan(np.linalg.norm(best.error[3:]) / 2))
            detail = f"direction off by {turn:.3g} degrees"
            return ReachError(name, shortfall, binding_actuators(problem.chain, problem.box, best.q), detail)
        shapes = [problem.surroundings.least(best.q)]
    clearance, place = max(shapes)
    detail = f"it is near enough, but every posture found there comes to {clearance:.3f} m of {place}"
    return ReachError(name, 0.0, (place,), f"{detail}, wanted {problem.clearance:.3f} m")
