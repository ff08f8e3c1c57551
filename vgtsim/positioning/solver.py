"""A configuration for one tool goal: by a named method, inside the strokes, and clear of everything when asked.

The first start is the present configuration swung to the goal's azimuth. When it does not lead to the goal, or not
clear of the surroundings, several other starts are tried at once; see `restarts`. An error names the pose nearest to it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.constants import Method
from vgtsim.errors import ReachError
from vgtsim.positioning.methods import solve_by
from vgtsim.positioning.newton import NewtonSettings, Quadratic, minimise
from vgtsim.positioning.objectives import ClearanceHinges, StrokeBarrier, WeightedSum
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.restarts import start_groups
from vgtsim.positioning.solution import Solution
from vgtsim.positioning.strokes import binding_actuators
from vgtsim.positioning.surroundings import Surroundings

_WITHIN_REACH = 1e-3  # error, m or rad, below which only the surroundings keep the arm from the goal
_INSIST = (10.0, 1000.0)  # weights of the clearance's hinges beside an objective that does not keep it
_KAPPAS = (1e-2, 1e-4, 1e-6)  # m²: at the last one the barrier holds the arm a millimetre off the ends of its strokes
_SETTLED = 1e-5  # fall of the objective that is not worth another step


@dataclass(frozen=True)
class Keep:
    """Surroundings and the clearance, m, that every configuration must keep from them."""

    surroundings: Surroundings
    clearance: float


def solve_goal(
    name: str,
    problem: Problem,
    method: Method,
    start: ArrayLike,
    keep: Keep | None = None,
    settings: NewtonSettings | None = None,
) -> Solution:
    """Find a configuration that meets one named goal, starting from inputs of shape (n,).

    The solution has no batch dimension and is read-only. It is the best of the first group of starts that has any. Its
    clearance is at least that of `keep`: the objective is changed where it does not keep it. Its iterations are those
    over all starts. The coupled method needs the problem's reduction.

    Raises:
        ReachError: No start leads to the goal, or none clear of the surroundings; it holds the shortfall and what
            binds.
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.

    Source: chapters 6 to 8; see `methods`.
    """
    how = settings or NewtonSettings()
    count, near, missed = 0, [], []
    for starts in start_groups(problem, np.asarray(start, float)):
        try:
            found = solve_by(method, problem, starts, how)
        except ReachError as error:  # of a curve, which knows no goal's name
            raise ReachError(name, error.shortfall, error.binding, error.detail) from None
        count += int(np.sum(found.iterations))
        solved = _measured(found.pick(found.met), keep)
        if keep is not None:
            solved, steps = _insist(problem, method, solved, keep, how)
            count += steps
        clear = solved if keep is None else solved.pick(solved.clearance >= keep.clearance)
        if len(clear.q):
            best = clear.pick(int(np.argmin(clear.value)))
            best.q.flags.writeable = best.error.flags.writeable = False
            return replace(best, iterations=np.array(count))
        near.append(solved)
        missed.append(found.q[~found.met])
        if method is Method.SHAPE:  # it starts from its curves, whatever the group
            break
    raise _reach_error(name, problem, near, np.concatenate(missed), keep, how.most)


def _measured(found: Solution, keep: Keep | None) -> Solution:
    """Solutions with their clearance, where one is asked for."""
    if keep is None or not len(found.q):
        return replace(found, clearance=np.full(len(found.q), np.inf), nearest=np.full(len(found.q), "", object))
    clearance, places = keep.surroundings.clearance(found.q)
    return replace(found, clearance=clearance, nearest=np.array(places, object))


def _insist(
    problem: Problem, method: Method, solved: Solution, keep: Keep, how: NewtonSettings
) -> tuple[Solution, int]:
    """Where no solution keeps the clearance, those of an objective to which it is added; and the number of iterations."""
    steps = 0
    hinges = ClearanceHinges(keep.surroundings, keep.clearance, payload=False)
    for weight in _INSIST:
        if not len(solved.q) or np.any(solved.clearance >= keep.clearance):
            break
        harder = replace(problem, objective=WeightedSum(((1.0, problem.objective), (weight, hinges))))
        found = solve_by(method, harder, solved.q, how)
        steps += int(np.sum(found.iterations))
        solved = _measured(found.pick(found.met), keep)
    return solved, steps


def _reach_error(
    name: str, problem: Problem, near: list[Solution], missed: Array, keep: Keep | None, most: int
) -> ReachError:
    """The reason that keeps the arm from a goal: its strokes, or the bodies about it."""
    shapes = [shape for item in near for shape in zip(np.atleast_1d(item.clearance), item.nearest, strict=True)]
    if not shapes:
        q, left = come_nearest(problem, missed, most)
        best = int(np.argmin(np.linalg.norm(left, axis=1)))
        if keep is None or np.linalg.norm(left[best]) > _WITHIN_REACH:
            shortfall, turn = float(np.linalg.norm(left[best, :3])), 2 * np.arctan(np.linalg.norm(left[best, 3:]) / 2)
            place = ", ".join(f"{x:.3f}" for x in problem.chain.tool(q[best])[0])
            detail = f"nearest at ({place}) m, direction off by {np.degrees(turn):.3g} degrees"
            return ReachError(name, shortfall, binding_actuators(problem.box, q[best]), detail)
        shapes = [keep.surroundings.least(q[best])]
    assert keep is not None  # or the goal would have been met
    clearance, place = max(shapes)
    detail = f"it is near enough, but every posture found there comes to {clearance:.3f} m of {place}"
    return ReachError(name, 0.0, (place,), f"{detail}, wanted {keep.clearance:.3f} m")


def come_nearest(problem: Problem, start: Array, most: int = 80) -> tuple[Array, Array]:
    """Come as near to one goal as the strokes let the arm, from inputs inside the strokes, shape (b, n).

    The sum |e|² / (2 kappa) plus the stroke barrier is made least, with e the goal's error and kappa falling; the
    problem's objective plays no part. Returns inputs, shape (b, n), and errors of the rows, shape (b, m), m and rad: a
    metre counts like a radian.
    """
    plain = replace(problem, objective=StrokeBarrier())
    z, every, rows = problem.variables(start), np.zeros(len(start), int), len(problem.goal.names)
    for kappa in _KAPPAS:

        def pulled(z: Array, which: Index, kappa: float = kappa) -> Quadratic:
            at = plain.model(z, every[which])
            e, J = at.error[:, :rows], at.J[:, :rows]  # static legs keep their length all the same
            Jt = np.swapaxes(J, 1, 2) / kappa
            value = at.value + np.sum(e**2, axis=1) / (2 * kappa)
            slope = at.slope + (Jt @ e[..., None])[..., 0]
            return Quadratic(
                inside=at.inside,
                error=at.error[:, rows:],
                J=at.J[:, rows:],
                value=value,
                slope=slope,
                curve=at.curve + Jt @ J,
            )

        z = minimise(pulled, z, NewtonSettings(optimality=_SETTLED, most=most)).q
    return problem.inputs(z), plain.model(z, every).error[:, :rows]
