"""Distances, compiled: to the tank's inner surface, between segments, and of an arm from all that it must keep clear of.

All positions are in frame G, m. A curve is the tank's profile as `Profile.figures`; a mouth is (bore, rim, dome, x, y, cap):
radius and lowest height of the curve where the arm riser's bore meets the dome, the height of the dome's centre, the place of
the riser's axis and the radius of the dome.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.geometry.blocks import Blocks, to_block
from vgtsim.geometry.pairs import MemberPairs
from vgtsim.geometry.segments import TOUCHING, find_between
from vgtsim.geometry.side_mouth import enclose_aside, find_rim, find_top, hypot
from vgtsim.geometry.surface import along_surface, find_height, is_above, to_surface

# what a point or member is near; a bed is uneven waste, which a member is near
TANK, WASTE, PILLAR, OWN, BED, SOLID = range(6)

_SECTOR_SLACK = 1e-9  # m; a point on the border of two sectors must not fall between them; the error is its square
_SAMPLES, _CUTS = 17, 3  # the place of least distance is then known within 1/1024 of the member's length


class Walls(NamedTuple):
    """A tank with all that stands in it; compiled functions take it as it is.

    Attributes:
        curve, mouth: Of the tank and its arm riser.
        axes, thick: Axes and radii of K cylinders, shapes (K, 2, 3) and (K,), m.
        level: Height of the waste, m, where its bed is level.
        bed, ground: Of uneven waste, see `surface`; a bed of no heights is level.
        blocks: Solids.
    """

    curve: Array
    mouth: Array
    axes: Array
    thick: Array
    level: float
    bed: Array
    ground: Array
    blocks: Blocks


@compiled
def _to_piece(curve: Array, k: int, rho: float, z: float) -> float:
    """Signed distance to a piece of the profile; infinite outside its sector."""
    r, h = rho - curve[k, 0], z - curve[k, 1]
    x, y = r * curve[k, 2] + h * curve[k, 3], h * curve[k, 2] - r * curve[k, 3]
    past = (rho - curve[k, 4]) * curve[k, 6] + (z - curve[k, 5]) * curve[k, 7]
    if x < -_SECTOR_SLACK or past > _SECTOR_SLACK:
        return np.inf
    bend = curve[k, 8]
    # from the centre, in units of the radius; stays finite when the piece is straight
    return (2 * y - bend * (x * x + y * y)) / (1 + hypot(bend * x, 1 - bend * y))


@compiled
def enclose(curve: Array, mouth: Array, x: float, y: float, z: float) -> tuple[float, int]:
    """Signed distance, and what is nearest: a piece, or the rim (-1) or the bore (-2) of the riser."""
    bore, rim, dome = mouth[0], mouth[1], mouth[2]
    if z >= find_top(mouth):
        away = hypot(x - mouth[3], y - mouth[4])
        if away < bore:
            return bore - away, -2
    rho = hypot(x, y)
    if mouth[3] != 0 or mouth[4] != 0:
        return _enclose_beside(curve, mouth, x, y, z)
    closed, others, nearest, last = np.inf, np.inf, 0, len(curve) - 1
    # below the rim, points whose foot on the dome would fall into the opening
    below = z < rim and rho * (rim - dome) < bore * (z - dome)
    for k in range(len(curve)):
        away = _to_piece(curve, k, rho, z)
        closed = min(closed, away)
        if away < others and not (below and k == last):  # the dome ends at the rim
            others, nearest = away, k
    if z >= rim and bore - rho > closed:
        return bore - rho, -2
    if below:
        reach = hypot(rho - bore, z - rim)
        if reach < others:
            return reach, -1
        return others, nearest
    return closed, nearest


@compiled
def _enclose_beside(curve: Array, mouth: Array, x: float, y: float, z: float) -> tuple[float, int]:
    """As `enclose`, of a riser that stands beside the tank's axis."""
    rho, last = hypot(x, y), len(curve) - 1
    closed, others, nearest, first = np.inf, np.inf, 0, 0
    for k in range(len(curve)):
        away = _to_piece(curve, k, rho, z)
        if away < closed:
            closed, first = away, k
        if k != last and away < others:
            others, nearest = away, k
    reach, place = enclose_aside(mouth, x, y, z, closed)
    if place == -2 or (place == -1 and reach < others):
        return reach, place
    return (others, nearest) if place == -1 else (closed, first)


@compiled
def lead_inward(
    curve: Array, mouth: Array, point: Array, rho: float, distance: float, nearest: int, inward: Array
) -> None:
    """Gradient of `enclose`: the unit direction from the nearest point; outward is along x on the axis."""
    z = point[2]
    if nearest < 0 and (mouth[3] != 0 or mouth[4] != 0):
        if nearest == -1:
            find_rim(mouth, point[0], point[1], z, inward)
            for k in range(3):
                inward[k] = (point[k] - inward[k]) / (distance or 1.0)
            return
        u, v = mouth[3] - point[0], mouth[4] - point[1]
        away = hypot(u, v) or 1.0
        inward[0], inward[1], inward[2] = u / away, v / away, 0.0
        return
    if nearest == -2:
        lead_r, lead_z = -1.0, 0.0
    elif nearest == -1:
        lead_r, lead_z = (rho - mouth[0]) / (distance or 1.0), (z - mouth[1]) / (distance or 1.0)
    else:
        along_r, along_z, bend = curve[nearest, 2], curve[nearest, 3], curve[nearest, 8]
        r, h = rho - curve[nearest, 0], z - curve[nearest, 1]
        turn_x, turn_y = bend * (r * along_r + h * along_z), 1 - bend * (h * along_r - r * along_z)
        reach = hypot(turn_x, turn_y)
        lean, rise = (-turn_x / reach, turn_y / reach) if reach > 0 else (-turn_x, 1.0)
        lead_r, lead_z = lean * along_r - rise * along_z, lean * along_z + rise * along_r
    inward[0] = lead_r * point[0] / rho if rho > 0 else lead_r
    inward[1] = lead_r * point[1] / rho if rho > 0 else 0.0
    inward[2] = lead_z


@compiled
def measure_enclosure(curve: Array, mouth: Array, points: Array, distance: Array, inward: Array) -> None:
    """Signed distance of points, shape (R, 3), and its gradient, shape (R, 3)."""
    for i in range(len(points)):
        rho = hypot(points[i, 0], points[i, 1])
        distance[i], nearest = enclose(curve, mouth, points[i, 0], points[i, 1], points[i, 2])
        lead_inward(curve, mouth, points[i], rho, distance[i], nearest, inward[i])


@compiled
def measure_segments(a0: Array, a1: Array, b0: Array, b1: Array, found: Array) -> None:
    """Distances and parameters of segments, ends of shape (R, 3), into shape (R, 3)."""
    for i in range(len(found)):
        found[i, 0], found[i, 1], found[i, 2] = find_between(a0[i], a1[i], b0[i], b1[i])


@compiled
def is_beside_line(ball: Array, low: Array, high: Array, room: float) -> bool:
    """Whether a ball's middle is farther than `room` from the line through two points; of an upright line by x and y alone."""
    x, y = ball[0] - low[0], ball[1] - low[1]
    if low[0] == high[0] and low[1] == high[1]:
        return x * x + y * y >= room * room
    u, v, w, z = high[0] - low[0], high[1] - low[1], high[2] - low[2], ball[2] - low[2]
    p, q, r = y * w - z * v, z * u - x * w, x * v - y * u
    return p * p + q * q + r * r >= room * room * (u * u + v * v + w * w)


@compiled
def measure_arm(
    tank: Walls, balls: Array, ends: Index, radii: Array, least: Array, body: Index, together: bool = False
) -> None:
    """Least distances, shape (B, P), and bodies, see `arm_clearance`; P are shell, riser, obstacles and waste.

    Balls are nodes and payload, shape (B, N, 3); members have two of them, shape (M, 2). Radii are of members and then of
    balls, shape (M + N,). If only the least of all configurations counts, what cannot be it is left out: it is infinite or more
    than it is.
    """
    curve, mouth, axes, thick, blocks = tank.curve, tank.mouth, tank.axes, tank.thick, tank.blocks
    bed, ground = tank.bed, tank.ground
    bound, middle = np.inf, np.empty(3)  # what is not less than the bound need not be measured
    lead, high, count, places = np.empty(3), np.empty(balls.shape[1]), len(ends), least.shape[1]
    depth, at_mouth = np.empty(balls.shape[1]), np.empty(balls.shape[1], np.bool_)
    for i in range(len(balls)):
        points = balls[i]
        least[i], body[i] = np.inf, 0
        for c in range(len(points)):
            depth[c], nearest = enclose(curve, mouth, points[c, 0], points[c, 1], points[c, 2])
            at_mouth[c] = nearest < 0
        most = _look_down(bed, ground, points, radii[count:], bound, high) if len(bed) else np.inf
        for m in range(len(radii)):
            a, b = (ends[m, 0], ends[m, 1]) if m < count else (m - count, m - count)
            for c in (a, b):
                _offer(least[i], body[i], 1 if at_mouth[c] else 0, depth[c] - radii[m], m)
            for axis in range(3):
                middle[axis] = (points[a, axis] + points[b, axis]) / 2
            half = _apart(points[a], points[b]) / 2
            for k in range(len(axes)):
                # a ball about a member that is beside the whole line of the axis is that far from the cylinder
                room = min(least[i, 2 + k], bound) + TOUCHING + thick[k] + radii[m] + half
                if room > 0 and is_beside_line(middle, axes[k, 0], axes[k, 1], room):
                    continue
                gap = find_between(points[a], points[b], axes[k, 0], axes[k, 1])[0] - thick[k] - radii[m]
                _offer(least[i], body[i], 2 + k, gap, m)
            for k in range(len(blocks.owner)):
                place = 2 + len(axes) + blocks.owner[k]
                limit = min(least[i, place], bound) + radii[m] + TOUCHING
                gap = to_block(blocks, k, points[a], points[b], limit, lead)[0] - radii[m]
                _offer(least[i], body[i], place, gap, m)
            low = min(points[a, 2], points[b, 2])
            if not len(bed):
                _offer(least[i], body[i], places - 1, low - tank.level - radii[m], m)
                continue
            limit = min(most, least[i, places - 1]) + radii[m] + TOUCHING
            if low - ground[2] > limit or (high[a] + high[b] - _apart(points[a], points[b])) / 2 > limit:
                continue
            if not is_above(bed, ground, points[a], points[b], limit):
                gap = along_surface(bed, ground, points[a], points[b], limit, lead)[0] - radii[m]
                _offer(least[i], body[i], places - 1, gap, m)
        _search_mouth(tank, points, ends, radii, depth, at_mouth, least[i], body[i])
        if together:
            bound = min(bound, least[i].min())


@compiled
def _look_down(bed: Array, ground: Array, balls: Array, radii: Array, bound: float, high: Array) -> float:
    """Distances of balls' middles from uneven waste, those far above it at the least, and a bound of the arm's gap from it."""
    most = bound
    for c in range(len(balls)):
        over = balls[c, 2] - find_height(bed, ground, balls[c, 0], balls[c, 1])
        most = min(most, max(over, 0.0) - radii[c])
    lead, thickest = np.empty(3), radii.max()
    for c in range(len(balls)):
        high[c] = balls[c, 2] - ground[2]
        limit = most + thickest + TOUCHING
        if high[c] <= limit:
            high[c] = max(high[c], min(to_surface(bed, ground, balls[c], limit, lead), limit))
            most = min(most, high[c] - radii[c])
    return most


@compiled
def _offer(least: Array, body: Index, place: int, gap: float, m: int) -> None:
    """Keep the least gap; of equal ones the first body's."""
    if gap < least[place] or (gap == least[place] and m < body[place]):
        least[place], body[place] = gap, m


@compiled
def _search_mouth(
    tank: Walls, points: Array, ends: Index, radii: Array, depths: Array, at_mouth: Mask, least: Array, body: Index
) -> None:
    """Search members that begin or end where the riser's mouth is nearest along their length.

    The distance changes by no more than the way along the segment, so samples bound it from below. A member that cannot
    come as near to the riser as another one is given up.
    """
    curve, mouth = tank.curve, tank.mouth
    some, top = np.flatnonzero(at_mouth[ends[:, 0]] | at_mouth[ends[:, 1]]), find_top(mouth)
    for j in range(len(some)):  # a member that can come nearer to neither than another one is already needs no search
        a, b = points[ends[some[j], 0]], points[ends[some[j], 1]]
        if min(a[2], b[2]) >= top and min(depths[ends[some[j], 0]], depths[ends[some[j], 1]]) > 0:
            some[j] = -1  # all of it is inside the bore, to which one of its ends is nearest
            continue
        middle = enclose(curve, mouth, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2)[0]
        end = min(depths[ends[some[j], 0]], depths[ends[some[j], 1]])
        if (end + middle - _apart(a, b) / 2) / 2 - radii[some[j]] >= max(least[0], least[1]):
            some[j] = -1
    some = some[some >= 0]
    if not len(some):
        return
    low, high, bound = np.zeros(len(some)), np.ones(len(some)), np.empty(len(some))
    gap, in_mouth, only = np.empty(len(some)), np.zeros(len(some), np.bool_), np.zeros(len(some), np.bool_)
    depth, mark, going = np.empty(_SAMPLES), np.empty(_SAMPLES, np.bool_), np.ones(len(some), np.bool_)
    found = least[1]
    for _ in range(_CUTS):
        for j in range(len(some)):
            if not going[j]:
                continue
            a, b = points[ends[some[j], 0]], points[ends[some[j], 1]]
            best, step = 0, (high[j] - low[j]) / (_SAMPLES - 1)
            for k in range(_SAMPLES):
                t = low[j] + step * k
                x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
                depth[k], nearest = enclose(curve, mouth, x, y, z)
                mark[k] = nearest < 0
                if depth[k] < depth[best]:
                    best = k
            before, after = max(best - 1, 0), min(best + 1, _SAMPLES - 1)
            gap[j], in_mouth[j] = depth[best] - radii[some[j]], mark[best]
            only[j] = mark[best] and mark[before] and mark[after]
            bound[j] = gap[j] - step * _apart(a, b) / 2
            low[j], high[j] = low[j] + step * before, low[j] + step * after
            if in_mouth[j]:
                found = min(found, gap[j])
        for j in range(len(some)):
            going[j] = going[j] and (not only[j] or bound[j] < found)
    for j in range(len(some)):
        _offer(least, body, 1 if in_mouth[j] else 0, gap[j], some[j])


@compiled
def wrap_modules(corners: Index, thick: Array, points: Array, balls: Array) -> None:
    """A ball about each module, centre and radius, into shape (L, 4)."""
    for k in range(len(corners)):
        for axis in range(3):
            low = high = points[corners[k, 0], axis]
            for c in corners[k]:
                low, high = min(low, points[c, axis]), max(high, points[c, axis])
            balls[k, axis] = (low + high) / 2
        most = 0.0
        for c in corners[k]:
            most = max(most, _apart(points[c], balls[k]))
        balls[k, 3] = most + thick[k]


@compiled
def _apart(a: Array, b: Array) -> float:
    """Distance of two points."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(x * x + y * y + z * z)


@compiled
def wrap_members(ends: Index, radii: Array, points: Array, hulls: Array) -> None:
    """A ball about each member, centre and radius, into shape (M, 4)."""
    for m in range(len(ends)):
        a, b, square = points[ends[m, 0]], points[ends[m, 1]], 0.0
        for k in range(3):
            hulls[m, k] = (a[k] + b[k]) / 2
            square += (b[k] - a[k]) * (b[k] - a[k])
        hulls[m, 3] = np.sqrt(square) / 2 + radii[m]


@compiled
def are_beside(one: Array, other: Array, reach: float) -> bool:
    """Whether two balls, centre and radius, are farther apart than a reach, which may be negative."""
    x, y, z, room = one[0] - other[0], one[1] - other[1], one[2] - other[2], one[3] + other[3] + reach
    return room < 0 or x * x + y * y + z * z >= room * room


@compiled
def measure_pairs(pairs: MemberPairs, points: Array, least: Array, pair: Index) -> None:
    """Least distance between members of each configuration, shape (W,), and the two members, shape (W, 2).

    Balls about modules and members tell which of them need not be measured.
    """
    ends, radii, modules, members, begin = pairs.ends, pairs.radii, pairs.modules, pairs.members, pairs.begin
    corners, thick = pairs.corners, pairs.thick
    balls, hulls, lower = np.empty((len(corners), 4)), np.empty((len(ends), 4)), np.empty(modules.shape[1])
    for i in range(len(points)):
        least[i], pair[i] = np.inf, -1
        wrap_modules(corners, thick, points[i], balls)
        wrap_members(ends, radii, points[i], hulls)
        likely = 0
        if not len(lower):
            continue
        for k in range(len(lower)):
            one, other = balls[modules[0, k]], balls[modules[1, k]]
            lower[k] = _apart(one, other) - one[3] - other[3]
            if lower[k] < lower[likely]:
                likely = k
        for turn in range(-1, len(lower)):  # the nearest modules first: they bound the others
            k = likely if turn < 0 else turn
            if lower[k] > least[i] or (turn == likely):
                continue
            for r in range(begin[k], begin[k + 1]):
                a, b = members[0, r], members[1, r]
                if are_beside(hulls[a], hulls[b], least[i] + TOUCHING):  # or rounding would lose it
                    continue
                away = find_between(
                    points[i, ends[a, 0]], points[i, ends[a, 1]], points[i, ends[b, 0]], points[i, ends[b, 1]]
                )
                gap = away[0] - radii[a] - radii[b]
                first = a < pair[i, 0] or (a == pair[i, 0] and b < pair[i, 1])
                if gap < least[i] or (gap == least[i] and first):
                    least[i], pair[i, 0], pair[i, 1] = gap, a, b
