"""Goal rows, compiled: errors, Jacobians, and what multipliers of the rows say about slope and curvature.

A table holds P groups of rows: kind, source of the face (0 for the mount, a + 1 for the top of active module a), number
of the first inputs that move it, first row, and number of rows, shape (P, 5); the face's frame in its source and the
goal's point in the face, shape (P, 3, 5), m; coordinates that count, shape (P, 3); targets, shape (P, G, 3, 3).
Functions take a table and `State.motion`.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_row
from vgtsim.kinematics import cross_into, find_across

Table = tuple[Index, Array, Index, Array]
Motion = tuple[Array, Array, Array, Array]

POSITION, DIRECTION, TURN = range(3)
_OPPOSITE = 1e-6  # least 1 + cosine of an angle that is divided by: at half a turn the rows have no direction


@compiled
def _find_face(source: int, spot: Array, mount: Array, top: Array, face: Array) -> None:
    """Rotation, origin and goal's point of a face in G, shape (3, 5)."""
    T = top[source - 1] if source else mount
    for k in range(3):
        for j in range(5):
            face[k, j] = T[k, 0] * spot[0, j] + T[k, 1] * spot[1, j] + T[k, 2] * spot[2, j]
        face[k, 3] += T[k, 3]
        face[k, 4] += T[k, 3]


@compiled
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def fill_across(targets: Array) -> None:
    """Two unit vectors across each direction, the first row of a target, shape (G, 3, 3), into its other rows."""
    for target in targets:
        find_across(target[0], target[1])
        cross_into(target[0], target[1], target[2])


@compiled
def measure_rows(which: Index, error: Array, J: Array, table: Table, motion: Motion) -> None:
    """Errors, shape (b, m), and Jacobians, shape (b, m, n), of goals, shape (b,); an empty Jacobian is not asked for.

    Errors are a distance along each axis, m; for a direction twice the part of the normal across the target over 1 + the
    cosine; for a turn twice its Gibbs vector, 2 tan(theta / 2) about the axis of the turn from the target.
    """
    parts, spots, axes, targets = table
    mount, top, angular, linear = motion
    face, levers = np.empty((3, 5)), np.empty((3, 3))
    Z, arm, gibbs = np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(error)):
        for p in range(len(parts)):
            kind, source, inputs, row, rows = parts[p]
            _find_face(source, spots[p], mount, top[i], face)
            target = targets[p, which[i] if targets.shape[1] > 1 else 0]
            if kind == POSITION:
                for r in range(rows):
                    error[i, row + r] = face[axes[p, r], 4] - target[0, axes[p, r]]
            elif kind == DIRECTION:
                copy_row(face[:, 2], Z)
                along = max(1 + _dot(Z, target[0]), _OPPOSITE)
                for r in range(2):
                    error[i, row + r] = 2 * _dot(target[1 + r], Z) / along
                    for k in range(3):
                        arm[k] = (2 * target[1 + r, k] - error[i, row + r] * target[0, k]) / along
                    # rate of the direction is omega x direction, so its part along a row is omega . (direction x row)
                    cross_into(Z, arm, levers[r])
            else:
                for k in range(3):
                    for j in range(3):
                        levers[k, j] = _dot(face[k, :3], target[j])
                scale = max(1 + levers[0, 0] + levers[1, 1] + levers[2, 2], _OPPOSITE)
                gibbs[0], gibbs[1] = (levers[2, 1] - levers[1, 2]) / scale, (levers[0, 2] - levers[2, 0]) / scale
                gibbs[2] = (levers[1, 0] - levers[0, 1]) / scale
                for r in range(3):
                    error[i, row + r] = 2 * gibbs[r]
            for j in range(J.shape[2]):
                if j >= inputs:
                    J[i, row : row + rows, j] = 0.0
                elif kind == POSITION:
                    cross_into(angular[i, j], face[:, 4], arm)
                    for r in range(rows):
                        J[i, row + r, j] = linear[i, j, axes[p, r]] + arm[axes[p, r]]
                elif kind == DIRECTION:
                    for r in range(2):
                        J[i, row + r, j] = _dot(levers[r], angular[i, j])
                else:
                    cross_into(gibbs, angular[i, j], arm)
                    share = _dot(gibbs, angular[i, j])
                    for r in range(3):
                        J[i, row + r, j] = angular[i, j, r] + share * gibbs[r] - arm[r]


@compiled
def _find_forms(
    kind: int, axes: Index, target: Array, multipliers: Array, force: Array, bend: Array, moment: Array
) -> None:
    """Multipliers of rows that are met as forms on the velocity of the point, the rate of the normal and the turn."""
    force[:], bend[:], moment[:] = 0.0, 0.0, 0.0
    for r in range(len(multipliers)):
        if kind == POSITION:
            force[axes[r]] = multipliers[r]
        elif kind == DIRECTION:
            for k in range(3):
                bend[k] += multipliers[r] * target[1 + r, k]
        else:
            moment[r] = multipliers[r]


@compiled
def pull_rows(which: Index, multipliers: Array, slope: Array, table: Table, motion: Motion) -> None:
    """Add the slope by the inputs of the rows weighted with multipliers, shape (b, m), to shape (b, n)."""
    parts, spots, axes, targets = table
    mount, top, angular, linear = motion
    face, force, bend, moment, arm = np.empty((3, 5)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(slope)):
        for p in range(len(parts)):
            kind, source, inputs, row, rows = parts[p]
            _find_face(source, spots[p], mount, top[i], face)
            target = targets[p, which[i] if targets.shape[1] > 1 else 0]
            _find_forms(kind, axes[p], target, multipliers[i, row : row + rows], force, bend, moment)
            cross_into(face[:, 4], force, arm)  # moments about the origin of G
            moment += arm
            cross_into(face[:, 2], bend, arm)
            moment += arm
            for j in range(inputs):
                slope[i, j] += _dot(linear[i, j], force) + _dot(angular[i, j], moment)


@compiled
def curve_between(
    which: Index, multipliers: Array, owner: Index, total: Array, raw: Array, table: Table, motion: Motion
) -> None:
    """Add the curvature between modules of the rows weighted with multipliers, shape (b, m), to shape (b, n, n).

    An input i nearer the base turns the velocity v_j of an input j farther out, so it is omega_i x v_j. `raw` is what the
    first derivatives of `pull_rows` change by; of a turn's rows they are not symmetric.
    """
    parts, spots, axes, targets = table
    mount, top, angular, linear = motion
    n = len(owner)
    face, force, bend, moment = np.empty((3, 5)), np.empty(3), np.empty(3), np.empty(3)
    velocity, turning, arm = np.empty((n, 3)), np.empty((n, 3)), np.empty(3)
    for i in range(len(total)):
        for p in range(len(parts)):
            kind, source, inputs, row, rows = parts[p]
            _find_face(source, spots[p], mount, top[i], face)
            target = targets[p, which[i] if targets.shape[1] > 1 else 0]
            _find_forms(kind, axes[p], target, multipliers[i, row : row + rows], force, bend, moment)
            for j in range(inputs):
                cross_into(angular[i, j], face[:, 4], velocity[j])
                for k in range(3):
                    velocity[j, k] += linear[i, j, k]
                cross_into(angular[i, j], face[:, 2], turning[j])
            for a in range(inputs):
                for b in range(a + 1, inputs):
                    if owner[a] == owner[b]:
                        continue
                    if kind == POSITION:
                        cross_into(force, angular[i, a], arm)
                        found = _dot(arm, velocity[b])
                    elif kind == DIRECTION:
                        cross_into(bend, angular[i, a], arm)
                        found = _dot(arm, turning[b])
                    else:
                        cross_into(moment, angular[i, a], arm)
                        found = _dot(arm, angular[i, b])
                    half = found / 2 if kind == TURN else found  # of a turn's rows the halves cancel
                    total[i, a, b] += half
                    total[i, b, a] += half
                    raw[i, a, b] += found
                    if kind != TURN:
                        raw[i, b, a] += found


@compiled
def curve_within(
    first: Array, moved: Array, shift: float, owner: Index, place: Index, raw: Array, total: Array
) -> None:
    """Add the curvature within modules by differences of slopes: `moved`, shape (s, b, n), after all modules' inputs s moved.

    `place` is the place of each input among those of its module, shape (n,); the sum is made symmetric.
    """
    n = len(owner)
    for i in range(len(total)):
        for s in range(len(moved)):
            for j in range(n):
                change = (moved[s, i, j] - first[i, j]) / shift
                row = -1
                for k in range(n):
                    if place[k] == s:
                        change -= raw[i, k, j]
                        if owner[k] == owner[j]:
                            row = k
                if row >= 0:
                    total[i, row, j] += change
        for j in range(n):
            for k in range(j):
                total[i, j, k] = total[i, k, j] = (total[i, j, k] + total[i, k, j]) / 2


@compiled
def measure_strokes(
    length: Array, least: Array, greatest: Array, room: Array, value: Array, first: Array, second: Array
) -> None:
    """Least spare stroke, shape (b,), and the stroke barrier with its derivatives by the lengths, shape (b, J)."""
    for i in range(len(room)):
        room[i], value[i] = np.inf, 0.0
        for j in range(len(least)):
            below, above = length[i, j] - least[j], greatest[j] - length[i, j]
            room[i] = min(room[i], below, above)
            value[i] -= np.log(4 * below * above / (greatest[j] - least[j]) ** 2)
            first[i, j] = 1 / above - 1 / below
            second[i, j] = 1 / (above * above) + 1 / (below * below)
