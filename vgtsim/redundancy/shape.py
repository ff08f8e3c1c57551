"""Shape control: an arm fitted to a curve segment by segment, then to its end conditions exactly (section 7.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.manipulator import DoubleOctahedral
from vgtsim.description.modules import Prism
from vgtsim.errors import ReachError
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.directrix import Directrix, cubic, equal_partition
from vgtsim.redundancy.goals import GoalSpace, tool_goal
from vgtsim.redundancy.kernel import Kernel
from vgtsim.redundancy.newton import NewtonSettings
from vgtsim.redundancy.objectives import Nearness
from vgtsim.redundancy.positioning import Positioning, Positions
from vgtsim.redundancy.restarts import solve_anywhere
from vgtsim.redundancy.strokes import StrokeBox, bring_inside

Array = NDArray[np.float64]

MAGNITUDES = np.geomspace(0.25, 4.0, 13)  # of the end tangents, in distances from base to tool


@dataclass(frozen=True)
class Shape:
    """An arm in the shape of a curve.

    Attributes:
        fitted: Inputs that put every segment's end on the curve, strokes left aside, shape (A, 3).
        overrun: Greatest excess of a fitted length over its stroke, m; at most zero when all are inside.
        solution: The arm inside its strokes with its end conditions met, as near to the fit as it can be.
        magnitudes: Of the two end tangents, m; NaN for a given curve.
    """

    fitted: Array
    overrun: float
    solution: Positions
    magnitudes: tuple[float, float]


def fit(chain: Chain, curve: Directrix) -> Array:
    """Inputs that put the end of every segment, an active module and the static sections on it, on a curve.

    The segment ends at p = w U + s (2 u_z U - z) in its base frame, with w its extension and s its static length, so U
    points along p + s z: one closed form for each segment.

    Args:
        chain: The arm; it begins with an active module.
        curve: From the arm's base to its last face, in frame G.

    Returns:
        Shape (A, 3); not limited by strokes. Segments are of equal arc length in proportion to the straight arm's.

    Source: sections 3.5.4 and 7.4.1. Differs: each end lies on the curve exactly; its normal follows from the segments
    before it, since a symmetric module has three inputs, not six.
    """
    static = np.zeros(len(chain.geometries))
    active = -1
    for module in chain.manipulator.modules:
        if isinstance(module, DoubleOctahedral):
            active += 1
        elif isinstance(module, Prism):
            static[active] += module.length
    offsets = np.array([geometry.joint_offset for geometry in chain.geometries])
    straight = 2 * chain.straight[:, 2] + offsets + static
    fine = equal_partition(curve, 400)
    ends = np.interp(np.cumsum(straight) / straight.sum(), np.linspace(0, 1, 401), fine)
    q, R, P = np.empty_like(chain.straight), chain.mount[:3, :3], chain.mount[:3, 3]
    for a, target in enumerate(curve.point(ends)):
        way = R.T @ (target - P)
        way[2] += static[a]
        size = float(np.linalg.norm(way))
        U = way / size
        turn = np.eye(3) - 2 * np.outer(U, U)
        turn[:, 2] *= -1
        extension = size - 2 * static[a] * U[2]
        q[a] = [U[0], U[1], (extension - chain.geometries[a].joint_offset) / 2]
        R, P = R @ turn, target
    return q


def solve_shape(
    chain: Chain,
    box: StrokeBox,
    position: ArrayLike,
    direction: ArrayLike,
    magnitudes: tuple[float, float] | None = None,
    settings: NewtonSettings | None = None,
) -> Shape:
    """Solve a tool goal by a cubic directrix.

    Args:
        chain: The arm.
        box: Strokes allowed.
        position: Tool point in frame G, shape (3,), m.
        direction: Tool direction in frame G, shape (3,).
        magnitudes: Of the end tangents, m; absent for the pair, of 13 by 13, whose fit is nearest to mid-stroke.
        settings: Of the last stage.

    Returns:
        The shape.

    Raises:
        ReachError: No curve of the search can be fitted, or the end conditions cannot be met from the fit.

    Source: section 7.4 and equations 8.9, 8.10. Differs: equal arc length at once, and an exact end after the fit.
    """
    goal = tool_goal(position, direction)
    at, along = np.asarray(position, float), goal.parts[1].target
    face = at - chain.manipulator.tip_plate.tool_offset * along
    base, out = chain.mount[:3, 3], chain.mount[:3, 2]
    reach = float(np.linalg.norm(face - base))
    if magnitudes is None:
        pairs = [(float(a), float(b)) for a in reach * MAGNITUDES for b in reach * MAGNITUDES]
    else:
        pairs = [magnitudes]
    fits = np.array([fit(chain, cubic(base, face, a * out, b * along)) for a, b in pairs])
    score, overrun = _score(chain, box, fits)
    best = int(np.argmin(score))
    if not np.isfinite(score[best]):
        raise ReachError("shape", 0.0, (), f"no module assembles on any of {len(pairs)} cubic curves")
    return _finish(chain, box, goal, fits[best], float(overrun[best]), pairs[best], settings)


def follow_curve(
    chain: Chain, box: StrokeBox, curve: Directrix, direction: ArrayLike, settings: NewtonSettings | None = None
) -> Shape:
    """Give an arm the shape of any curve that begins at its base, and its end exactly.

    Args:
        chain: The arm.
        box: Strokes allowed.
        curve: From the base to the last face's centroid, in frame G.
        direction: Tool direction at the end, in frame G, shape (3,).
        settings: Of the last stage.

    Returns:
        The shape.

    Raises:
        ReachError: The end conditions cannot be met from the fit.
    """
    along = np.asarray(direction, float) / np.linalg.norm(direction)
    end = curve.point(np.ones(1))[0] + chain.manipulator.tip_plate.tool_offset * along
    q = fit(chain, curve)
    overrun = float(_score(chain, box, q[None])[1][0])
    return _finish(chain, box, tool_goal(end, along), q, overrun, (np.nan, np.nan), settings)


def _score(chain: Chain, box: StrokeBox, q: Array) -> tuple[Array, Array]:
    """Squares of distances from mid-stroke, and greatest excess, infinite where modules do not assemble, shape (b,)."""
    state = Kernel(chain).state(q)
    half = (box.greatest - box.least) / 2
    square = np.sum(((state.length - box.least) / half - 1) ** 2, axis=(1, 2))
    excess = -np.min(box.spare(state.length), axis=(1, 2))
    return np.where(state.assembles, square, np.inf), np.where(state.assembles, excess, np.inf)


def _finish(
    chain: Chain,
    box: StrokeBox,
    goal: GoalSpace,
    fitted: Array,
    overrun: float,
    magnitudes: tuple[float, float],
    settings: NewtonSettings | None,
) -> Shape:
    near = bring_inside(chain, box, fitted)
    problem = Positioning(chain, box, goal, Nearness(chain.lengths(near)), barrier=1e-2)
    solution = solve_anywhere(problem, near, settings)
    if not solution.met[0]:
        shortfall = float(np.linalg.norm(solution.error[0, :3]))
        raise ReachError("shape", shortfall, (), f"the fit's strokes are overrun by {overrun:.3g} m")
    return Shape(fitted, overrun, solution, magnitudes)
