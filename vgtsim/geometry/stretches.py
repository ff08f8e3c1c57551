"""A path of the tool as smooth stretches, each run from rest to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import ArcPiece, LinePiece, RasterPiece, SplinePiece, ToolPath
from vgtsim.errors import DescriptionError

_NOWHERE = 1e-6  # m or rad: shorter ways are none
_CHORDS = 2**14  # of a stretch: 1 mm of the longest way in a tank
_LOOKED = 17  # points of a piece that must not all be one


@dataclass(frozen=True)
class Stretch:
    """A smooth part of a path, run from rest to rest, with its first and last unit tool directions, shape (3,).

    `points` makes, from a count, that many tool points at equal steps of the parameter, shape (count, 3), m.
    """

    name: str
    points: Callable[[int], Array]
    first: Array
    last: Array

    def directions(self, count: int) -> Array:
        """Tool directions at equal steps of the parameter, turned evenly, shape (count, 3), unit."""
        return self.turn(np.linspace(0.0, 1.0, count))

    def turn(self, part: Array) -> Array:
        """Tool directions at parts of the way, shape (P,), unit, shape (P, 3)."""
        part = part[:, None]
        angle = float(np.arctan2(np.linalg.norm(np.cross(self.first, self.last)), self.first @ self.last))
        if angle < 1e-9:
            return np.tile(self.first, (len(part), 1))
        return (np.sin((1 - part) * angle) * self.first + np.sin(part * angle) * self.last) / np.sin(angle)


def make_stretches(path: ToolPath) -> tuple[Stretch, ...]:
    """The smooth parts of a path; a raster's rows and the ways between them each count as one.

    Raises:
        DescriptionError: A piece turns the tool to the opposite direction or goes nowhere, or a way-point stands where
            the last one does.
    """
    at, along = np.array(path.start), np.array(path.direction) / np.linalg.norm(path.direction)
    found: list[Stretch] = []
    for number, piece in enumerate(path.pieces):
        name = f"{piece.shape} {number + 1}"
        if isinstance(piece, RasterPiece):
            across, deep = np.array(piece.width), np.array(piece.depth) / (piece.rows - 1)
            for row in range(piece.rows):
                way = across if row % 2 == 0 else -across
                found.append(Stretch(f"{name}, row {row + 1}", _line(at, at + way), along, along))
                at = at + way
                if row < piece.rows - 1:
                    found.append(Stretch(f"{name}, to row {row + 2}", _line(at, at + deep), along, along))
                    at = at + deep
            continue
        last = along if piece.direction is None else np.array(piece.direction) / np.linalg.norm(piece.direction)
        if along @ last < -1 + 1e-6:
            allowed = "a direction that is not opposite to the one before: the way to it is not defined"
            raise DescriptionError(None, f"pieces.{number}.direction", str(piece.direction), allowed)
        points = _points(piece, at, number)
        still = np.ptp(points(_LOOKED), axis=0).max() < _NOWHERE
        if still and np.linalg.norm(np.cross(along, last)) < _NOWHERE:
            allowed = "a piece that moves or turns the tool"
            raise DescriptionError(None, f"pieces.{number}", f"a {piece.shape} that goes nowhere", allowed)
        found.append(Stretch(name, points, along, last))
        at, along = points(2)[-1], last
    return tuple(found)


def find_nearest(stretches: Sequence[Stretch], points: Array) -> Array:
    """Nearest points of a path, m, and unit tool directions there, shape (T, 6), for points of shape (T, 3), m.

    A path is taken for chords between closely spaced points: off an arc of 10 m by less than 1e-7 m.
    """
    from scipy.spatial import KDTree  # slow to load, and only a path needs it

    best, found = np.full(len(points), np.inf), np.empty((len(points), 6))
    part = np.arange(_CHORDS + 1) / _CHORDS
    for stretch in stretches:
        corners = stretch.points(_CHORDS + 1)
        near = KDTree(corners).query(points)[1]
        for first in (np.maximum(near - 1, 0), np.minimum(near, _CHORDS - 1)):  # the chords on either side
            chord = corners[first + 1] - corners[first]
            along = np.sum((points - corners[first]) * chord, axis=1) / np.maximum(
                np.sum(chord**2, axis=1), _NOWHERE**4
            )
            along = np.clip(along, 0, 1)[:, None]
            place = corners[first] + along * chord
            apart = np.linalg.norm(points - place, axis=1)
            better = apart < best
            best[better] = apart[better]
            turned = stretch.turn(part[first] + along[:, 0] / _CHORDS)
            found[better] = np.concatenate([place, turned], axis=1)[better]
    return found


def _line(first: Array, last: Array) -> Callable[[int], Array]:
    return lambda count: line(first, last, count)


def _points(piece: LinePiece | ArcPiece | SplinePiece, at: Array, number: int) -> Callable[[int], Array]:
    if isinstance(piece, LinePiece):
        return _line(at, np.array(piece.to))
    if isinstance(piece, ArcPiece):
        return lambda count: arc(piece.centre, at, piece.axis, piece.angle, count)
    through = np.array([at, *piece.through])
    if np.min(np.linalg.norm(np.diff(through, axis=0), axis=1)) < _NOWHERE:
        raise DescriptionError(None, f"pieces.{number}.through", "a way-point twice in a row", "way-points that differ")
    return lambda count: spline(through, count)


def line(first: ArrayLike, last: ArrayLike, count: int) -> Array:
    """Points of a straight line, shape (count, 3), m, between points of shape (3,)."""
    part = np.linspace(0, 1, count)[:, None]
    return (1 - part) * np.asarray(first, float) + part * np.asarray(last, float)


def arc(centre: ArrayLike, start: ArrayLike, axis: ArrayLike, angle: float, count: int) -> Array:
    """Points of a circular arc, shape (count, 3), m, from a start about an axis through a centre, shape (3,), by rad."""
    middle, out = np.asarray(centre, float), np.asarray(start, float) - np.asarray(centre, float)
    normal = np.asarray(axis, float) / np.linalg.norm(axis)
    turn = np.linspace(0, angle, count)[:, None]
    along = (out @ normal) * normal
    return middle + along + np.cos(turn) * (out - along) + np.sin(turn) * np.cross(normal, out)


def spline(points: ArrayLike, count: int) -> Array:
    """Points of a cubic spline through way-points, shape (W, 3), m, at equal steps of the parameter, shape (count, 3), m.

    The parameter is the distance from one way-point to the next; no two in a row are the same, and W is at least 2.
    """
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    through = np.asarray(points, float)
    reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
    curve = make_interp_spline(reach, through, k=min(3, len(through) - 1))
    return curve(np.linspace(0.0, reach[-1], count))
