"""Where to look for a goal from: the arm swung about its mast, bend patterns, and postures that come near the goal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.errors import AssemblyError
from vgtsim.kinematics import Chain, azimuth, bend_all, can_swing, sample_inputs, swing
from vgtsim.positioning.goals import Direction, GoalSpace, Orientation, Position
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.strokes import StrokeBox, bring_inside, inside, spare_strokes

# Bend of the modules from the mast to the tool, in degrees, at five stations along the arm.
_BENDS = (
    (35.0, 30.0, 15.0, 5.0, 0.0),
    (30.0, 15.0, 0.0, 10.0, 35.0),
    (40.0, 38.0, 25.0, -20.0, -35.0),
    (20.0, 30.0, 30.0, 30.0, 30.0),
)
ATTEMPTS = 8  # postures of the table that are tried for a goal when all else has failed
_WAY = 21  # steps of the way to mid-stroke that are tried for coupled starts
_SPARE = 0.02  # part of the shortest stroke that coupled starts keep from its ends
_TURN = 4.0  # m²: weight of a squared difference of directions beside that of positions in the choice of postures
_STRIDE = 37  # between the postures that one goal tries without a position: no divisor of the table's size
SEED = 1993  # of all that is drawn
_COUNT = 600  # postures of a table: enough that one comes near most goals
_MOST_BEND = np.radians(40.0)  # of a module in the postures
_PART = 0.88  # of the strokes that postures use: ends are left for what a goal asks


def likely_starts(chain: Chain, start: Array, target: Array) -> Array:
    """Inputs, shape (S, n), from which to look for a tool position in G, shape (3,), m.

    First come the present ones swung to the target's azimuth, then the present ones, then bends in the plane of the
    target. Some may be outside the strokes.
    """
    there = azimuth(chain, target)
    patterns = bend_all(chain, pattern_bends(len(chain.layout.names)), there)
    return np.array([swing(chain, start, there - azimuth(chain, chain.tool(start)[0])), start, *patterns])


def pattern_bends(count: int) -> Array:
    """Angles of bend patterns, shape (P, A), rad, for an arm of a number of active modules."""
    stations, marks = np.linspace(0, 1, count), np.linspace(0, 1, 5)
    part = min(1.0, len(marks) / count)  # more modules need less each
    return np.array([part * np.radians(np.interp(stations, marks, bends)) for bends in _BENDS])


def start_groups(problem: Problem, start: Array) -> Iterator[Array]:
    """Starts for one goal inside the strokes, shape (S, n): the likely one, the others, postures near the goal."""
    likely = likely_starts(problem.chain, start, np.asarray(problem.goal.groups[0].target, float))
    yield bring_starts_inside(problem, likely[:1])
    yield bring_starts_inside(problem, likely[1:])
    table, first = make_postures(problem.box), np.zeros(1, int)
    postures = np.concatenate([choose_postures(problem, table, first, attempt) for attempt in range(ATTEMPTS)])
    yield bring_starts_inside(problem, postures)


def bring_starts_inside(problem: Problem, starts: Array) -> Array:
    """Make starts, shape (S, n), of configurations that may be outside the strokes, or not be coupled as they must."""
    brought = bring_inside(problem.box, starts)
    if problem.reduction is None:
        return brought
    z, middle = problem.variables(brought), problem.variables(problem.box.middle)
    part = np.linspace(1.0, 0.0, _WAY)[:, None, None]
    trials = problem.inputs(middle + part * (z - middle))
    spare = np.min(spare_strokes(problem.box, trials.reshape(-1, brought.shape[1])), axis=1)
    good = (spare > _SPARE * np.min(problem.box.greatest - problem.box.least)).reshape(trials.shape[:2])
    return trials[np.argmax(good, axis=0), np.arange(len(brought))]


def choose_postures(problem: Problem, table: PostureTable, left: Index, attempt: int) -> Array:
    """One posture for each goal, swung to it, shape (b, n)."""
    chain = problem.chain
    wanted = _tool_targets(problem.goal.choose(left), chain, len(left))
    if wanted is None:
        return table.q[(left + _STRIDE * attempt) % len(table.q)]
    (position, direction), out = wanted, []
    there, here = np.arctan2(position[:, 1], position[:, 0]), np.arctan2(table.position[:, 1], table.position[:, 0])
    follows = can_swing(chain)
    for p, d, angle in zip(position, direction, there, strict=True):
        turn = (angle - here) * follows
        away = _swung(table.position, turn) - p
        cost = np.sum(away**2, axis=1) + _TURN * np.sum((_swung(table.direction, turn) - d) ** 2, axis=1)
        order = np.argsort(cost)[: 6 * (attempt + 1) + 24]  # some of them leave the strokes when they are swung
        swung = swing(chain, table.q[order], turn[order])
        usable = np.flatnonzero(inside(problem.box, swung))
        out.append(swung[usable[attempt]] if len(usable) > attempt else table.q[order[attempt]])
    return np.array(out)


def _tool_targets(goal: GoalSpace, chain: Chain, count: int) -> tuple[Array, Array] | None:
    """Positions and directions wanted of the tool, in B_1, or nothing when its position is not wanted."""
    R = chain.mount[:3, :3]
    position = direction = None
    for part in goal.groups:
        if part.module is None and isinstance(part, Position) and part.axes == "xyz":
            position = (np.broadcast_to(part.target, (count, 3)) - chain.mount[:3, 3]) @ R
        elif part.module is None and isinstance(part, Direction):
            direction = np.broadcast_to(part.target, (count, 3)) @ R
        elif part.module is None and isinstance(part, Orientation):
            direction = np.broadcast_to(part.target[..., 2], (count, 3)) @ R
    if position is None:
        return None
    if direction is None:
        direction = position / np.maximum(np.linalg.norm(position, axis=1, keepdims=True), 1e-9)
    return position, direction


def _swung(vectors: Array, angle: Array) -> Array:
    """Vectors, shape (N, 3), turned about Z."""
    (x, y, z), cos, sin = vectors.T, np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], 1)


@dataclass(frozen=True)
class PostureTable:
    """N inputs inside the strokes, shape (N, n), with tool positions, m, and directions in B_1, shape (N, 3)."""

    q: Array
    position: Array
    direction: Array


def make_postures(box: StrokeBox, count: int = _COUNT) -> PostureTable:
    """Draw a number of postures: one half with every actuator anywhere in its stroke, one half bent smoothly."""
    rng, chain = np.random.default_rng(SEED), box.chain
    if chain.leans:
        q = _drawn(box, count, rng)
    elif len(box.chain.layout.static):  # a bend would not leave static legs their lengths
        q = sample_inputs(chain, count, SEED, _PART)
    else:
        q = np.concatenate([_bent(box, count // 2, rng), sample_inputs(chain, count - count // 2, SEED, _PART)])
    position, direction = chain.tool(q)
    R = chain.mount[:3, :3]
    return PostureTable(q, (position - chain.mount[:3, 3]) @ R, direction @ R)


def _drawn(box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Postures of modules that lean, by their three lengths: one half drawn anywhere, one half bent smoothly."""
    modules, low = len(box.chain.layout.names), (1 - _PART) / 2
    part = low + _PART * rng.random((count, modules, 3))
    curve = _curves(modules, count // 2, rng)
    wave = 2 * np.pi / 3 * np.arange(3)
    lean = 0.45 * (curve[..., :1] * np.cos(wave) + curve[..., 1:] * np.sin(wave))
    part[: count // 2] = np.clip(0.5 * rng.uniform(0.4, 1.4, (count // 2, 1, 1)) + lean, low, 1 - low)
    return _assemble(box.chain, box.least + part.reshape(count, -1) * (box.greatest - box.least))


def _curves(count: int, number: int, rng: np.random.Generator) -> Array:
    """Bends along arms of `count` modules in two planes, between -1 and 1, shape (number, count, 2)."""
    stations = np.linspace(0, 1, count)
    bend = rng.uniform(-1, 1, (number, 3, 2))
    curve = np.stack([np.interp(stations, [0, 0.5, 1], row) for pair in bend for row in pair.T])
    return curve.reshape(number, 2, -1).swapaxes(1, 2)


def _bent(box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Symmetric bends of all modules, those that leave the strokes drawn towards their middle, shape (count, n)."""
    curve = _curves(len(box.chain.layout.names), count, rng)
    angle = _MOST_BEND * np.linalg.norm(curve, axis=-1)
    q = bend_all(box.chain, angle, np.arctan2(curve[..., 1], curve[..., 0]))
    good = inside(box, q)
    q[~good] = bring_inside(box, q[~good])
    return q[inside(box, q)]


def _assemble(chain: Chain, lengths: Array) -> Array:
    """Inputs of those lengths, shape (N, n), that assemble; a batch that fails is halved."""
    try:
        return chain.inputs_from_lengths(lengths)
    except AssemblyError:
        if len(lengths) == 1:
            return np.empty((0, chain.layout.inputs))
        half = len(lengths) // 2
        return np.concatenate([_assemble(chain, lengths[:half]), _assemble(chain, lengths[half:])])
