"""Goals of a plain problem, compiled whole: kinematics, goal rows, objective, curvature and iteration in one call.

Plain are problems of arms of double octahedra alone whose objective is a sum of functions of one length each and whose
variables are the inputs. A `Body` and the `Motion` made of it stand for `State`, and lengths for the objective's terms; all
other problems ask for them from outside, see `descent.carry_all_on`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_row
from vgtsim.kinematics import compose, curve, fill_mid_planes, pull
from vgtsim.positioning import descent
from vgtsim.positioning.descent import Point, Rules, Ways, carry_on
from vgtsim.positioning.rows import Motion, Table, curve_between, curve_within, measure_rows, measure_strokes, pull_rows

STEP = 1e-5  # of one-sided differences, in units of the inputs: errors of both kinds are near 1e-5 of the curvature
_START = 0  # phase in which a goal has no point yet


class Body(NamedTuple):
    """An arm of double octahedra alone, and its strokes.

    Attributes:
        flange, root, after, owner: See `Chain` and `Layout`.
        figures, straight: See `ModuleSet`.
        place: Of each input among those of its module, shape (n,).
        legs, columns: See `Place`.
        least, greatest: Of the lengths, shape (J,), m.
        middle: Inputs at the middle of the strokes, shape (1, n).
    """

    flange: Array
    figures: Array
    straight: Array
    root: Array
    after: Array
    owner: Index
    place: Index
    legs: Index
    columns: Index
    least: Array
    greatest: Array
    middle: Array


@compiled
def _move(body: Body, q: Array, marks: Mask, length: Array, slope: Array) -> Motion:
    """All kinematics of inputs, shape (b, n), that a goal asks for."""
    straight = body.straight
    count, (modules, inputs) = len(q), straight.shape
    frame, moved = np.empty((count, modules, 3, 4)), np.empty((count, modules, inputs, 6))
    base, nodes, node_slopes = np.empty((count, modules + 1, 3, 4)), np.empty((0, 0, 0, 3)), np.empty((0, 0, 0, 3, 0))
    x = q.reshape((count, modules, inputs))
    top, angular, linear = (
        np.empty((count, modules, 3, 4)),
        np.empty((count, q.shape[1], 3)),
        np.empty((count, q.shape[1], 3)),
    )
    fill_mid_planes(x, body.figures, straight, marks, frame, moved, length, slope, nodes, node_slopes)
    rates = moved.reshape((count, q.shape[1], 6))
    compose(body.root, body.after, body.owner, frame, rates, base, top, angular, linear)
    return body.flange, top, angular, linear


@compiled
def _evaluate(which: Index, q: Array, there: Point, table: Table, body: Body, weights: Array, meant: Array) -> None:
    """The quadratic model at inputs, shape (1, n), of one goal, see `Problem.model`.

    Weights are of stroke barrier and squares, shape (2,); meant are lengths from which squares are meant, shape (G or 1, J), m.
    """
    least, greatest, value, first = body.least, body.greatest, there.value, there.by_length
    modules, inputs = body.straight.shape
    marks = np.empty((1, modules, 4), np.bool_)
    length, block = np.empty((1, modules, 3)), np.empty((1, modules, 3, inputs))
    flat, room, second = length.reshape(first.shape), np.empty(1), np.empty(first.shape)
    motion = _move(body, q, marks, length, block)
    measure_strokes(flat, least, greatest, room, value, first, second)
    good = room[0] > 0
    for m in range(modules):
        good = good and marks[0, m, 3]
    there.inside[0] = good
    if not good:  # mid-stroke stands in for what does not assemble inside the strokes
        motion = _move(body, body.middle, marks, length, block)
        measure_strokes(flat, least, greatest, room, value, first, second)
    measure_rows(which, there.error, there.J, table, motion)
    value[0] *= weights[0]
    row = which[0] if len(meant) > 1 else 0
    for j in range(first.shape[1]):
        half = (greatest[j] - least[j]) / 2
        away = (flat[0, j] - meant[row, j]) / half
        value[0] += 0.5 * weights[1] * away * away
        first[0, j] = weights[0] * first[0, j] + weights[1] * away / half
        second[0, j] = weights[0] * second[0, j] + weights[1] / half**2
    pull(first, body.legs, body.columns, block, there.slope)
    there.curve[:] = 0.0
    curve(second, body.legs, body.columns, block, there.curve)


@compiled
def curve_rows(
    which: Index, q: Array, multipliers: Array, by_length: Array, bent: Array, table: Table, body: Body
) -> None:
    """Curvature at inputs, shape (1, n), that the model leaves out, shape (1, n, n), as `lagrangian_curvature`."""
    count, (modules, inputs) = q.shape[1], body.straight.shape
    times = inputs + 1
    moved, place = np.empty((times, count)), body.place
    for s in range(times):
        for j in range(count):
            moved[s, j] = q[0, j] + (STEP if place[j] == s - 1 else 0.0)
    marks = np.empty((times, modules, 4), np.bool_)
    length, block = np.empty((times, modules, 3)), np.empty((times, modules, 3, inputs))
    motion = _move(body, moved, marks, length, block)
    raw, slope = np.zeros(bent.shape), np.empty((times, count))
    every, weights = np.empty(times, np.intp), np.empty((times, by_length.shape[1]))
    pushes = np.empty((times, multipliers.shape[1]))
    for s in range(times):
        every[s] = which[0]
        copy_row(by_length[0], weights[s])
        copy_row(multipliers[0], pushes[s])
    bent[:] = 0.0
    curve_between(which, multipliers, body.owner, bent, raw, table, motion)
    pull(weights, body.legs, body.columns, block, slope)
    pull_rows(every, pushes, slope, table, motion)
    curve_within(slope, slope[1:].copy().reshape((inputs, 1, count)), STEP, body.owner, body.place, raw, bent)


@compiled
def pursue(which: Index, goals: Index, tables: Any, settings: Any, *kept: Any) -> None:
    """Carry some goals, shape (c,), on until they are done, or want what only others know: the way down from a saddle.

    `goals` is the goal of each way, shape (B,). Tables are goal rows, `Body`, weights and meant
    lengths, settings are `Rules`; kept are ways, points, factors and further curvature, see `descent.carry_all_on`.
    """
    rules, ways, at, factors, further = Rules(*settings), Ways(*kept[0]), Point(*kept[1]), kept[2], kept[3]
    (table, _, weights, meant), body = tables, Body(*tables[1])
    marks, z, trial, y, bent = ways.marks, ways.z, ways.trial, ways.y, further[1]
    (rows, count), size = at.J.shape[1:], at.by_length.shape[1]
    there = Point(
        inside=np.ones(1, np.bool_),
        error=np.empty((1, rows)),
        J=np.empty((1, rows, count)),
        value=np.empty(1),
        slope=np.empty((1, count)),
        curve=np.empty((1, count, count)),
        rough=np.empty((1, 0)),
        by_length=np.empty((1, size)),
    )
    one, goal = np.empty(1, np.intp), np.empty(1, np.intp)
    for i in which:
        one[0], goal[0], j = i, goals[i], i + 1
        if marks[i, descent.PHASE] == _START:
            own = Point(
                inside=at.inside[i:j],
                error=at.error[i:j],
                J=at.J[i:j],
                value=at.value[i:j],
                slope=at.slope[i:j],
                curve=at.curve[i:j],
                rough=at.rough[i:j],
                by_length=at.by_length[i:j],
            )
            _evaluate(goal, z[i:j], own, table, body, weights, meant)
            if not own.inside[0]:
                continue
        while True:
            carry_on(rules, one, there, ways, at, factors, further)
            want = marks[i, descent.WANT]
            if want == descent.BEND:
                curve_rows(goal, z[i:j], y[i:j], at.by_length[i:j], bent[i:j], table, body)
            elif want == 0 or want == descent.DOWNHILL:
                break
            else:
                _evaluate(goal, trial[i:j], there, table, body, weights, meant)
