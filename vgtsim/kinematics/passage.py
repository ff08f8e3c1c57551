"""The passage that an open truss leaves for a line along its axis: section 1.2.2 and figure 1.6.

The line runs through the middles of the faces and leaves each at right angles. In a module that bends a hose lies in an arc, and
two stiff screws meet in a universal joint, where the normals of both faces do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.geometry import find_between
from vgtsim.kinematics.truss import Truss
from vgtsim.kinematics.vectors import cross

_HALF = 0.5  # of the pieces lie on either side of a joint
_STRAIGHT = 1e-9  # rad between faces that count as parallel


@dataclass(frozen=True)
class Axis:
    """The axis through the faces in T postures, K modules. Vectors are in frame G.

    Attributes:
        places, normals: Middles of the faces and their unit normals, shape (T, K + 1, 3), m.
        angle: Between the faces of each module, shape (T, K), rad.
        bend: Its direction, about which the upper normal turns to the lower one, shape (T, K, 3), unit; zero where the faces
            are parallel.
        length: Of the arc between the faces, shape (T, K), m.
    """

    places: Array
    normals: Array
    angle: Array
    bend: Array
    length: Array

    @property
    def radius(self) -> Array:
        """Radius of each module's arc, shape (T, K), m; infinite where the faces are parallel."""
        bent = self.angle > _STRAIGHT
        return np.where(bent, self.length / np.where(bent, self.angle, 1.0), np.inf)

    def make_corners(self, *, jointed: bool) -> Array:
        """Where the line turns in each module, shape (T, K, 3), m: the joint of two screws, or the middle of a hose's arc."""
        first, last = self.normals[:, :-1], self.normals[:, 1:]
        half = self.angle[..., None] / 2
        span = np.linalg.norm(np.diff(self.places, axis=1), axis=-1, keepdims=True)
        # along either normal to their crossing, or, in the mean of both ways, half as far beyond the chord as that
        reach = span / 2 * (1 / np.cos(half) if jointed else np.tan(half / 2) / np.sin(np.maximum(half, _STRAIGHT)))
        return (self.places[:, :-1] + self.places[:, 1:] + reach * (first - last)) / 2


def trace_line(axis: Axis, count: int, *, jointed: bool) -> Array:
    """Points along the line for pictures, shape (T, P, 3), m: the ends of `count` pieces in each module.

    A hose's arc is drawn as the parabola with the same tangents at both faces.
    """
    first, last = axis.places[:, :-1, None], axis.places[:, 1:, None]
    corner = axis.make_corners(jointed=True)[:, :, None]
    part = np.linspace(0.0, 1.0, count + 1)[1:, None]
    if jointed:
        points = np.where(
            part < _HALF, first + (corner - first) * part / _HALF, corner + (last - corner) * (part / _HALF - 1)
        )
    else:
        points = (1 - part) ** 2 * first + 2 * part * (1 - part) * corner + part**2 * last
    return np.concatenate([axis.places[:, :1], points.reshape(len(first), -1, 3)], axis=1)


def find_axis(truss: Truss, nodes: Array) -> Axis:
    """The axis at nodes of shape (T, N, 3), m."""
    corner = nodes[:, truss.faces]
    normals = cross(corner[:, :, 0] - corner[:, :, 2], corner[:, :, 1] - corner[:, :, 2])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    places = corner.mean(axis=2)
    turn = cross(normals[:, :-1], normals[:, 1:])
    size = np.linalg.norm(turn, axis=-1)
    angle = np.arctan2(size, np.sum(normals[:, :-1] * normals[:, 1:], axis=-1))
    chord = np.linalg.norm(np.diff(places, axis=1), axis=-1)
    bent = size > _STRAIGHT
    length = np.where(bent, chord * (angle / 2) / np.sin(np.where(bent, angle / 2, 1.0)), chord)
    bend = np.where(bent, 1 / np.where(bent, size, 1.0), 0.0)[..., None] * turn
    return Axis(places, normals, angle, bend, length)


def measure_passage(truss: Truss, radii: Array, nodes: Array, *, jointed: bool = False) -> Array:
    """Diameter of the widest line that each member leaves room for, shape (T, M), m; infinite for members far along the arm.

    Members have radii, shape (M,), m; nodes have shape (T, N, 3), m.
    """
    axis = find_axis(truss, nodes)
    line = np.empty((len(nodes), 2 * len(truss.faces) - 1, 3))
    line[:, ::2], line[:, 1::2] = axis.places, axis.make_corners(jointed=jointed)
    free = np.full((len(nodes), len(truss.ends)), np.inf)
    _measure(np.array(truss.ends), np.array(truss.module), by_rows(radii), by_rows(nodes), line, free)
    return free


@compiled
def _measure(ends: Index, module: Index, radii: Array, nodes: Array, line: Array, free: Array) -> None:
    """Widest lines beside members, shape (T, M): each is held against the line in its module and in both neighbours."""
    for t in range(len(nodes)):
        for m in range(len(ends)):
            a, b = nodes[t, ends[m, 0]], nodes[t, ends[m, 1]]
            first, last = max(2 * (module[m] - 1), 0), min(2 * (module[m] + 2), line.shape[1] - 1)
            for k in range(first, last):
                gap = 2 * (find_between(a, b, line[t, k], line[t, k + 1])[0] - radii[m])
                free[t, m] = min(free[t, m], gap)
