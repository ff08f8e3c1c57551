"""An arm given the shape of any curve, such as a spline through way-points (section 7.4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from vgtsim.positioning import (
    Nearness,
    NewtonSettings,
    Problem,
    Solution,
    StrokeBox,
    bring_inside,
    solve_anywhere,
    tool_goal,
)
from vgtsim.positioning.shape import BARRIER, Directrix, fit, overruns, unmet_ends

Array = NDArray[np.float64]


def spline(points: ArrayLike, first: ArrayLike, last: ArrayLike) -> Directrix:
    """A cubic spline through way-points, spaced by their chords, with given end tangents.

    Args:
        points: Shape (k, 3), m; the ends are the first and the last.
        first: Derivative by u at the start, shape (3,), m.
        last: At the end, shape (3,), m.

    Returns:
        The curve; its curvature is continuous.

    Raises:
        ValueError: Two way-points in a row coincide.
    """
    way = np.asarray(points, float)
    chord = np.linalg.norm(np.diff(way, axis=0), axis=1)
    if np.any(chord < 1e-9):
        raise ValueError(f"way-points {int(np.argmin(chord))} and {int(np.argmin(chord)) + 1} coincide")
    u = np.concatenate([[0.0], np.cumsum(chord)]) / chord.sum()
    ends: Any = ((1, np.asarray(first, float)), (1, np.asarray(last, float)))
    curve = CubicSpline(u, way, bc_type=ends)
    rate = curve.derivative()
    return Directrix(lambda at: curve(at), lambda at: rate(at))


def follow_curve(
    box: StrokeBox,
    curve: Directrix,
    direction: ArrayLike,
    settings: NewtonSettings | None = None,
    twist: float = 0.0,
) -> Solution:
    """Give an arm the shape of any curve that begins at its base, and its end exactly.

    Args:
        box: The arm and its strokes.
        curve: From the base to the last face's centroid, in frame G.
        direction: Tool direction at the end, in frame G, shape (3,).
        settings: Of the last stage.
        twist: Of the last face about the curve, rad; see `fit`.

    Raises:
        ReachError: The end conditions cannot be met from the fit.
    """
    chain = box.chain
    along = np.asarray(direction, float) / np.linalg.norm(direction)
    end = curve.point(np.ones(1))[0] + chain.manipulator.tip_plate.tool_offset * along
    q = fit(chain, curve, twist)
    overrun = float(overruns(box, q[None])[0])
    near = bring_inside(box, q)
    problem = Problem(box, tool_goal(end, along), Nearness(chain.lengths(near)), barrier=BARRIER)
    solution = solve_anywhere(problem, near, settings)
    if not solution.met[0]:
        raise unmet_ends(solution.error[0], overrun)
    return solution
