"""Goals solved from several starts: one by a named method and clear of everything when asked, or many in the null space.

The first start of one goal is the present configuration swung to the goal's azimuth. When it does not lead to the goal, or not
clear of the surroundings, several other starts are tried at once; see `restarts`. An error names the pose nearest to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.constants import Method
from vgtsim.errors import GoalError, ReachError
from vgtsim.positioning.goals import evaluate
from vgtsim.positioning.methods import solve, solve_anchored
from vgtsim.positioning.newton import NewtonSettings, Quadratic, minimise
from vgtsim.positioning.objectives import ClearanceHinges, StrokeBarrier, WeightedSum
from vgtsim.positioning.problem import Keep, Problem
from vgtsim.positioning.restarts import ATTEMPTS, SEED, PostureTable, choose_postures, make_postures, start_groups
from vgtsim.positioning.shape import solve_shapes
from vgtsim.positioning.solution import Solution
from vgtsim.positioning.strokes import binding_actuators, bring_inside, inside

_WITHIN_REACH = 1e-3  # error, m or rad, below which only the surroundings keep the arm from the goal
_INSIST = (10.0, 1000.0)  # weights of the clearance's hinges beside an objective that does not keep it
_KAPPAS = (1e-2, 1e-4, 1e-6)  # m²: at the last one the barrier holds the arm a millimetre off the ends of its strokes
_SETTLED = 1e-5  # fall of the objective that is not worth another step
_MOST = 300  # iterations: a goal by a wall makes the valley of the optimum narrow and curved
_DEPENDENT = 1e-9  # least singular value over the greatest at which rows count as dependent
# The only dispatch. Of one goal: from a problem and starts inside the strokes, shape (S, n), to a solution for each start, met
# or not. Shape control makes its own starts: a solution for each curve that meets the goal.
_METHODS: dict[Method, Callable[[Problem, Array, NewtonSettings], Solution]] = {
    Method.NULLSPACE: solve,
    Method.COUPLED: solve,
    Method.ANCHORED: solve_anchored,
    Method.SHAPE: lambda problem, _starts, _settings: solve_shapes(problem),
}


def solve_by_method(name: str, problem: Problem, start: ArrayLike, settings: NewtonSettings | None = None) -> Solution:
    """Find a configuration that meets one named goal by the problem's method, starting from inputs of shape (n,).

    The solution has no batch dimension and is read-only. It is the best of the first group of starts that has any. Its
    clearance is at least that of the problem's `keep`: the objective is changed where it does not keep it. Its iterations are
    those over all starts. The coupled method needs the problem's reduction.

    Raises:
        ReachError: No start leads to the goal, or none clear of the surroundings; it holds the shortfall and what
            binds.
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.

    Source: chapters 6 to 8; see `methods` and `shape`.
    """
    how, keep = settings or NewtonSettings(most=_MOST), problem.keep
    count, near, missed = 0, [], []
    for starts in start_groups(problem, np.asarray(start, float)):
        try:
            found = _METHODS[problem.method](problem, starts, how)
        except ReachError as error:  # of a curve, which knows no goal's name
            raise ReachError(name, error.shortfall, error.binding, error.detail) from None
        count += int(np.sum(found.iterations))
        solved = _measured(found.pick(found.met), keep)
        if keep is not None:
            solved, steps = _insist(problem, solved, keep, how)
            count += steps
        clear = solved if keep is None else solved.pick(solved.clearance >= keep.clearance)
        if len(clear.q):
            best = clear.pick(int(np.argmin(clear.value)))
            best.q.flags.writeable = best.error.flags.writeable = False
            return replace(best, iterations=np.array(count))
        near.append(solved)
        missed.append(found.q[~found.met])
        if problem.method is Method.SHAPE:  # it starts from its curves, whatever the group
            break
    raise _reach_error(name, problem, near, np.concatenate(missed), how.most)


def _measured(found: Solution, keep: Keep | None) -> Solution:
    """Solutions with their clearance, where one is asked for."""
    if keep is None or not len(found.q):
        return replace(found, clearance=np.full(len(found.q), np.inf), nearest=np.full(len(found.q), "", object))
    clearance, places = keep.surroundings.clearance(found.q)
    return replace(found, clearance=clearance, nearest=np.array(places, object))


def _insist(problem: Problem, solved: Solution, keep: Keep, how: NewtonSettings) -> tuple[Solution, int]:
    """Where no solution keeps the clearance, those of an objective to which it is added; and the number of iterations."""
    steps = 0
    hinges = ClearanceHinges(keep.surroundings, keep.clearance, payload=False)
    for weight in _INSIST:
        if not len(solved.q) or np.any(solved.clearance >= keep.clearance):
            break
        harder = replace(problem, objective=WeightedSum(((1.0, problem.objective), (weight, hinges))))
        found = _METHODS[problem.method](harder, solved.q, how)
        steps += int(np.sum(found.iterations))
        solved = _measured(found.pick(found.met), keep)
    return solved, steps


def _reach_error(name: str, problem: Problem, near: list[Solution], missed: Array, most: int) -> ReachError:
    """The reason that keeps the arm from a goal: its strokes, or the bodies about it."""
    keep = problem.keep
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
    z, rows = problem.variables(start), len(problem.goal.names)
    for kappa in _KAPPAS:

        def pulled(z: Array, which: Index, kappa: float = kappa) -> Quadratic:
            at = plain.model(z, which)
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
    return problem.inputs(z), plain.model(z, np.arange(len(z))).error[:, :rows]


def solve_anywhere(
    problem: Problem, start: ArrayLike, settings: NewtonSettings | None = None, postures: PostureTable | None = None
) -> Solution:
    """Solve goals from inputs of shape (n,) or (B, n), then unmet ones from the postures nearest to them.

    Starts outside the strokes are moved inside. The table of postures is made when absent; a goal is restarted
    eight times at most. Iterations count over all restarts.

    Raises:
        GoalError: Rows contradict each other wherever the arm is, or are more than the inputs.
    """
    begin = np.asarray(start, float)
    if not np.all(inside(problem.box, np.atleast_2d(begin))):
        begin = bring_inside(problem.box, begin)
    found = solve(problem, begin, settings)
    left = np.flatnonzero(~found.met)
    if not len(left):
        return found
    _refuse_contradictions(problem, found, left)
    table = postures or make_postures(problem.box)
    for attempt in range(ATTEMPTS):
        part = replace(problem, goal=problem.goal.choose(left))
        again = solve(part, choose_postures(problem, table, left, attempt), settings)
        found.iterations[left] += again.iterations
        better = again.met | (np.linalg.norm(again.error, axis=1) < np.linalg.norm(found.error[left], axis=1))
        found.put(left[better], again, better)
        left = left[~again.met]
        if not len(left):
            break
    return found


def _refuse_contradictions(problem: Problem, found: Solution, left: Index) -> None:
    """Raise when unmet rows depend on each other at several unrelated configurations and disagree."""
    middle = problem.box.middle
    q = middle + 0.05 * np.random.default_rng(SEED).standard_normal((3, *middle.shape))
    J = evaluate(problem.chain, problem.goal, problem.chain.state(q), np.full(3, left[0]))[1]
    U, values, _ = np.linalg.svd(J)
    dependent = int(np.min(np.sum(values / values[:, :1] < _DEPENDENT, axis=1)))
    if not dependent:
        return
    names = tuple(np.array(problem.goal.names)[np.abs(U[0, :, -dependent:]).max(axis=1) > 0.1].tolist())
    gap = float(np.linalg.norm(U[0, :, -dependent:].T @ found.error[left[0]]))
    tolerance = float(np.max(problem.goal.tolerance))
    if gap > tolerance:
        detail = f"goal {int(left[0])}: rows depend on each other and disagree by {gap:.4g} (tolerance {tolerance:.1g})"
        raise GoalError(names, gap, detail)
