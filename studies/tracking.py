"""Paths of goals: solved one after the other from each other, or all at once by dynamic programming."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import ReachError, VgtError
from vgtsim.positioning import (
    Configurations,
    Nearness,
    Problem,
    StrokeBarrier,
    WeightedSum,
    binding_actuators,
    solve,
    tool_goal,
)

Array = NDArray[np.float64]

_STEADY = 0.1  # weight of staying near the last configuration beside the objective


class RateError(VgtError):
    """A path of goals needs more of an actuator than it can do between two goals.

    `point` is the index of the second of these goals, `motion` the needed change of the actuator's length at the best
    posture, and `limit` the allowed change, m.
    """

    def __init__(self, point: int, motion: float, limit: float) -> None:
        self.point, self.motion, self.limit = point, motion, limit
        super().__init__(f"to point {point} an actuator would move {motion:.4g} m; allowed {limit:.4g} m")


@dataclass(frozen=True)
class Tracked:
    """A path of configurations.

    Attributes:
        q: Inputs at every goal, shape (K, n).
        lengths: Of the actuators, shape (K, J), m.
        cost: Sum of the objective over the goals and of the squared motion between them.
        iterations: At every goal, shape (K,); zeros where they were not counted.
    """

    q: Array
    lengths: Array
    cost: float
    iterations: NDArray[np.intp]


def track(problem: Problem, positions: ArrayLike, directions: ArrayLike, start: ArrayLike, most: float) -> Tracked:
    """Solve the goals of a path one after the other, each from the last.

    Args:
        problem: Arm, strokes and objective; its goal is replaced.
        positions: Tool points, shape (K, 3), m.
        directions: Tool directions, shape (K, 3) or (3,).
        start: Configuration from which the first goal is met, shape (n,).
        most: Greatest change of an actuator between two goals, m: its rate times the time between them.

    Returns:
        The path.

    Raises:
        ReachError: A goal is not met.
        RateError: An actuator would have to be faster.
    """
    at = np.asarray(positions, float)
    along = np.broadcast_to(np.asarray(directions, float), at.shape)
    q, counts = [], []
    here = np.asarray(start, float)
    for k in range(len(at)):
        objective = problem.objective
        if k:
            steady = Nearness(problem.chain.lengths(here))
            objective = WeightedSum(((1.0, objective), (_weight(problem, most), steady)))
        goal = tool_goal(at[k], along[k])
        found = solve(replace(problem, goal=goal, objective=objective), here)
        if not found.met[0]:  # a long step held back by nearness: the goal comes first
            found = solve(replace(problem, goal=goal, objective=StrokeBarrier()), here)
        if not found.met[0]:
            shortfall = float(np.linalg.norm(found.error[0, :3]))
            raise ReachError(f"point {k}", shortfall, binding_actuators(problem.box, found.q[0]))
        motion = float(np.abs(problem.chain.lengths(found.q[0]) - problem.chain.lengths(here)).max())
        if k and motion > most:
            raise RateError(k, motion, most)
        here = found.q[0]
        q.append(here)
        counts.append(found.iterations[0])
    return _finish(problem, np.array(q), np.array(counts), most)


def sheets(problem: Problem, positions: ArrayLike, directions: ArrayLike, seeds: ArrayLike) -> Array:
    """Candidate paths: each seed carried along the goals by the least motion, and the local optimum beside it.

    Args:
        problem: Arm, strokes and objective; its goal is replaced.
        positions: Tool points, shape (K, 3), m.
        directions: Tool directions, shape (K, 3) or (3,).
        seeds: Configurations to begin with, shape (C, n).

    Returns:
        Shape (K, 2 C, n); NaN where a goal is not met.
    """
    at = np.asarray(positions, float)
    along = np.broadcast_to(np.asarray(directions, float), at.shape)
    here, layers = np.array(seeds, float), []
    for point, direction in zip(at, along, strict=True):
        goal = tool_goal(np.tile(point, (len(here), 1)), np.tile(direction, (len(here), 1)))
        carried = solve(replace(problem, goal=goal, objective=Nearness(problem.chain.lengths(here))), here)
        best = solve(replace(problem, goal=goal), carried.q)
        met = np.concatenate([carried.met, best.met])
        layers.append(np.where(met[:, None], np.concatenate([carried.q, best.q]), np.nan))
        here = np.where(carried.met[:, None], carried.q, here)
    return np.array(layers)


def resolve_globally(problem: Problem, candidates: ArrayLike, most: float) -> Tracked:
    """Choose one candidate at every goal so that the whole path costs least.

    Args:
        problem: Arm, strokes and objective.
        candidates: Configurations that meet the goals, shape (K, C, n); NaN where there is none.
        most: Greatest change of an actuator between two goals, m.

    Returns:
        The path; no path through these candidates costs less.

    Raises:
        RateError: No path through the candidates keeps the actuators slow enough.

    Source: R. Bellman's dynamic programming; chapter 9 of the dissertation leaves global resolution to future work.
    """
    layers = np.asarray(candidates, float)
    known = ~np.isnan(layers[:, :, 0])
    safe = np.where(known[..., None], layers, problem.chain.straight)
    lengths, values = problem.chain.lengths(safe), np.stack([_values(problem, layer) for layer in safe])
    values = np.where(known, values, np.inf)
    total, back = values[0], []
    for k in range(1, len(layers)):
        way = lengths[k][None] - lengths[k - 1][:, None]
        move = _motion(way, most)
        move = np.where(np.abs(way).max(axis=2) <= most, move, np.inf)
        through = total[:, None] + move
        back.append(np.argmin(through, axis=0))
        total = np.min(through, axis=0) + values[k]
        if not np.any(np.isfinite(total)):
            raise RateError(k, float(np.abs(way[np.ix_(known[k - 1], known[k])]).max(axis=2).min(initial=np.inf)), most)
    chosen = [int(np.argmin(total))]
    for step in reversed(back):
        chosen.append(int(step[chosen[-1]]))
    q = np.array([layer[c] for layer, c in zip(safe, reversed(chosen), strict=True)])
    return _finish(problem, q, np.zeros(len(q), int), most)


def _weight(problem: Problem, most: float) -> float:
    """Weight of `Nearness` that makes it the cost of motion for the mean stroke."""
    half = float(np.mean(problem.box.greatest - problem.box.least)) / 2
    return 2 * _STEADY * (half / most) ** 2


def _motion(way: Array, most: float) -> Array:
    """Cost of changes of length, shape (...), of shape (..., J), m: `_STEADY` for one at its most."""
    return _STEADY * np.sum((way / most) ** 2, axis=-1)


def _values(problem: Problem, q: Array) -> Array:
    """Objective with its barrier, shape (b,), of inputs of shape (b, n)."""
    at = Configurations(problem.box, problem.chain.state(q), np.zeros(len(q), int))
    return problem.guarded.values(at)


def _finish(problem: Problem, q: Array, iterations: NDArray[np.intp], most: float) -> Tracked:
    lengths = problem.chain.lengths(q)
    way = np.diff(lengths, axis=0)
    cost = float(np.sum(_values(problem, q)) + np.sum(_motion(way, most)))
    return Tracked(q, lengths, cost, iterations)
