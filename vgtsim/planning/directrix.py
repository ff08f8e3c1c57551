"""The path that an arm's leader takes into the tank: straight down from the riser, then arcs, in one vertical plane.

Points are (r, z) as in `kinematics.planar_arm`. A curve has pieces of constant curvature. It begins far above on the mast's axis,
and after its last piece it goes straight on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled

_FAR = 1e3  # m: length of the straight parts at both ends
_STRAIGHT = 1e-9  # 1/m: curvature below which a piece is straight


@dataclass(frozen=True, eq=False)
class LeadCurve:
    """Pieces of lengths, m, and curvatures, 1/m, each shape (P,), straight parts at both ends included.

    `start` are the points (r, z) where pieces begin, shape (P, 2), m, and `heading` the headings there, shape (P,), rad, from
    straight down; a positive curvature turns towards +r.
    """

    length: Array
    curvature: Array
    start: Array
    heading: Array

    @property
    def foot(self) -> float:
        """Height of the end of the straight part below the riser, m."""
        return float(self.start[1, 1])

    def at(self, arc: ArrayLike) -> tuple[Array, Array]:
        """Points, shape (..., 2), m, and headings, shape (...), rad, at arc lengths from the foot, shape (...), m."""
        s = np.asarray(arc, float)
        begin = np.cumsum(self.length) - self.length - self.length[0]
        k = np.clip(np.searchsorted(begin, s, side="right") - 1, 0, len(begin) - 1)
        part, bend = s - begin[k], self.curvature[k]
        heading = self.heading[k] + bend * part
        middle, turn = self.heading[k] + bend * part / 2, bend * part / 2
        chord = part * np.sinc(turn / np.pi)
        return self.start[k] + chord[..., None] * np.stack([np.sin(middle), -np.cos(middle)], axis=-1), heading

    def offsets(self, points: Array) -> tuple[Array, Array]:
        """Signed distances of points (r, z), shape (..., 2), m, from the curve, and their gradients, shape (..., 2).

        They are positive on the side of +r of a curve that runs down.
        """
        least, normal = np.full(points.shape[:-1], np.inf), np.zeros(points.shape)
        aside = np.stack([np.cos(self.heading), np.sin(self.heading)], axis=-1)
        across = np.stack([(points - start) @ way for start, way in zip(self.start, aside, strict=True)])
        figures = self.start, aside, self.curvature, self.length, across.reshape(len(aside), -1)
        measure_offsets(*figures, by_rows(points.reshape(-1, 2)), least.reshape(-1), normal.reshape(-1, 2))
        return least, normal


@compiled
def measure_offsets(
    starts: Array,
    asides: Array,
    bends: Array,
    lengths: Array,
    across: Array,
    points: Array,
    least: Array,
    normal: Array,
) -> None:
    """Write distances and gradients of `LeadCurve.offsets`, shape (R,) and (R, 2), that begin infinite and zero.

    Given are pieces with their directions aside at the begin, shape (P, 2), and the points' distances across those, (P, R), m.
    """
    for k in range(len(starts)):
        (cos, sin), bend, slack = asides[k], bends[k], 1e-9 * max(1.0, lengths[k])
        straight, side = abs(bend) < _STRAIGHT, np.sign(bend)
        for i in range(len(points)):
            x, y, radius, off = points[i, 0] - starts[k, 0], points[i, 1] - starts[k, 1], 1.0, across[k, i]
            if not straight:
                x, y = x - cos / bend, y - sin / bend
                radius = max(np.sqrt(x * x + y * y), 1e-12)
                off = 1 / bend - side * radius
            if not abs(off) < abs(least[i]):
                continue
            along = x * sin - y * cos
            if not straight:
                along = np.arctan2(along, -(x * cos + y * sin) * side) / abs(bend)
            if along >= -slack and along <= lengths[k] + slack:
                least[i] = off
                normal[i, 0], normal[i, 1] = (cos, sin) if straight else (-side * x / radius, -side * y / radius)


def make_directrix(foot: float, pieces: Sequence[tuple[float, float]]) -> LeadCurve:
    """Lay out a curve: straight down to the height `foot`, m, then pieces (length, m, and curvature, 1/m), then straight on."""
    length = np.array([_FAR, *(size for size, _ in pieces), _FAR])
    curvature = np.array([0.0, *(bend for _, bend in pieces), 0.0])
    heading = np.concatenate([[0.0], np.cumsum(length * curvature)[:-1]])
    middle, turn = heading + length * curvature / 2, length * curvature / 2
    chords = (length * np.sinc(turn / np.pi))[:, None] * np.stack([np.sin(middle), -np.cos(middle)], axis=-1)
    start = np.concatenate([[[0.0, foot + _FAR]], [0.0, foot + _FAR] + np.cumsum(chords, axis=0)[:-1]])
    return LeadCurve(length, curvature, start, heading)


@dataclass(frozen=True, eq=False)
class Leader:
    """A directrix in its vertical plane, which an arm follows on its way in or out.

    Attributes:
        foot: A point of the mast's axis, shape (3,), m, at z = 0 of frame G; `level` is the level direction of the plane, shape
            (3,), unit.
        deviation: Greatest distance of the axis from it in the plan, m; `bound` is the least that any posture can have.
    """

    directrix: LeadCurve
    foot: Array
    level: Array
    deviation: float
    bound: float

    def measure(self, points: Array) -> Array:
        """Distances of points of frame G, shape (..., 3), m, from the path, shape (...), m; across the plane too."""
        away = points - self.foot
        r, across = away @ self.level, np.cross(self.level, [0.0, 0.0, 1.0])
        off, _ = self.directrix.offsets(np.stack([r, points[..., 2]], axis=-1))
        return np.hypot(off, away @ across)


@dataclass(frozen=True, eq=False)
class LeaderPair:
    """Paths of an arm that goes back on one and on along another: it has to be near either."""

    first: Leader | LeaderPair
    second: Leader

    @property
    def deviation(self) -> float:
        """The greater of the planned distances, m."""
        return max(self.first.deviation, self.second.deviation)

    @property
    def bound(self) -> float:
        """The greater of the least distances that a posture can have, m."""
        return max(self.first.bound, self.second.bound)

    def measure(self, points: Array) -> Array:
        """Distances of points of frame G, shape (..., 3), m, from the nearer path, shape (...), m."""
        return np.minimum(self.first.measure(points), self.second.measure(points))
