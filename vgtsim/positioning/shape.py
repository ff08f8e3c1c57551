"""Shape control: an arm fitted to a curve segment by segment, then to its end conditions exactly (section 7.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import ReachError
from vgtsim.kinematics import order_down
from vgtsim.positioning.fitting import cubic, fit
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.objectives import Configurations, MidStroke, Nearness, Objective
from vgtsim.positioning.problem import Problem, solve
from vgtsim.positioning.solution import Solution
from vgtsim.positioning.strokes import StrokeBox, bring_inside

Array = NDArray[np.float64]

MAGNITUDES = np.geomspace(0.25, 4.0, 13)  # of the end tangents, in distances from base to tool
BARRIER = 1e-2  # weight of the stroke barrier beside the nearness to a fit: a tenth of what other objectives have


@dataclass(frozen=True)
class Shape:
    """An arm in the shape of a curve.

    Attributes:
        fitted: Inputs that put every segment's end on the curve, strokes left aside, shape (n,).
        overrun: Greatest excess of a fitted length over its stroke, m; infinite where a module does not assemble.
        solution: Batch of one: the arm inside its strokes with its end conditions met, as near to the fit as it can be.
        magnitudes: Of the two end tangents, m; NaN for a given curve.
        value: Of the objective at the solution.
    """

    fitted: Array
    overrun: float
    solution: Solution
    magnitudes: tuple[float, float]
    value: float


def solve_shapes(
    box: StrokeBox,
    position: ArrayLike,
    direction: ArrayLike,
    objective: Objective | None = None,
    magnitudes: tuple[tuple[float, float], ...] | None = None,
) -> list[Shape]:
    """Solve a tool goal in frame G, shapes (3,), m, by all cubic directrices of a search: the least objective first.

    The objective is the distance from mid-stroke when absent; `magnitudes` are pairs of the end tangents', m, 13 by 13
    of them when absent. Only shapes that meet the goal inside the strokes are returned.

    Raises:
        ReachError: The end conditions cannot be met from any fit.
        DescriptionError: The arm has modules that cannot be fitted to a curve; they are named.

    Source: section 7.4 and equations 8.9, 8.10. Differs: equal arc length at once, and an exact end after the fit; the
    objective is that of the arm with its end met, not of the fit.
    """
    goal, chain = tool_goal(position, direction), box.chain
    at, along = np.asarray(position, float), goal.groups[1].target
    face = at - chain.manipulator.tip_plate.tool_offset * along
    base, out = chain.mount[:3, 3], chain.mount[:3, 2]
    reach = float(np.linalg.norm(face - base))
    pairs = magnitudes or tuple((float(a), float(b)) for a in reach * MAGNITUDES for b in reach * MAGNITUDES)
    fits = np.array([fit(chain, cubic(base, face, a * out, b * along)) for a, b in pairs])
    overrun = overruns(box, fits)
    # the end conditions exactly and the strokes kept, as near to each fit as may be
    near = bring_inside(box, fits)
    nearness = Nearness(box.lengths(box.chain.state(near).legs))
    found = solve(Problem(box, goal.repeat(len(fits)), nearness, barrier=BARRIER), near)
    met = np.flatnonzero(found.met)
    if not len(met):
        best = int(np.argmin(np.linalg.norm(found.error, axis=1)))
        raise unmet_ends(found.error[best], overrun[best])
    placed = Configurations(box, box.chain.state(found.q[met]), np.zeros(len(met), int))
    value = (objective or MidStroke()).values(placed)
    order = order_down(-value)[: len(met)]
    return [
        Shape(fits[i], float(overrun[i]), found.pick(slice(i, i + 1)), pairs[i], float(v))
        for v, i in zip(value[order].tolist(), met[order].tolist(), strict=True)
    ]


def overruns(box: StrokeBox, q: Array) -> Array:
    """Greatest excess of a length over its stroke, shape (b,), m; infinite where a module does not assemble."""
    state = box.chain.state(q)
    return np.where(state.assembles, -np.min(box.spare(box.lengths(state.legs)), axis=1), np.inf)


def unmet_ends(error: Array, overrun: float) -> ReachError:
    """The error of an arm whose end conditions are not met from a fit."""
    shortfall = float(np.linalg.norm(error[:3]))
    return ReachError("shape", shortfall, (), f"the fit's strokes are overrun by {overrun:.3g} m")
