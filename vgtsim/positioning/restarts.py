"""Goals that the present configuration does not lead to: restarts from a table of postures, nearest first."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError, GoalError
from vgtsim.kinematics.bending import bend_all, can_swing, swing
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.sampling import sample_inputs
from vgtsim.positioning.goals import Direction, GoalSpace, Orientation, Position, evaluate
from vgtsim.positioning.kernel import Kernel
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.positioning import Positioning, Positions, assembles, solve
from vgtsim.positioning.strokes import StrokeBox, bring_inside, inside

Array = NDArray[np.float64]

_SEED = 1993
_MOST_BEND = np.radians(40.0)  # of a module in the postures
_PART = 0.88  # of the strokes that postures use
_DEPENDENT = 1e-9  # least singular value over the greatest at which rows count as dependent


@dataclass(frozen=True)
class Postures:
    """Configurations inside the strokes and where they put the tool.

    Attributes:
        q: Inputs, shape (N, n).
        position: Of the tool in B_1, shape (N, 3), m.
        direction: Of the tool in B_1, shape (N, 3).
    """

    q: Array
    position: Array
    direction: Array


def make_postures(chain: Chain, box: StrokeBox, count: int = 600) -> Postures:
    """Draw postures: one half with every actuator anywhere in its stroke, one half bent smoothly.

    Args:
        chain: The arm.
        box: Lengths allowed.
        count: How many.

    Returns:
        The same table for the same arm and box.
    """
    rng = np.random.default_rng(_SEED)
    if chain.manipulator.uniform:
        q = _double_octahedral(chain, box, count, rng)
    elif len(Kernel(chain).static):  # which a bend would not leave their lengths
        q = sample_inputs(chain, count, _SEED, _PART)
    else:
        q = np.concatenate([_bent(chain, box, count // 2, rng), sample_inputs(chain, count - count // 2, _SEED, _PART)])
    position, direction = chain.tool(q)
    R = chain.mount[:3, :3]
    return Postures(q, (position - chain.mount[:3, 3]) @ R, direction @ R)


def _double_octahedral(chain: Chain, box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Postures of an arm of double octahedra, by lengths: three equal ones lean as the bend says."""
    modules = len(chain.layout.names)
    part = 0.06 + 0.88 * rng.random((count, modules, 3))
    curve = _curves(modules, count // 2, rng)
    wave = 2 * np.pi / 3 * np.arange(3)
    lean = 0.45 * (curve[..., :1] * np.cos(wave) + curve[..., 1:] * np.sin(wave))
    part[: count // 2] = np.clip(0.5 * rng.uniform(0.4, 1.4, (count // 2, 1, 1)) + lean, 0.06, 0.94)
    lengths = box.least + part.reshape(count, -1) * (box.greatest - box.least)
    return _assemble(chain, lengths)


def _curves(count: int, number: int, rng: np.random.Generator) -> Array:
    """Bends along arms of `count` modules in two planes, between -1 and 1, shape (number, count, 2)."""
    stations = np.linspace(0, 1, count)
    bend = rng.uniform(-1, 1, (number, 3, 2))
    curve = np.stack([np.interp(stations, [0, 0.5, 1], row) for pair in bend for row in pair.T])
    return curve.reshape(number, 2, -1).swapaxes(1, 2)


def _bent(chain: Chain, box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Symmetric bends of all modules, those that leave the strokes drawn towards their middle, shape (count, n)."""
    curve = _curves(len(chain.layout.names), count, rng)
    angle = _MOST_BEND * np.linalg.norm(curve, axis=-1)
    q = bend_all(chain, angle, np.arctan2(curve[..., 1], curve[..., 0]))
    good = inside(Kernel(chain), box, q)
    q[~good] = bring_inside(chain, box, q[~good])
    return q[inside(Kernel(chain), box, q)]


def solve_anywhere(
    problem: Positioning,
    start: ArrayLike,
    settings: NewtonSettings | None = None,
    postures: Postures | None = None,
    tries: int = 8,
) -> Positions:
    """Solve goals from given configurations, and those that are not met from the postures nearest to them.

    Args:
        problem: Goals, limits, objective.
        start: Inputs, shape (n,) or (B, n); moved inside the strokes where they are not.
        settings: How.
        postures: Table to restart from; made when absent.
        tries: Greatest number of restarts of a goal.

    Returns:
        The solutions; iterations count over all restarts.

    Raises:
        GoalError: Rows contradict each other wherever the arm is, or are more than the inputs.
    """
    chain, box = problem.chain, problem.box
    begin = np.asarray(start, float)
    rows = np.atleast_2d(begin)
    if not np.all(assembles(chain, box, rows)):
        begin = bring_inside(chain, box, begin)
    found = solve(problem, begin, settings)
    left = np.flatnonzero(~found.met)
    if not len(left):
        return found
    _refuse_contradictions(problem, found, left)
    table = postures or make_postures(chain, box)
    for attempt in range(tries):
        seeds = choose_postures(problem, table, left, attempt)
        part = replace(problem, goal=_choose(problem.goal, left))
        again = solve(part, seeds, settings)
        found.iterations[left] += again.iterations
        better = again.met | (np.linalg.norm(again.error, axis=1) < np.linalg.norm(found.error[left], axis=1))
        for field in fields(Positions):
            if field.name != "iterations":
                getattr(found, field.name)[left[better]] = getattr(again, field.name)[better]
        left = left[~again.met]
        if not len(left):
            break
    return found


def choose_postures(problem: Positioning, table: Postures, left: NDArray[np.intp], attempt: int) -> Array:
    """One posture for each goal, swung to it, shape (b, n)."""
    chain = problem.chain
    wanted = _tool_targets(problem.goal, chain, left)
    if wanted is None:
        return table.q[(left + 37 * attempt) % len(table.q)]
    position, direction = wanted
    out = []
    there, here = np.arctan2(position[:, 1], position[:, 0]), np.arctan2(table.position[:, 1], table.position[:, 0])
    follows = can_swing(chain)
    for p, d, angle in zip(position, direction, there, strict=True):
        turn = (angle - here) * follows
        away = _swung(table.position, turn) - p
        cost = np.sum(away**2, axis=1) + 4 * np.sum((_swung(table.direction, turn) - d) ** 2, axis=1)
        order = np.argsort(cost)[: 6 * (attempt + 1) + 24]
        swung = swing(chain, table.q[order], turn[order])
        usable = np.flatnonzero(assembles(chain, problem.box, swung))
        out.append(swung[usable[attempt]] if len(usable) > attempt else table.q[order[attempt]])
    return np.array(out)


def _tool_targets(goal: GoalSpace, chain: Chain, left: NDArray[np.intp]) -> tuple[Array, Array] | None:
    """Positions and directions wanted of the tool, in B_1, or nothing when its position is not wanted."""
    R = chain.mount[:3, :3]
    position = direction = None
    for part in _choose(goal, left).parts:
        if part.module is None and isinstance(part, Position) and part.axes == "xyz":
            position = (np.broadcast_to(part.target, (len(left), 3)) - chain.mount[:3, 3]) @ R
        elif part.module is None and isinstance(part, Direction):
            direction = np.broadcast_to(part.target, (len(left), 3)) @ R
        elif part.module is None and isinstance(part, Orientation):
            direction = np.broadcast_to(part.target[..., 2], (len(left), 3)) @ R
    if position is None:
        return None
    if direction is None:
        direction = position / np.maximum(np.linalg.norm(position, axis=1, keepdims=True), 1e-9)
    return position, direction


def _refuse_contradictions(problem: Positioning, found: Positions, left: NDArray[np.intp]) -> None:
    """Raise when unmet rows depend on each other at several unrelated configurations and disagree."""
    chain = problem.chain
    rng = np.random.default_rng(_SEED)
    q = problem.middle + 0.05 * rng.standard_normal((3, *problem.middle.shape))
    J = evaluate(chain, problem.goal, problem.kernel.state(q), np.full(3, left[0]))[1]
    U, values, _ = np.linalg.svd(J)
    ratio = values / values[:, :1]
    dependent = min(int(np.sum(row < _DEPENDENT)) for row in ratio)
    if not dependent:
        return
    error = found.error[left[0]]
    names = tuple(np.array(problem.goal.names)[np.abs(U[0, :, -dependent:]).max(axis=1) > 0.1].tolist())
    gap = float(np.linalg.norm(U[0, :, -dependent:].T @ error))
    tolerance = float(np.max(problem.goal.tolerance))
    if gap > tolerance:
        detail = f"goal {int(left[0])}: rows depend on each other and disagree by {gap:.4g} (tolerance {tolerance:.1g})"
        raise GoalError(names, gap, detail)


def _choose(goal: GoalSpace, which: NDArray[np.intp]) -> GoalSpace:
    """The goals asked for."""
    parts = []
    for part in goal.parts:
        single = part.target.ndim == (2 if isinstance(part, Orientation) else 1)
        parts.append(part if single or len(part.target) == 1 else replace(part, target=part.target[which]))
    return GoalSpace(tuple(parts))


def _assemble(chain: Chain, lengths: Array) -> Array:
    """Inputs of those lengths, shape (N, n), that assemble; a batch that fails is halved."""
    try:
        return chain.inputs_from_lengths(lengths)
    except AssemblyError:
        if len(lengths) == 1:
            return np.empty((0, *lengths.shape[1:]))
        half = len(lengths) // 2
        return np.concatenate([_assemble(chain, lengths[:half]), _assemble(chain, lengths[half:])])


def _swung(vectors: Array, angle: Array) -> Array:
    """Vectors, shape (N, 3), turned about Z."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack(
        [cos * vectors[:, 0] - sin * vectors[:, 1], sin * vectors[:, 0] + cos * vectors[:, 1], vectors[:, 2]], 1
    )
