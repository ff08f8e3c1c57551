"""Goals of a plain problem, compiled whole: kinematics, goal rows, objective, curvature and iteration in one call.

Plain are problems of arms of double octahedra alone whose objective is a sum of functions of one length each and whose
variables are the inputs. A `Body` and what `fill_mid_planes` and `compose` make of it stand for `State`, and lengths for
the objective's terms; all other problems ask for them from outside, see `descent.advance`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_row
from vgtsim.kinematics import compose, curve, fill_mid_planes, pull
from vgtsim.positioning import descent
from vgtsim.positioning.descent import carry_on
from vgtsim.positioning.rows import curve_between, curve_within, measure_rows, measure_strokes, pull_rows

# flange, figures, straight inputs, root, steps, owner, place, legs and columns: see `ModuleSet`, `Layout` and `Place`
Body = tuple[Array, Array, Array, Array, Array, Index, Index, Index, Index]
# least, greatest and middle of the box, weights of stroke barrier and squares, and lengths from which squares are meant
Lengths = tuple[Array, Array, Array, Array, Array]

STEP = 1e-5  # of one-sided differences, in units of the inputs: errors of both kinds are near 1e-5 of the curvature
_START = 0  # phase in which a goal has no point yet


@compiled
def _move(
    q: Array, marks: Mask, top: Array, angular: Array, linear: Array, length: Array, slope: Array, *body: Any
) -> None:
    """All kinematics of inputs, shape (b, n), that a goal asks for."""
    figures, straight, root, steps, owner = body[1], body[2], body[3], body[4], body[5]
    count, (modules, inputs) = len(q), straight.shape
    frame, motion = np.empty((count, modules, 3, 4)), np.empty((count, modules, inputs, 6))
    base, nodes, node_slopes = np.empty((count, modules + 1, 3, 4)), np.empty((0, 0, 0, 3)), np.empty((0, 0, 0, 3, 0))
    x = q.reshape((count, modules, inputs))
    fill_mid_planes(x, figures, straight, marks, frame, motion, length, slope, nodes, node_slopes)
    compose(root, steps, owner, frame, motion.reshape((count, q.shape[1], 6)), base, top, angular, linear)


@compiled
def _evaluate(
    which: Index,
    q: Array,
    inside: Mask,
    error: Array,
    J: Array,
    value: Array,
    slope: Array,
    whole: Array,
    first: Array,
    *tables: Any,
) -> None:
    """The quadratic model at inputs, shape (1, n), of one goal, see `Problem.model`."""
    parts, spots, axes, targets, flange, figures, straight, root, steps, owner, _, legs, columns = tables[:13]
    least, greatest, middle, weights, meant = tables[13:]
    count, (modules, inputs) = q.shape[1], straight.shape
    marks, top = np.empty((1, modules, 4), np.bool_), np.empty((1, modules, 3, 4))
    angular, linear = np.empty((1, count, 3)), np.empty((1, count, 3))
    length, block = np.empty((1, modules, 3)), np.empty((1, modules, 3, inputs))
    flat, room, second = length.reshape(first.shape), np.empty(1), np.empty(first.shape)
    for attempt in range(2):  # mid-stroke stands in for what does not assemble inside the strokes
        at = q if attempt == 0 else middle
        _move(at, marks, top, angular, linear, length, block, flange, figures, straight, root, steps, owner)
        measure_strokes(flat, least, greatest, room, value, first, second)
        good = room[0] > 0
        for m in range(modules):
            good = good and marks[0, m, 3]
        if attempt == 0:
            inside[0] = good
        if good:
            break
    measure_rows(which, error, J, parts, spots, axes, targets, flange, top, angular, linear)
    value[0] *= weights[0]
    row = which[0] if len(meant) > 1 else 0
    for j in range(first.shape[1]):
        half = (greatest[j] - least[j]) / 2
        away = (flat[0, j] - meant[row, j]) / half
        value[0] += 0.5 * weights[1] * away * away
        first[0, j] = weights[0] * first[0, j] + weights[1] * away / half
        second[0, j] = weights[0] * second[0, j] + weights[1] / half**2
    pull(first, legs, columns, block, slope)
    whole[:] = 0.0
    curve(second, legs, columns, block, whole)


@compiled
def curve_rows(which: Index, q: Array, multipliers: Array, by_length: Array, bent: Array, *tables: Any) -> None:
    """Curvature at inputs, shape (1, n), that the model leaves out, shape (1, n, n), as `lagrangian_curvature`."""
    parts, spots, axes, targets, flange, figures, straight, root, steps, owner, place, legs, columns = tables[:13]
    count, (modules, inputs) = q.shape[1], straight.shape
    times = inputs + 1
    moved = np.empty((times, count))
    for s in range(times):
        for j in range(count):
            moved[s, j] = q[0, j] + (STEP if place[j] == s - 1 else 0.0)
    marks, top = np.empty((times, modules, 4), np.bool_), np.empty((times, modules, 3, 4))
    angular, linear = np.empty((times, count, 3)), np.empty((times, count, 3))
    length, block = np.empty((times, modules, 3)), np.empty((times, modules, 3, inputs))
    _move(moved, marks, top, angular, linear, length, block, flange, figures, straight, root, steps, owner)
    raw, slope = np.zeros(bent.shape), np.empty((times, count))
    every, weights = np.empty(times, np.intp), np.empty((times, by_length.shape[1]))
    pushes = np.empty((times, multipliers.shape[1]))
    for s in range(times):
        every[s] = which[0]
        copy_row(by_length[0], weights[s])
        copy_row(multipliers[0], pushes[s])
    bent[:] = 0.0
    curve_between(which, multipliers, owner, bent, raw, parts, spots, axes, targets, flange, top, angular, linear)
    pull(weights, legs, columns, block, slope)
    pull_rows(every, pushes, slope, parts, spots, axes, targets, flange, top, angular, linear)
    curve_within(slope, slope[1:].copy().reshape((inputs, 1, count)), STEP, owner, place, raw, bent)


@compiled
def pursue(how: Array, tolerance: Array, which: Index, goals: Index, *tables: Any) -> None:
    """Carry some goals, shape (c,), on until they are done, or want what only others know: the way down from a saddle.

    `goals` is the goal of each way, shape (B,). The tables are those of `advance` without `there`, then of goal rows,
    the `Body` and the `Lengths`; given one by one.
    """
    ways, at, factors, further, rest = tables[:7], tables[7:15], tables[15:18], tables[18:20], tables[20:]
    marks, z, trial, y = ways[0], ways[2], ways[3], ways[6]
    (rows, count), size = at[2].shape[1:], at[7].shape[1]
    inside, error, J, value = np.ones(1, np.bool_), np.empty((1, rows)), np.empty((1, rows, count)), np.empty(1)
    slope, whole = np.empty((1, count)), np.empty((1, count, count))
    rough, first = np.empty((1, 0)), np.empty((1, size))
    there = inside, error, J, value, slope, whole, rough, first
    one, goal = np.empty(1, np.intp), np.empty(1, np.intp)
    for i in which:
        one[0], goal[0] = i, goals[i]
        if marks[i, descent.PHASE] == _START:
            j = i + 1
            _evaluate(
                goal, z[i:j], at[0][i:j], at[1][i:j], at[2][i:j], at[3][i:j], at[4][i:j], at[5][i:j], at[7][i:j], *rest
            )
            if not at[0][i]:
                continue
        while True:
            carry_on(how, tolerance, one, there, ways, at, factors, further)
            want = marks[i, descent.WANT]
            if want == descent.BEND:
                curve_rows(goal, z[i : i + 1], y[i : i + 1], at[7][i : i + 1], further[1][i : i + 1], *rest)
            elif want == 0 or want == descent.DOWNHILL:
                break
            else:
                _evaluate(goal, trial[i : i + 1], inside, error, J, value, slope, whole, first, *rest)
