"""Pairs of bodies that are near each other, compiled: an arm's with all that it must keep clear of, for a solver and a planner.

Positions, walls and what they are made of are as in `gaps`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry.blocks import Blocks, to_block
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
from vgtsim.geometry.segments import TOUCHING, copy_row, find_between
from vgtsim.geometry.side_mouth import hypot
from vgtsim.geometry.surface import along_surface, is_above, to_surface


class NearRows(NamedTuple):
    """Room for R pairs, row by row.

    Configuration, shape (R,); gap, shape (R,), m; bodies, shape (R, 3): a kind such as `TANK`, then a point or member of the
    arm, then what it is near; the points on which the gap depends, shape (R, 4), -1 for none, and its slopes by them, shape
    (R, 4, 3).
    """

    config: Index
    gap: Array
    bodies: Index
    held: Index
    slopes: Array

    @classmethod
    def make(cls, room: int) -> NearRows:
        """Rows that nothing was written to yet."""
        held, slopes = np.empty((room, 4), np.intp), np.empty((room, 4, 3))
        return cls(np.empty(room, np.intp), np.empty(room), np.empty((room, 3), np.intp), held, slopes)

    def first(self, count: int) -> NearRows:
        """The first rows alone."""
        columns: tuple[Any, ...] = tuple(column[:count] for column in self)
        return NearRows(*columns)


class ArmInTank(NamedTuple):
    """An arm, its payload and all that they must keep clear of; compiled functions take it as it is.

    Attributes:
        walls: Of the tank; the mast is one of its cylinders.
        pairs: Pairs of members that may meet; the last member is the payload.
        meets: Which members may meet which cylinder, shape (K, M).
        point_radii: Of a ball about each point, shape (N + 1,), m.
    """

    walls: Walls
    pairs: MemberPairs
    meets: Mask
    point_radii: Array


class _Posture(NamedTuple):
    """One configuration, and the members that are compared with all but the arm.

    Attributes:
        at: Its points, shape (N + 1, 3), m.
        high: How high each point is above the waste, at the least, m.
        ends, radii: Of the members, as in `MemberPairs`; `hulls` are balls about them, shape (M, 4), m.
    """

    config: int
    reach: float
    at: Array
    high: Array
    ends: Index
    radii: Array
    hulls: Array


@compiled
def find_near(arm: ArmInTank, points: Array, reach: float, payload: bool, rows: NearRows) -> int:
    """Pairs of bodies nearer than a reach, configuration by configuration; returns their number, however few fit in.

    Where no room is given for any, it ends soon after the first.

    Args:
        points: Shape (W, N + 1, 3); the first three do not move.
        payload: Whether the payload's distance from all but the arm counts.
    """
    walls, pairs = arm.walls, arm.pairs
    balls, hulls, high = np.empty((len(pairs.corners), 4)), np.empty((len(pairs.ends), 4)), np.empty(points.shape[1])
    left_out = 0 if payload else 1
    fixed, ends = points.shape[1] - left_out, pairs.ends[: len(pairs.ends) - left_out]
    brief, count = not len(rows.gap), 0
    for i in range(len(points)):
        here = _Posture(config=i, reach=reach, at=points[i], high=high, ends=ends, radii=pairs.radii, hulls=hulls)
        wrap_members(pairs.ends, pairs.radii, points[i], hulls)
        count = _add_points(walls, arm.point_radii, fixed, here, rows, count)
        if len(walls.bed) and not (brief and count):
            count = _add_bed(walls.bed, walls.ground, here, rows, count)
        if not (brief and count):
            count = _add_pillars(walls.axes, walls.thick, arm.meets, here, rows, count)
        if len(walls.blocks.owner) and not (brief and count):
            count = _add_blocks(walls.blocks, here, rows, count)
        if not (brief and count):
            wrap_modules(pairs.corners, pairs.thick, points[i], balls)
            count = _add_own(pairs, balls, here, rows, count)
        if brief and count:
            return count
    return count


@compiled
def _write(rows: NearRows, row: int, config: int, gap: Any, kind: int, body: int, other: Any) -> bool:
    """Begin a row, with no points held; tells whether there is room for it."""
    if row >= len(rows.gap):
        return False
    rows.config[row], rows.gap[row], rows.held[row], rows.slopes[row] = config, gap, -1, 0.0
    rows.bodies[row, 0], rows.bodies[row, 1], rows.bodies[row, 2] = kind, body, other
    return True


@compiled
def _write_along(rows: NearRows, row: int, ends: Index, s: float, lead: Array) -> None:
    """Slopes of a gap at a place between a member's ends, along a unit direction."""
    rows.held[row, 0], rows.held[row, 1] = ends[0], ends[1]
    for axis in range(3):
        rows.slopes[row, 0, axis], rows.slopes[row, 1, axis] = (1 - s) * lead[axis], s * lead[axis]


@compiled
def _add_points(walls: Walls, point_radii: Array, fixed: int, here: _Posture, rows: NearRows, count: int) -> int:
    """Points near the tank's surface or the waste; how high each is above the waste, at the least, goes into `high`."""
    curve, mouth, bed, ground = walls.curve, walls.mouth, walls.bed, walls.ground
    at, high, reach, lead = here.at, here.high, here.reach, np.empty(3)
    for c in range(fixed):
        room = reach + point_radii[c]
        rho = hypot(at[c, 0], at[c, 1])
        away, nearest = enclose(curve, mouth, at[c, 0], at[c, 1], at[c, 2])
        if c >= 3 and away - point_radii[c] < reach:
            if _write(rows, count, here.config, away - point_radii[c], TANK, c, 0):
                rows.held[count, 0] = c
                lead_inward(curve, mouth, at[c], rho, away, nearest, rows.slopes[count, 0])
            count += 1
        lead[0], lead[1], lead[2] = 0.0, 0.0, 1.0
        gap = at[c, 2] - (ground[2] if len(bed) else walls.level) - point_radii[c]
        high[c] = at[c, 2] - ground[2]
        if len(bed) and gap < reach:
            away = to_surface(bed, ground, at[c], room, lead)
            high[c] = max(high[c], min(away, room))
            gap = away - point_radii[c] if away < room else np.inf  # or rounding would make it near
        if gap < reach:
            if _write(rows, count, here.config, gap, WASTE, c, 0):
                rows.held[count, 0] = c
                copy_row(lead, rows.slopes[count, 0])
            count += 1
    return count


@compiled
def _add_bed(bed: Array, ground: Array, here: _Posture, rows: NearRows, count: int) -> int:
    """Members near uneven waste between their ends."""
    ends, radii, at, high, lead = here.ends, here.radii, here.at, here.high, np.empty(3)
    hulls, reach = here.hulls, here.reach
    for m in range(len(ends)):
        a, b = at[ends[m, 0]], at[ends[m, 1]]
        room = reach + radii[m]
        # a hull is half as long as its member
        low = (high[ends[m, 0]] + high[ends[m, 1]] - 2 * hulls[m, 3]) / 2 + radii[m]
        if ends[m, 1] < 3 or low - radii[m] >= reach or is_above(bed, ground, a, b, room):
            continue
        gap, s = along_surface(bed, ground, a, b, room, lead)
        if gap - radii[m] < reach:
            if _write(rows, count, here.config, gap - radii[m], BED, m, 0):
                _write_along(rows, count, ends[m], s, lead)
            count += 1
    return count


@compiled
def _add_pillars(axes: Array, thick: Array, meets: Mask, here: _Posture, rows: NearRows, count: int) -> int:
    """Members near cylinders."""
    ends, radii, at, hulls, reach = here.ends, here.radii, here.at, here.hulls, here.reach
    for k in range(len(axes)):
        if count and not len(rows.gap):
            return count
        for m in range(len(ends)):
            # a ball about a member that is beside the whole line of the axis is beside the obstacle
            if not meets[k, m] or is_beside_line(hulls[m], axes[k, 0], axes[k, 1], hulls[m, 3] + thick[k] + reach):
                continue
            a, b = at[ends[m, 0]], at[ends[m, 1]]
            found = find_between(a, b, axes[k, 0], axes[k, 1])
            away = found[0]
            if away - radii[m] - thick[k] < reach:
                if _write(rows, count, here.config, away - radii[m] - thick[k], PILLAR, m, k):
                    rows.held[count, 0], rows.held[count, 1] = ends[m, 0], ends[m, 1]
                    _lead_apart(a, b, axes[k, 0], axes[k, 1], found, rows.slopes[count])
                count += 1
    return count


@compiled
def _add_blocks(blocks: Blocks, here: _Posture, rows: NearRows, count: int) -> int:
    """Members near solids."""
    ends, radii, at, reach, lead = here.ends, here.radii, here.at, here.reach, np.empty(3)
    for k in range(len(blocks.owner)):
        if count and not len(rows.gap):
            return count
        for m in range(len(ends)):
            if ends[m, 1] < 3:
                continue
            away, s = to_block(blocks, k, at[ends[m, 0]], at[ends[m, 1]], reach + radii[m], lead)
            if away - radii[m] < reach:
                if _write(rows, count, here.config, away - radii[m], SOLID, m, blocks.owner[k]):
                    _write_along(rows, count, ends[m], s, lead)
                count += 1
    return count


@compiled
def _add_own(pairs: MemberPairs, balls: Array, here: _Posture, rows: NearRows, count: int) -> int:
    """Members near members of other modules."""
    ends, radii, modules, members, begin = pairs.ends, pairs.radii, pairs.modules, pairs.members, pairs.begin
    at, hulls, reach = here.at, here.hulls, here.reach
    for q in range(modules.shape[1]):
        if are_beside(balls[modules[0, q]], balls[modules[1, q]], reach):
            continue
        for r in range(begin[q], begin[q + 1]):
            m, n = members[0, r], members[1, r]
            if are_beside(hulls[m], hulls[n], reach):
                continue
            a0, a1, b0, b1 = at[ends[m, 0]], at[ends[m, 1]], at[ends[n, 0]], at[ends[n, 1]]
            found = find_between(a0, a1, b0, b1)
            away = found[0]
            if away - radii[m] - radii[n] < reach:
                if _write(rows, count, here.config, away - radii[m] - radii[n], OWN, m, n):
                    copy_row(ends[m], rows.held[count, :2])
                    copy_row(ends[n], rows.held[count, 2:])
                    _lead_apart(a0, a1, b0, b1, found, rows.slopes[count])
                count += 1
        if count and not len(rows.gap):
            return count
    return count


@compiled
def flag_clear(arm: ArmInTank, points: Array, reach: float, all_of_them: bool, clear: Mask) -> None:
    """Which configurations, see `find_near`, have no pair nearer than a reach; if all must, those after one that has are not."""
    none = NearRows(
        config=np.empty(0, np.intp),
        gap=np.empty(0),
        bodies=np.empty((0, 3), np.intp),
        held=np.empty((0, 4), np.intp),
        slopes=np.empty((0, 4, 3)),
    )
    whole = len(none.gap) == 0  # of a plain True numba would compile `find_near` once more
    clear[:] = False
    for i in range(len(points)):
        clear[i] = find_near(arm, points[i : i + 1], reach, whole, none) == 0
        if all_of_them and not clear[i]:
            return


@compiled
def _lead_apart(a0: Array, a1: Array, b0: Array, b1: Array, found: tuple[float, float, float], slope: Array) -> None:
    """Slopes of a distance between segments, as `find_between` found it, by their four ends, shape (4, 3)."""
    away, s, t = found
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
