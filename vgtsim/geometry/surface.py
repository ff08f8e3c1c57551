"""Distances to an uneven bed of waste, compiled.

A bed is a square grid of heights, shape (n, n), m; its ground is (x0, step, top, bottom): x and y of the first height, the
distance of heights, m, and the greatest and least height. Each cell is two triangles, on either side of the diagonal from its
first corner. Distances are exact for that surface, and negative below it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled

Array = NDArray[np.float64]

_TOUCHING = 1e-9  # m: nearer to the surface than this, up is the direction from it
_SAMPLES, _CUTS = 5, 5  # the place of least distance is then known within 1/64 of a member's length


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
def to_surface(bed: Array, ground: Array, p: Array, slope: Array) -> float:
    """Signed distance of a point, and its gradient, shape (3,): cells are looked at in rings about the point."""
    i, j, _, _ = _place(bed, ground, p[0], p[1])
    height, last, step = find_height(bed, ground, p[0], p[1]), len(bed) - 1, ground[1]
    best, over = np.inf, max(p[2] - ground[2], ground[3] - p[2], 0.0)
    foot, nearest, corners = np.empty(3), np.empty(3), np.empty((4, 3))
    for ring in range(last + 1):
        # a cell of this ring is at least so far away, sideways and up
        aside = max(ring - 1, 0) * step
        if aside * aside + over * over >= best:
            break
        for m in range(max(i - ring, 0), min(i + ring, last - 1) + 1):
            whole_row = abs(m - i) == ring
            for n in range(max(j - ring, 0), min(j + ring, last - 1) + 1):
                if not whole_row and abs(n - j) != ring:
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
                        best, nearest[:] = square, foot
    distance, sign = np.sqrt(best), 1.0 if p[2] >= height else -1.0
    slope[0], slope[1], slope[2] = 0.0, 0.0, 1.0
    if distance > _TOUCHING:
        for k in range(3):
            slope[k] = sign * (p[k] - nearest[k]) / distance
    return sign * distance


@compiled
def along_surface(bed: Array, ground: Array, a: Array, b: Array, limit: float, slope: Array) -> tuple[float, float]:
    """Least signed distance of a segment, and where on it, 0 to 1; with the gradient by that point, shape (3,).

    The distance changes by no more than the way along the segment: samples that cannot be less than a limit, or than the
    least one, are left out. It is infinite where it must be more than the limit.
    """
    p, low, high, at, tried = np.empty(3), 0.0, 1.0, 0.0, np.empty(3)
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    whole = np.sqrt(x * x + y * y + z * z)
    best, last = to_surface(bed, ground, a, slope), to_surface(bed, ground, b, tried)
    if (best + last - whole) / 2 > limit:
        return np.inf, 0.0
    if last < best:
        best, at, slope[:] = last, 1.0, tried
    for _ in range(_CUTS if whole > 0 else 0):
        step, middle = (high - low) / (_SAMPLES - 1), -1
        for k in range(_SAMPLES):
            t = low + step * k
            if k and last - step * whole * k >= min(best, limit):
                continue
            p[0], p[1], p[2] = a[0] + t * x, a[1] + t * y, a[2] + t * z
            away = to_surface(bed, ground, p, tried)
            last = away + step * whole * k
            if away <= best:
                best, at, middle, slope[:] = away, t, k, tried
        low, high = max(at - step, 0.0), min(at + step, 1.0)
        if middle < 0 and step * whole < _TOUCHING:
            break
    return best, at


@compiled
def measure_bed(bed: Array, ground: Array, points: Array, distance: Array, slope: Array) -> None:
    """Signed distances of points, shape (R, 3), and their gradients, shape (R, 3)."""
    for i in range(len(points)):
        distance[i] = to_surface(bed, ground, points[i], slope[i])
