"""Goal solver: a configuration that puts the tool at a goal, with strokes to spare and clear of its surroundings.

One entry, `solve_goal`: plain arrays in, a result out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import ReachError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.descent import Descent, Problem, descend, nearest
from vgtsim.redundancy.seeds import seeds
from vgtsim.redundancy.strokes import make_box
from vgtsim.redundancy.surroundings import Surroundings

Array = NDArray[np.float64]

_BINDING = 2e-3  # an actuator this near to the end of its box is called binding, m


@dataclass(frozen=True)
class SolverSettings:
    """How a goal is solved.

    Attributes:
        stroke_margin: Distance kept from the ends of the strokes, m.
        clearance: Clearance wanted, m.
        softness: Width over which the clearance hinge rises before the wanted clearance is reached, m.
        tolerance: Greatest error of a solved goal, m and rad.
        most: Greatest number of steps for each penalty of a descent.
    """

    stroke_margin: float = 0.005
    clearance: float = 0.10
    softness: float = 0.10
    tolerance: float = 1e-9
    most: int = 60


@dataclass(frozen=True)
class GoalSolution:
    """A configuration that meets a goal.

    Attributes:
        q: Inputs, shape (A, 3).
        position_error: Tool from the goal, m.
        direction_error: Tool direction from the goal's, rad.
        iterations: Steps taken, over all starts.
        binding: Names of the actuators at the ends of their boxes, such as `m3/actuator/2 retracted`.
        clearance: Least clearance, m; infinite without surroundings.
        nearest: What is that near; empty without surroundings.
    """

    q: Array
    position_error: float
    direction_error: float
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

    The descent starts from the present configuration swung to the goal's azimuth; when it does not meet the goal clear
    of the surroundings, from the present one as it is, and then from a few bend patterns.

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
        ReachError: No start leads to the goal, or none clear of the surroundings; with the shortfall and what binds.

    Source: chapters 5 and 6. Differs: damped least squares with a stroke barrier in place of the pseudo-inverse.
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
    )
    count, met, missed = 0, [], []
    for seed in seeds(chain, box, np.asarray(start, float), problem.position):
        descent = descend(problem, seed, settings.most)
        count += descent.iterations
        found = _solution(problem, descent, count)
        if max(found.position_error, found.direction_error) > settings.tolerance:
            missed.append(descent)
        elif found.clearance >= settings.clearance:
            return found
        else:
            met.append(found)
    raise _reach_error(problem, name, met, missed, settings.most)


def _solution(problem: Problem, descent: Descent, count: int) -> GoalSolution:
    position, direction = problem.chain.tool(descent.q)
    angle = np.arctan2(np.linalg.norm(np.cross(direction, problem.direction)), direction @ problem.direction)
    clearance, place = np.inf, ""
    if problem.surroundings is not None:
        clearance, place = problem.surroundings.least(descent.q)
    return GoalSolution(
        q=np.array(descent.q),
        position_error=float(np.linalg.norm(position - problem.position)),
        direction_error=float(angle),
        iterations=count,
        binding=_binding(problem, descent.q),
        clearance=clearance,
        nearest=place,
    )


def _binding(problem: Problem, q: Array) -> tuple[str, ...]:
    length = problem.chain.lengths(q)
    names = []
    for a, module in enumerate(problem.chain.manipulator.active):
        for i in range(3):
            if length[a, i] - problem.box.least[a, i] < _BINDING:
                names.append(f"{module.name}/actuator/{i + 1} retracted")
            elif problem.box.greatest[a, i] - length[a, i] < _BINDING:
                names.append(f"{module.name}/actuator/{i + 1} extended")
    return tuple(names)


def _reach_error(
    problem: Problem, name: str, met: list[GoalSolution], missed: list[Descent], most: int
) -> ReachError:
    if met:
        best = max(met, key=lambda item: item.clearance)
        detail = f"every posture found comes to {best.clearance:.3f} m of {best.nearest}"
        return ReachError(name, 0.0, (best.nearest,), f"{detail}, wanted {problem.clearance:.3f} m")
    closest = sorted(missed, key=lambda item: float(np.linalg.norm(item.error)))[:2]
    ends = [nearest(problem, item.q, most) for item in closest]
    best = min(ends, key=lambda item: float(np.linalg.norm(item.error)))
    shortfall, turn = float(np.linalg.norm(best.error[:3])), float(2 * np.arctan(np.linalg.norm(best.error[3:]) / 2))
    return ReachError(name, shortfall, _binding(problem, best.q), f"direction off by {np.degrees(turn):.3g} degrees")
