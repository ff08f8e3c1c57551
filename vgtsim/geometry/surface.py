"""Distances to an uneven bed of waste, compiled.

A bed is a square grid of heights, shape (n, n), m; its ground is (x0, step, top, bottom, share): x and y of the first height,
the distance of heights, m, the greatest and least height, and the least share of a height over it that is distance from it.
Each cell is two triangles, on either side of the diagonal from its first corner. Distances are exact for that surface, and
negative below it; where it is asked for within a bound, the depth of a deep point is measured upright.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.geometry.segments import copy_row

_TOUCHING = 1e-9  # m: nearer to the surface than this, up is the direction from it
_DEEP = 0.5  # m below the surface, upright, from which the nearest cell is not sought: nothing real is there
_SAMPLES, _CUTS = 5, 5  # the place of least distance is then known within 1/64 of a member's length
_PARTS = 4  # of a segment, each with the highest ground about it: a part of a member is about as long as a cell or two


@compiled
def _place(bed: Array, ground: Array, x: float, y: float) -> tuple[int, int, float, float]:
    """Cell below a point and where in it, 0 to 1; points beside the grid count at its border."""
    last = len(bed) - 1
    u = min(max((x - ground[0]) / ground[1], 0.0), float(last))
    v = min(max((y - ground[0]) / ground[1], 0.0), float(last))
    i, j = min(int(u), last - 1), min(int(v), last - 1)
    return i, j, u - i, v - j


@compiled
def find_height(bed: Array, ground: Array, x: float, y: float) -> float:
    """Height of the surface at a place, m."""
    i, j, u, v = _place(bed, ground, x, y)
    a, c = bed[i, j], bed[i + 1, j + 1]
    if u >= v:
        b = bed[i + 1, j]
        return a + u * (b - a) + v * (c - b)
    d = bed[i, j + 1]
    return a + v * (d - a) + u * (c - d)


@compiled
def is_above(bed: Array, ground: Array, a: Array, b: Array, limit: float) -> bool:
    """Whether a segment is sure to be farther above the surface than a limit, which may be negative.

    The highest corner of the ground that is within the limit of a part of the segment, sideways, tells it; it costs little.
    """
    last, side = len(bed) - 1, max(limit, 0.0)
    low = min(a[2], b[2]) - limit
    if low > ground[2]:
        return True
    for part in range(_PARTS):
        s, t = part / _PARTS, (part + 1) / _PARTS
        x0, y0, z0 = a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])
        x1, y1, z1 = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
        floor = min(z0, z1) - limit
        if floor > ground[2]:
            continue
        i, j, _, _ = _place(bed, ground, min(x0, x1) - side, min(y0, y1) - side)
        m, n, _, _ = _place(bed, ground, max(x0, x1) + side, max(y0, y1) + side)
        for row in range(i, min(m + 1, last) + 1):
            for column in range(j, min(n + 1, last) + 1):
                if bed[row, column] >= floor:
                    return False
    return True


@compiled
def to_triangle(p: Array, a: Array, b: Array, c: Array, foot: Array) -> float:
    """Square of the distance to a triangle, and its nearest point (Ericson, Real-Time Collision Detection, 5.1.5)."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        ab, ac = b[k] - a[k], c[k] - a[k]
        d1, d2 = d1 + ab * (p[k] - a[k]), d2 + ac * (p[k] - a[k])
        d3, d4 = d3 + ab * (p[k] - b[k]), d4 + ac * (p[k] - b[k])
        d5, d6 = d5 + ab * (p[k] - c[k]), d6 + ac * (p[k] - c[k])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    s = t = 0.0
    if d1 <= 0 and d2 <= 0:
        s, t = 0.0, 0.0
    elif d3 >= 0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        s, t = d1 / (d1 - d3), 0.0
    elif d6 >= 0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        s, t = 0.0, d2 / (d2 - d6)
    elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        whole = va + vb + vc
        s, t = vb / whole, vc / whole
    square = 0.0
    for k in range(3):
        foot[k] = a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k])
        square += (p[k] - foot[k]) ** 2
    return square


@compiled
def to_surface(bed: Array, ground: Array, p: Array, bound: float, slope: Array) -> float:
    """Signed distance of a point, or less but not less than a bound, and its gradient, shape (3,).

    Cells are looked at in rings about the point.
    """
    i, j, _, _ = _place(bed, ground, p[0], p[1])
    height, last, step = find_height(bed, ground, p[0], p[1]), len(bed) - 1, ground[1]
    slope[0], slope[1], slope[2] = 0.0, 0.0, 1.0
    if height - p[2] > _DEEP and bound < np.inf:
        return p[2] - height
    best, above, least = np.inf, p[2] >= height, 0.0
    if above:
        least = (p[2] - height) * ground[4]
        if least >= bound:
            return least
        best = max(bound, 0.0) ** 2
    over = max(p[2] - ground[2], ground[3] - p[2], 0.0)
    foot, nearest, corners, found = np.empty(3), np.empty(3), np.empty((4, 3)), False
    for ring in range(last + 1):
        # a cell of this ring is at least so far away, sideways and up
        aside = max(ring - 1, 0) * step
        if aside * aside + over * over >= best:
            break
        for m in range(max(i - ring, 0), min(i + ring, last - 1) + 1):
            stride = 1 if abs(m - i) == ring else 2 * ring  # a row inside the ring has two of its cells
            for n in range(j - ring, j + ring + 1, stride):
                if n < 0 or n >= last:
                    continue
                peak = max(max(bed[m, n], bed[m + 1, n]), max(bed[m, n + 1], bed[m + 1, n + 1]))
                valley = min(min(bed[m, n], bed[m + 1, n]), min(bed[m, n + 1], bed[m + 1, n + 1]))
                u = max(ground[0] + m * step - p[0], p[0] - ground[0] - (m + 1) * step, 0.0)
                v = max(ground[0] + n * step - p[1], p[1] - ground[0] - (n + 1) * step, 0.0)
                w = max(p[2] - peak, valley - p[2], 0.0)
                if u * u + v * v + w * w >= best:
                    continue
                for k in range(4):
                    row, column = m + (1 if k in (1, 2) else 0), n + (1 if k >= 2 else 0)
                    corners[k, 0], corners[k, 1] = ground[0] + row * step, ground[0] + column * step
                    corners[k, 2] = bed[row, column]
                for half in range(2):
                    square = to_triangle(p, corners[0], corners[1 + half], corners[2 + half], foot)
                    if square < best:
                        best, found = square, True
                        copy_row(foot, nearest)
    if not found:
        return max(bound, least)
    distance, sign = np.sqrt(best), 1.0 if above else -1.0
    if distance > _TOUCHING:
        for k in range(3):
            slope[k] = sign * (p[k] - nearest[k]) / distance
    return sign * distance


@compiled
def along_surface(bed: Array, ground: Array, a: Array, b: Array, limit: float, slope: Array) -> tuple[float, float]:
    """Least signed distance of a segment, and where on it, 0 to 1; with the gradient by that point, shape (3,).

    The distance changes by no more than the way along the segment: samples that cannot be less than a limit, or than the
    least one, are left out. It is infinite, or some value above the limit, where
    it is not less than the limit.
    """
    p, low, high, at, tried = np.empty(3), 0.0, 1.0, 0.0, np.empty(3)
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    whole = np.sqrt(x * x + y * y + z * z)
    wide = limit + whole / (_SAMPLES - 1) / 2  # between samples it may be less by so much
    best, last = np.inf, to_surface(bed, ground, a, wide, tried)
    if last < wide:
        best = last
        copy_row(tried, slope)
    last = to_surface(bed, ground, b, min(best, wide), tried)
    if last < min(best, wide):
        best, at = last, 1.0
        copy_row(tried, slope)
    for cut in range(_CUTS if whole > 0 else 0):
        step, middle = (high - low) / (_SAMPLES - 1), -1
        for k in range(_SAMPLES):
            t, most = low + step * k, min(best, wide)
            if cut and k == 2 and t == at:  # the least of before, between its two neighbours
                last = best + step * whole * k
                continue
            if k and last - step * whole * k >= most:
                continue
            p[0], p[1], p[2] = a[0] + t * x, a[1] + t * y, a[2] + t * z
            away = to_surface(bed, ground, p, most, tried)
            last = away + step * whole * k
            if away < most:
                best, at, middle = away, t, k
                copy_row(tried, slope)
        low, high = max(at - step, 0.0), min(at + step, 1.0)
        if not best < wide or (middle < 0 and step * whole < _TOUCHING):
            break
    return best, at


@compiled
def measure_bed(bed: Array, ground: Array, points: Array, distance: Array, slope: Array) -> None:
    """Signed distances of points, shape (R, 3), and their gradients, shape (R, 3)."""
    for i in range(len(points)):
        distance[i] = to_surface(bed, ground, points[i], np.inf, slope[i])
