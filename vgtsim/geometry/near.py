"""Pairs of bodies that are near each other, compiled: an arm's with all that it must keep clear of, for a solver and a planner.

Positions, walls and what they are made of are as in `gaps`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.geometry.blocks import to_block
from vgtsim.geometry.gaps import (
    BED,
    OWN,
    PILLAR,
    SOLID,
    TANK,
    WASTE,
    Walls,
    are_beside,
    enclose,
    is_beside_line,
    lead_inward,
    wrap_members,
    wrap_modules,
)
from vgtsim.geometry.pairs import MemberPairs
from vgtsim.geometry.segments import TOUCHING, find_between
from vgtsim.geometry.side_mouth import hypot
from vgtsim.geometry.surface import along_surface, is_above, to_surface

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]


@compiled
def find_near(
    tank: Walls,
    pairs: MemberPairs,
    meets: Mask,
    point_radii: Array,
    points: Array,
    reach: float,
    payload: bool,
    config: Index,
    gaps: Array,
    bodies: Index,
    held: Index,
    slopes: Array,
) -> int:
    """Pairs of bodies nearer than a reach, configuration by configuration; returns their number, however few fit in.

    Where no room is given for any, it ends soon after the first.

    Args:
        meets: Which members may meet which obstacle, shape (K, M); obstacles are cylinders. The last member is the payload.
        point_radii: Of a ball about each point, shape (N + 1,).
        points: Shape (W, N + 1, 3); the first three do not move.
        payload: Whether the payload's distance from all but the arm counts.
        config: Configuration of each pair, shape (R,), and its gap, shape (R,).
        bodies: Of each pair, shape (R, 3): its kind, such as `TANK`, then a point or member, then what it is near.
        held: Points on which the gap depends, shape (R, 4), -1 for none, and its slopes by them, shape (R, 4, 3).
    """
    curve, mouth, axes, thick, level, bed, ground, blocks = tank
    lead, high = np.empty(3), np.empty(points.shape[1])
    ends, radii, corners, bulk, modules, members, begin = pairs
    balls, hulls, count = np.empty((len(corners), 4)), np.empty((len(ends), 4)), 0
    fixed, capsules, brief = points.shape[1] - (0 if payload else 1), len(ends) - (0 if payload else 1), not len(gaps)
    for i in range(len(points)):
        at = points[i]
        wrap_members(ends, radii, at, hulls)
        for c in range(fixed):
            rho = hypot(at[c, 0], at[c, 1])
            gap, nearest = enclose(curve, mouth, at[c, 0], at[c, 1], at[c, 2])
            if c >= 3 and gap - point_radii[c] < reach:
                if count < len(gaps):
                    config[count], gaps[count], held[count], slopes[count] = i, gap - point_radii[c], -1, 0.0
                    bodies[count, 0], bodies[count, 1], bodies[count, 2] = TANK, c, 0
                    held[count, 0] = c
                    lead_inward(curve, mouth, at[c], rho, gap, nearest, slopes[count, 0])
                count += 1
            lead[0], lead[1], lead[2] = 0.0, 0.0, 1.0
            gap = at[c, 2] - (ground[2] if len(bed) else level) - point_radii[c]
            high[c] = at[c, 2] - ground[2]  # of uneven waste at the least
            if len(bed) and gap < reach:
                away = to_surface(bed, ground, at[c], reach + point_radii[c], lead)
                high[c] = max(high[c], min(away, reach + point_radii[c]))
                gap = (
                    away - point_radii[c] if away < reach + point_radii[c] else np.inf
                )  # or rounding would make it near
            if gap < reach:
                if count < len(gaps):
                    config[count], gaps[count], held[count], slopes[count] = i, gap, -1, 0.0
                    bodies[count, 0], bodies[count, 1], bodies[count, 2] = WASTE, c, 0
                    held[count, 0] = c
                    slopes[count, 0] = lead
                count += 1
        if brief and count:
            return count
        for m in range(capsules if len(bed) else 0):
            a, b = at[ends[m, 0]], at[ends[m, 1]]
            low = (high[ends[m, 0]] + high[ends[m, 1]] - 2 * hulls[m, 3]) / 2 + radii[
                m
            ]  # a hull is half as long as its member
            if ends[m, 1] < 3 or low - radii[m] >= reach or is_above(bed, ground, a, b, reach + radii[m]):
                continue
            gap, s = along_surface(bed, ground, a, b, reach + radii[m], lead)
            if gap - radii[m] < reach:
                if count < len(gaps):
                    config[count], gaps[count] = i, gap - radii[m]
                    bodies[count, 0], bodies[count, 1], bodies[count, 2] = BED, m, 0
                    held[count, :2], held[count, 2:], slopes[count] = ends[m], -1, 0.0
                    for axis in range(3):
                        slopes[count, 0, axis], slopes[count, 1, axis] = (1 - s) * lead[axis], s * lead[axis]
                count += 1
        for k in range(len(axes)):
            if brief and count:
                return count
            for m in range(capsules):
                # a ball about a member that is beside the whole line of the axis is beside the obstacle
                if not meets[k, m] or is_beside_line(hulls[m], axes[k, 0], axes[k, 1], hulls[m, 3] + thick[k] + reach):
                    continue
                a, b = at[ends[m, 0]], at[ends[m, 1]]
                away, s, t = find_between(a, b, axes[k, 0], axes[k, 1])
                if away - radii[m] - thick[k] < reach:
                    if count < len(gaps):
                        config[count], gaps[count] = i, away - radii[m] - thick[k]
                        bodies[count, 0], bodies[count, 1], bodies[count, 2] = PILLAR, m, k
                        held[count, :2], held[count, 2:] = ends[m], -1
                        _lead_apart(a, b, axes[k, 0], axes[k, 1], away, s, t, slopes[count])
                    count += 1
        for k in range(len(blocks.owner)):
            if brief and count:
                return count
            for m in range(capsules):
                if ends[m, 1] < 3:
                    continue
                a, b = at[ends[m, 0]], at[ends[m, 1]]
                away, s = to_block(blocks, k, a, b, reach + radii[m], lead)
                if away - radii[m] < reach:
                    if count < len(gaps):
                        config[count], gaps[count] = i, away - radii[m]
                        bodies[count, 0], bodies[count, 1], bodies[count, 2] = SOLID, m, blocks.owner[k]
                        held[count, :2], held[count, 2:], slopes[count] = ends[m], -1, 0.0
                        for axis in range(3):
                            slopes[count, 0, axis], slopes[count, 1, axis] = (1 - s) * lead[axis], s * lead[axis]
                    count += 1
        wrap_modules(corners, bulk, at, balls)
        for q in range(modules.shape[1]):
            if are_beside(balls[modules[0, q]], balls[modules[1, q]], reach):
                continue
            for r in range(begin[q], begin[q + 1]):
                m, n = members[0, r], members[1, r]
                if are_beside(hulls[m], hulls[n], reach):
                    continue
                a0, a1, b0, b1 = at[ends[m, 0]], at[ends[m, 1]], at[ends[n, 0]], at[ends[n, 1]]
                away, s, t = find_between(a0, a1, b0, b1)
                if away - radii[m] - radii[n] < reach:
                    if count < len(gaps):
                        config[count], gaps[count] = i, away - radii[m] - radii[n]
                        bodies[count, 0], bodies[count, 1], bodies[count, 2] = OWN, m, n
                        held[count, :2], held[count, 2:] = ends[m], ends[n]
                        _lead_apart(a0, a1, b0, b1, away, s, t, slopes[count])
                    count += 1
            if brief and count:
                return count
    return count


@compiled
def flag_clear(
    tank: Walls,
    pairs: MemberPairs,
    meets: Mask,
    point_radii: Array,
    points: Array,
    reach: float,
    all_of_them: bool,
    clear: Mask,
) -> None:
    """Which configurations, see `find_near`, have no pair nearer than a reach; if all must, those after one that has are not."""
    config, gap, held, slope = np.empty(0, np.intp), np.empty(0), np.empty((0, 4), np.intp), np.empty((0, 4, 3))
    bodies, whole = (
        np.empty((0, 3), np.intp),
        len(gap) == 0,
    )  # of a plain True numba would compile `find_near` once more
    clear[:] = False
    for i in range(len(points)):
        one = points[i : i + 1]
        clear[i] = find_near(tank, pairs, meets, point_radii, one, reach, whole, config, gap, bodies, held, slope) == 0
        if all_of_them and not clear[i]:
            return


@compiled
def _lead_apart(a0: Array, a1: Array, b0: Array, b1: Array, away: float, s: float, t: float, slope: Array) -> None:
    """Slopes of a distance between segments by their four ends, shape (4, 3)."""
    for k in range(3):
        unit = a0[k] - b0[k] + s * (a1[k] - a0[k]) - t * (b1[k] - b0[k])
        unit /= max(away, TOUCHING)
        slope[0, k], slope[1, k], slope[2, k], slope[3, k] = (1 - s) * unit, s * unit, (t - 1) * unit, -t * unit


@compiled
def carry(config: Index, held: Index, slopes: Array, J: Array, gradient: Array) -> None:
    """Gradients of gaps by inputs, shape (R, n), from the derivatives of all points, shape (W, N + 1, 3, n)."""
    for r in range(len(gradient)):
        gradient[r] = 0.0
        for k in range(4):
            if held[r, k] < 0:
                break
            for axis in range(3):
                for j in range(gradient.shape[1]):
                    gradient[r, j] += slopes[r, k, axis] * J[config[r], held[r, k], axis, j]
