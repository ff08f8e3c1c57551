"""One goal by one of the dissertation's methods, from several configurations at once: the only dispatch."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.redundancy import Method
from vgtsim.positioning.anchoring import anchor_successively
from vgtsim.positioning.goals import Direction, GoalSpace, Position
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.positioning import Positioning, Positions, solve
from vgtsim.positioning.shape import solve_shapes
from vgtsim.positioning.strokes import bring_inside, room

Array = NDArray[np.float64]

_FREE = 3  # modules free at a time in successive anchoring

Notes = dict[str, str | float | int]


@dataclass(frozen=True)
class Resolved:
    """Configurations found for one goal.

    Attributes:
        positions: One for each start; by shape control one for each curve, the least objective first.
        notes: What the method has to say of itself, by name, for each.
    """

    positions: Positions
    notes: tuple[Notes, ...]


def resolve(problem: Positioning, method: Method, starts: Array, settings: NewtonSettings) -> Resolved:
    """Solve one goal by one method.

    Args:
        problem: One tool goal, strokes, objective; for the coupled method with its reduction.
        method: How redundancy is resolved.
        starts: Inputs inside the strokes, shape (S, n); shape control makes its own.
        settings: Of the iteration.

    Returns:
        The configurations, met or not.

    Raises:
        GoalError: There are more goal rows than inputs.
        ObjectiveError: The objective is not finite.
        ReachError: Shape control finds no curve.

    Source: chapters 6, 7.2, 7.3 and 7.4.
    """
    if method is Method.SHAPE:
        return _by_shape(problem)
    if method is Method.ANCHORED:
        return _by_anchoring(problem, starts, settings)
    return Resolved(solve(_repeated(problem, len(starts)), starts, settings), ({},) * len(starts))


def bring_starts_inside(problem: Positioning, starts: Array) -> Array:
    """Make starts of configurations that may be outside the strokes, or not be coupled as they must.

    Args:
        problem: Gives strokes and order reduction.
        starts: Inputs, shape (S, n).

    Returns:
        Inputs inside the strokes that the order reduction allows, shape (S, n).
    """
    inside = bring_inside(problem.chain, problem.box, starts)
    if problem.reduction is None:
        return inside
    z, middle = problem.variables(inside), problem.variables(problem.middle)
    part = np.linspace(1.0, 0.0, 21)[:, None, None]
    trials = problem.inputs(middle + part * (z - middle))
    spare = np.min(room(problem.kernel, problem.box, trials.reshape(-1, *inside.shape[1:])), axis=1)
    good = (spare > 0.02 * np.min(problem.box.greatest - problem.box.least)).reshape(trials.shape[:2])
    return trials[np.argmax(good, axis=0), np.arange(len(inside))]


def _by_anchoring(problem: Positioning, starts: Array, settings: NewtonSettings) -> Resolved:
    """Successive anchoring from each start that leads to the goal (section 7.2.1)."""
    found = solve(_repeated(problem, len(starts)), starts, replace(settings, optimality=np.inf))
    notes: list[Notes] = []
    for i, met in enumerate(found.met):
        if not met:
            notes.append({"stages": 0})
            continue
        cycle = anchor_successively(problem, found.q[i], min(_FREE, len(problem.chain.layout.names)), settings)
        notes.append({"stages": cycle.stages})
        for field in fields(Positions):
            getattr(found, field.name)[i] = getattr(cycle.solution, field.name)[0]
    return Resolved(found, tuple(notes))


def _by_shape(problem: Positioning) -> Resolved:
    place, along = problem.goal.parts
    assert isinstance(place, Position) and isinstance(along, Direction)  # noqa: PT018  # a tool goal's
    shapes = solve_shapes(problem.chain, problem.box, place.target, along.target, problem.objective)
    joined = {f.name: np.concatenate([getattr(item.solution, f.name) for item in shapes]) for f in fields(Positions)}
    joined["value"] = np.array([item.value for item in shapes])
    notes: list[Notes] = [
        {"tangent magnitudes, m": str(np.round(item.magnitudes, 3)), "fit beyond strokes, m": item.overrun}
        for item in shapes
    ]
    return Resolved(Positions(**joined), tuple(notes))


def _repeated(problem: Positioning, count: int) -> Positioning:
    """The same goal several times."""
    parts = tuple(replace(part, target=np.repeat(part.target[None], count, axis=0)) for part in problem.goal.parts)
    return replace(problem, goal=GoalSpace(parts))
