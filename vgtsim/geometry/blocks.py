"""Convex solids that stand in the tank, compiled: boxes and the parts of meshes, and how far a member is from them.

Positions are in frame G, m. The distance of a segment from a solid is exact; inside it is negative, and its size is the
shortest way by which the segment leaves the solid.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.geometry.segments import TOUCHING, copy_row, find_between
from vgtsim.geometry.surface import to_triangle

_FLAT = 1e-9  # between the directions of faces that are one face


class Blocks(NamedTuple):
    """B convex solids; compiled functions take it as it is.

    Attributes:
        owner: Index of the named thing that each is a part of, shape (B,).
        balls: Centre and radius of a ball about each, shape (B, 4), m.
        planes: Outward unit normals and heights of the faces, shape (F, 4).
        corners: Shape (V, 3), m.
        edges: Corners of each edge, shape (E, 2).
        triangles: Corners of each triangle of the faces, shape (T, 3).
        begin: Where planes, corners, edges and triangles of each begin, shape (B + 1, 4).
    """

    owner: Index
    balls: Array
    planes: Array
    corners: Array
    edges: Index
    triangles: Index
    begin: Index


def make_blocks(hulls: Sequence[tuple[int, Array]]) -> Blocks:
    """Solids from their owners and corners, shape (K, 3), m: each is the convex hull of its corners."""
    from scipy.spatial import ConvexHull  # slow to load, and only boxes and meshes need it

    owner = np.array([item for item, _ in hulls], np.intp)
    balls, planes, corners = np.empty((len(hulls), 4)), [np.empty((0, 4))], [np.empty((0, 3))]
    edges, triangles = [np.empty((0, 2), np.intp)], [np.empty((0, 3), np.intp)]
    begin = np.zeros((len(hulls) + 1, 4), np.intp)
    for k, (_, points) in enumerate(hulls):
        hull = ConvexHull(points)
        kept = np.sort(hull.vertices)
        place = np.full(len(points), -1)
        place[kept] = np.arange(len(kept)) + begin[k, 1]
        middle = (points[kept].min(axis=0) + points[kept].max(axis=0)) / 2
        balls[k] = *middle, np.linalg.norm(points[kept] - middle, axis=1).max()
        faces, sharp = hull.equations, []
        for one, row in enumerate(hull.neighbors):
            for side, other in enumerate(row):
                if one < other and faces[one, :3] @ faces[other, :3] < 1 - _FLAT:
                    sharp.append(np.delete(hull.simplices[one], side))
        flat = np.unique(np.round(faces, 12), axis=0) * [1, 1, 1, -1]
        planes.append(flat)
        corners.append(points[kept])
        edges.append(place[np.array(sharp, np.intp).reshape(-1, 2)])
        triangles.append(place[hull.simplices])
        begin[k + 1] = begin[k] + [len(flat), len(kept), len(sharp), len(hull.simplices)]
    return Blocks(
        owner=owner,
        balls=balls,
        planes=np.concatenate(planes),
        corners=np.concatenate(corners),
        edges=np.concatenate(edges).astype(np.intp),
        triangles=np.concatenate(triangles).astype(np.intp),
        begin=begin,
    )


@compiled
def to_block(blocks: Blocks, k: int, a: Array, b: Array, limit: float, slope: Array) -> tuple[float, float]:
    """Signed distance of a segment from a solid, and where on the segment, 0 to 1, with its gradient by that point.

    It is infinite where it must be at least a limit.
    """
    ball = blocks.balls[k]
    if find_between(a, b, ball[:3], ball[:3])[0] - ball[3] >= limit:
        return np.inf, 0.0
    low, high = 0.0, 1.0
    for f in range(blocks.begin[k, 0], blocks.begin[k + 1, 0]):
        n = blocks.planes[f]
        first = n[0] * a[0] + n[1] * a[1] + n[2] * a[2] - n[3]
        last = n[0] * b[0] + n[1] * b[1] + n[2] * b[2] - n[3]
        if min(first, last) >= limit:
            return np.inf, 0.0
        if first > 0 and last > 0:
            high = -1.0
        elif first > 0:
            low = max(low, first / (first - last))
        elif last > 0:
            high = min(high, first / (first - last))
    if low <= high:
        return _leave(blocks, k, a, b, slope)
    return _approach(blocks, k, a, b, slope)


@compiled
def _approach(blocks: Blocks, k: int, a: Array, b: Array, slope: Array) -> tuple[float, float]:
    """As `to_block`, of a segment outside: from its ends to the faces and from its length to the edges."""
    best, at, foot = np.inf, 0.0, np.empty(3)
    corners = blocks.corners
    for r in range(blocks.begin[k, 3], blocks.begin[k + 1, 3]):
        i, j, m = blocks.triangles[r]
        for end in range(2):
            p = b if end else a
            square = to_triangle(p, corners[i], corners[j], corners[m], foot)
            if square < best * best:
                best, at = np.sqrt(square), float(end)
                for axis in range(3):
                    slope[axis] = p[axis] - foot[axis]
    for r in range(blocks.begin[k, 2], blocks.begin[k + 1, 2]):
        c, d = corners[blocks.edges[r, 0]], corners[blocks.edges[r, 1]]
        away, s, t = find_between(a, b, c, d)
        if away < best:
            best, at = away, s
            for axis in range(3):
                slope[axis] = a[axis] + s * (b[axis] - a[axis]) - c[axis] - t * (d[axis] - c[axis])
    slope /= max(best, TOUCHING)
    return best, at


@compiled
def _leave(blocks: Blocks, k: int, a: Array, b: Array, slope: Array) -> tuple[float, float]:
    """As `to_block`, of a segment that is in the solid: the least way out is along a face, or across an edge and the segment."""
    best, at, along, n = np.inf, 0.0, b - a, np.empty(3)
    first, last = blocks.begin[k], blocks.begin[k + 1]
    for f in range(first[0], last[0]):
        plane = blocks.planes[f]
        one = plane[0] * a[0] + plane[1] * a[1] + plane[2] * a[2]
        other = plane[0] * b[0] + plane[1] * b[1] + plane[2] * b[2]
        if plane[3] - min(one, other) < best:
            best, at = plane[3] - min(one, other), 0.0 if one <= other else 1.0
            copy_row(plane, slope)
    for r in range(first[2], last[2]):
        c, d = blocks.corners[blocks.edges[r, 0]], blocks.corners[blocks.edges[r, 1]]
        u, v, w = d[0] - c[0], d[1] - c[1], d[2] - c[2]
        n[0], n[1], n[2] = v * along[2] - w * along[1], w * along[0] - u * along[2], u * along[1] - v * along[0]
        size = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        if size < TOUCHING:
            continue
        for side in range(2):
            far, scale = -np.inf, (1.0 if side else -1.0) / size
            for q in range(first[1], last[1]):
                p = blocks.corners[q]
                far = max(far, scale * (n[0] * p[0] + n[1] * p[1] + n[2] * p[2]))
            way = far - scale * (n[0] * a[0] + n[1] * a[1] + n[2] * a[2])
            here = scale * (n[0] * c[0] + n[1] * c[1] + n[2] * c[2])
            if way < best and here > far - TOUCHING:  # no corner is beyond this edge
                best, at = way, find_between(a, b, c, d)[1]
                slope[0], slope[1], slope[2] = scale * n[0], scale * n[1], scale * n[2]
    return -best, at
