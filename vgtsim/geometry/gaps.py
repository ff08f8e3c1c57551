"""Distances, compiled: to the tank's inner surface, between segments, and of an arm from all that it must keep clear of.

All positions are in frame G, m. A curve is the tank's profile as `Profile.figures`; a mouth is (bore, rim, dome): radius and
height of the circle where the arm riser's bore meets the dome, and the height of the dome's centre. `Walls` are curve, mouth,
axes of K obstacles, shape (K, 2, 3), their radii and the level of the waste.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.geometry.pairs import MemberPairs

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
Walls = tuple[Array, Array, Array, Array, float]

TANK, WASTE, PILLAR, OWN = range(4)  # what a point or member is near

_SECTOR_SLACK = 1e-9  # m; a point on the border of two sectors must not fall between them; the error is its square
_TOUCHING = 1e-9  # m: below this distance two axes have no direction from one to the other
_SAMPLES, _CUTS = 17, 3  # the place of least distance is then known within 1/1024 of the member's length


@compiled
def _hypot(x: float, y: float) -> float:
    """Size of a pair, quicker than the library's, which cares for very great and small numbers."""
    return np.sqrt(x * x + y * y)


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
    return (2 * y - bend * (x * x + y * y)) / (1 + _hypot(bend * x, 1 - bend * y))


@compiled
def _enclose(curve: Array, mouth: Array, rho: float, z: float) -> tuple[float, int]:
    """Signed distance, and what is nearest: a piece, or the rim (-1) or the bore (-2) of the riser."""
    bore, rim, dome = mouth[0], mouth[1], mouth[2]
    closed, others, nearest, last = np.inf, np.inf, 0, len(curve) - 1
    # below the rim, points whose foot on the dome would fall into the opening
    below = z < rim and rho * (rim - dome) < bore * (z - dome)
    for k in range(len(curve)):
        away = _to_piece(curve, k, rho, z)
        closed = min(closed, away)
        if away < others and not (below and k == last):  # the dome ends at the rim
            others, nearest = away, k
    if z >= rim and (rho < bore or bore - rho > closed):
        return bore - rho, -2
    if below:
        reach = _hypot(rho - bore, z - rim)
        if reach < others:
            return reach, -1
        return others, nearest
    return closed, nearest


@compiled
def _lead_inward(
    curve: Array, mouth: Array, point: Array, rho: float, distance: float, nearest: int, inward: Array
) -> None:
    """Gradient of `_enclose`: the unit direction from the nearest point; outward is along x on the axis."""
    z = point[2]
    if nearest == -2:
        lead_r, lead_z = -1.0, 0.0
    elif nearest == -1:
        lead_r, lead_z = (rho - mouth[0]) / (distance or 1.0), (z - mouth[1]) / (distance or 1.0)
    else:
        along_r, along_z, bend = curve[nearest, 2], curve[nearest, 3], curve[nearest, 8]
        r, h = rho - curve[nearest, 0], z - curve[nearest, 1]
        turn_x, turn_y = bend * (r * along_r + h * along_z), 1 - bend * (h * along_r - r * along_z)
        reach = _hypot(turn_x, turn_y)
        lean, rise = (-turn_x / reach, turn_y / reach) if reach > 0 else (-turn_x, 1.0)
        lead_r, lead_z = lean * along_r - rise * along_z, lean * along_z + rise * along_r
    inward[0] = lead_r * point[0] / rho if rho > 0 else lead_r
    inward[1] = lead_r * point[1] / rho if rho > 0 else 0.0
    inward[2] = lead_z


@compiled
def measure_enclosure(curve: Array, mouth: Array, points: Array, distance: Array, inward: Array) -> None:
    """Signed distance of points, shape (R, 3), and its gradient, shape (R, 3)."""
    for i in range(len(points)):
        rho = _hypot(points[i, 0], points[i, 1])
        distance[i], nearest = _enclose(curve, mouth, rho, points[i, 2])
        _lead_inward(curve, mouth, points[i], rho, distance[i], nearest, inward[i])


@compiled
def _between(a0: Array, a1: Array, b0: Array, b1: Array) -> tuple[float, float, float]:
    """Least distance between two segments, and where on each, see `segment_distance`."""
    ux, uy, uz = a1[0] - a0[0], a1[1] - a0[1], a1[2] - a0[2]
    vx, vy, vz = b1[0] - b0[0], b1[1] - b0[1], b1[2] - b0[2]
    wx, wy, wz = a0[0] - b0[0], a0[1] - b0[1], a0[2] - b0[2]
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    s = _share(uv * vw - vv * uw, uu * vv - uv * uv)
    t = _share(uv * s + vw, vv)
    s = _share(uv * t - uw, uu)
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return np.sqrt(x * x + y * y + z * z), s, t


@compiled
def _share(numerator: float, denominator: float) -> float:
    """Quotient clipped to [0, 1]; zero where the denominator vanishes."""
    return min(max(numerator / denominator, 0.0), 1.0) if denominator > 0 else 0.0


@compiled
def measure_segments(a0: Array, a1: Array, b0: Array, b1: Array, found: Array) -> None:
    """Distances and parameters of segments, ends of shape (R, 3), into shape (R, 3)."""
    for i in range(len(found)):
        found[i, 0], found[i, 1], found[i, 2] = _between(a0[i], a1[i], b0[i], b1[i])


@compiled
def measure_arm(tank: Walls, balls: Array, ends: Index, radii: Array, least: Array, body: Index) -> None:
    """Least distances, shape (B, P), and bodies, see `arm_clearance`; P are shell, riser, obstacles and waste.

    Balls are nodes and payload, shape (B, N, 3); members have two of them, shape (M, 2). Radii are of members and then of
    balls, shape (M + N,).
    """
    curve, mouth, axes, thick, level = tank
    count, places = len(ends), least.shape[1]
    depth, at_mouth = np.empty(balls.shape[1]), np.empty(balls.shape[1], np.bool_)
    for i in range(len(balls)):
        points = balls[i]
        least[i], body[i] = np.inf, 0
        for c in range(len(points)):
            depth[c], nearest = _enclose(curve, mouth, _hypot(points[c, 0], points[c, 1]), points[c, 2])
            at_mouth[c] = nearest < 0
        for m in range(len(radii)):
            a, b = (ends[m, 0], ends[m, 1]) if m < count else (m - count, m - count)
            for c in (a, b):
                _offer(least[i], body[i], 1 if at_mouth[c] else 0, depth[c] - radii[m], m)
            for k in range(len(axes)):
                gap = _between(points[a], points[b], axes[k, 0], axes[k, 1])[0] - thick[k] - radii[m]
                _offer(least[i], body[i], 2 + k, gap, m)
            _offer(least[i], body[i], places - 1, min(points[a, 2], points[b, 2]) - level - radii[m], m)
        _search_mouth(curve, mouth, points, ends, radii, depth, at_mouth, least[i], body[i])


@compiled
def _offer(least: Array, body: Index, place: int, gap: float, m: int) -> None:
    """Keep the least gap; of equal ones the first body's."""
    if gap < least[place] or (gap == least[place] and m < body[place]):
        least[place], body[place] = gap, m


@compiled
def _search_mouth(
    curve: Array,
    mouth: Array,
    points: Array,
    ends: Index,
    radii: Array,
    depths: Array,
    at_mouth: Mask,
    least: Array,
    body: Index,
) -> None:
    """Search members that begin or end where the riser's mouth is nearest along their length.

    The distance changes by no more than the way along the segment, so samples bound it from below. A member that cannot
    come as near to the riser as another one is given up.
    """
    some = np.flatnonzero(at_mouth[ends[:, 0]] | at_mouth[ends[:, 1]])
    for j in range(len(some)):  # a member that can come nearer to neither than another one is already needs no search
        a, b = points[ends[some[j], 0]], points[ends[some[j], 1]]
        middle = _enclose(curve, mouth, _hypot(a[0] + b[0], a[1] + b[1]) / 2, (a[2] + b[2]) / 2)[0]
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
                depth[k], nearest = _enclose(curve, mouth, _hypot(x, y), z)
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
def _wrap(corners: Index, thick: Array, points: Array, balls: Array) -> None:
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
def _wrap_members(ends: Index, radii: Array, points: Array, hulls: Array) -> None:
    """A ball about each member, centre and radius, into shape (M, 4)."""
    for m in range(len(ends)):
        a, b, square = points[ends[m, 0]], points[ends[m, 1]], 0.0
        for k in range(3):
            hulls[m, k] = (a[k] + b[k]) / 2
            square += (b[k] - a[k]) * (b[k] - a[k])
        hulls[m, 3] = np.sqrt(square) / 2 + radii[m]


@compiled
def _beside(one: Array, other: Array, reach: float) -> bool:
    """Whether two balls, centre and radius, are farther apart than a reach, which may be negative."""
    x, y, z, room = one[0] - other[0], one[1] - other[1], one[2] - other[2], one[3] + other[3] + reach
    return room < 0 or x * x + y * y + z * z >= room * room


@compiled
def measure_pairs(pairs: MemberPairs, points: Array, least: Array, pair: Index) -> None:
    """Least distance between members of each configuration, shape (W,), and the two members, shape (W, 2).

    Balls about modules and members tell which of them need not be measured.
    """
    ends, radii, corners, thick, modules, members, begin = pairs
    balls, hulls, lower = np.empty((len(corners), 4)), np.empty((len(ends), 4)), np.empty(modules.shape[1])
    for i in range(len(points)):
        least[i], pair[i] = np.inf, -1
        _wrap(corners, thick, points[i], balls)
        _wrap_members(ends, radii, points[i], hulls)
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
                if _beside(hulls[a], hulls[b], least[i] + _TOUCHING):  # or rounding would lose it
                    continue
                away = _between(
                    points[i, ends[a, 0]], points[i, ends[a, 1]], points[i, ends[b, 0]], points[i, ends[b, 1]]
                )
                gap = away[0] - radii[a] - radii[b]
                first = a < pair[i, 0] or (a == pair[i, 0] and b < pair[i, 1])
                if gap < least[i] or (gap == least[i] and first):
                    least[i], pair[i, 0], pair[i, 1] = gap, a, b


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
        meets: Which members may meet which obstacle, shape (K, M); obstacles stand upright. The last member is the payload.
        point_radii: Of a ball about each point, shape (N + 1,).
        points: Shape (W, N + 1, 3); the first three do not move.
        payload: Whether the payload's distance from all but the arm counts.
        config: Configuration of each pair, shape (R,), and its gap, shape (R,).
        bodies: Of each pair, shape (R, 3): `TANK`, `WASTE`, `PILLAR` or `OWN`, then a point or member, then what it is near.
        held: Points on which the gap depends, shape (R, 4), -1 for none, and its slopes by them, shape (R, 4, 3).
    """
    curve, mouth, axes, thick, level = tank
    ends, radii, corners, bulk, modules, members, begin = pairs
    balls, hulls, count = np.empty((len(corners), 4)), np.empty((len(ends), 4)), 0
    fixed, capsules, brief = points.shape[1] - (0 if payload else 1), len(ends) - (0 if payload else 1), not len(gaps)
    for i in range(len(points)):
        at = points[i]
        _wrap_members(ends, radii, at, hulls)
        for c in range(fixed):
            rho = _hypot(at[c, 0], at[c, 1])
            gap, nearest = _enclose(curve, mouth, rho, at[c, 2])
            if c >= 3 and gap - point_radii[c] < reach:
                if count < len(gaps):
                    config[count], gaps[count], held[count], slopes[count] = i, gap - point_radii[c], -1, 0.0
                    bodies[count, 0], bodies[count, 1], bodies[count, 2] = TANK, c, 0
                    held[count, 0] = c
                    _lead_inward(curve, mouth, at[c], rho, gap, nearest, slopes[count, 0])
                count += 1
            gap = at[c, 2] - level - point_radii[c]
            if gap < reach:
                if count < len(gaps):
                    config[count], gaps[count], held[count], slopes[count] = i, gap, -1, 0.0
                    bodies[count, 0], bodies[count, 1], bodies[count, 2] = WASTE, c, 0
                    held[count, 0], slopes[count, 0, 2] = c, 1.0
                count += 1
        for k in range(len(axes)):
            if brief and count:
                return count
            for m in range(capsules):
                # a ball about a member that is beside the whole upright line is beside the obstacle
                room, x, y = hulls[m, 3] + thick[k] + reach, hulls[m, 0] - axes[k, 0, 0], hulls[m, 1] - axes[k, 0, 1]
                if not meets[k, m] or x * x + y * y >= room * room:
                    continue
                a, b = at[ends[m, 0]], at[ends[m, 1]]
                away, s, t = _between(a, b, axes[k, 0], axes[k, 1])
                if away - radii[m] - thick[k] < reach:
                    if count < len(gaps):
                        config[count], gaps[count] = i, away - radii[m] - thick[k]
                        bodies[count, 0], bodies[count, 1], bodies[count, 2] = PILLAR, m, k
                        held[count, :2], held[count, 2:] = ends[m], -1
                        _lead_apart(a, b, axes[k, 0], axes[k, 1], away, s, t, slopes[count])
                    count += 1
        _wrap(corners, bulk, at, balls)
        for q in range(modules.shape[1]):
            if _beside(balls[modules[0, q]], balls[modules[1, q]], reach):
                continue
            for r in range(begin[q], begin[q + 1]):
                m, n = members[0, r], members[1, r]
                if _beside(hulls[m], hulls[n], reach):
                    continue
                a0, a1, b0, b1 = at[ends[m, 0]], at[ends[m, 1]], at[ends[n, 0]], at[ends[n, 1]]
                away, s, t = _between(a0, a1, b0, b1)
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
    config, gap, bodies = np.empty(0, np.intp), np.empty(0), np.empty((0, 3), np.intp)
    held, slope = np.empty((0, 4), np.intp), np.empty((0, 4, 3))
    clear[:] = False
    for i in range(len(points)):
        one = points[i : i + 1]
        clear[i] = find_near(tank, pairs, meets, point_radii, one, reach, True, config, gap, bodies, held, slope) == 0
        if all_of_them and not clear[i]:
            return


@compiled
def _lead_apart(a0: Array, a1: Array, b0: Array, b1: Array, away: float, s: float, t: float, slope: Array) -> None:
    """Slopes of a distance between segments by their four ends, shape (4, 3)."""
    for k in range(3):
        unit = a0[k] - b0[k] + s * (a1[k] - a0[k]) - t * (b1[k] - b0[k])
        unit /= max(away, _TOUCHING)
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
