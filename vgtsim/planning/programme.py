"""Rows of a programme: parts of a leg put one after the other, stopped on their own path, and going on from there.

Where they are stopped or go on the speed along the path falls, or rises, by a fifth-order smooth step. A place on rows is their
number, which need not be whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array

ROUNDING = 1e-9  # m of the feed at the end of a way
_SOONEST = 0.2  # s: the shortest stop that is tried
_LONGER = 1.15  # the next one that is tried
_BEFORE = 6  # rows before the stop that its spline goes through, too: its ends are less true than its middle
_ALREADY = 1e-12  # m in a step: a cylinder that goes no farther stands, as rounding moves it as much


class ProgrammeRows(NamedTuple):
    """Actuator lengths, shape (T, J), m, and what else changes, shape (T,): feed, m, turn, rad, `tool`, its share of power."""

    lengths: Array
    feed: Array | None = None
    turn: Array | None = None
    tool: Array | None = None


def read_height(feed: Array | None) -> float:
    """Height of the mast above its working depth at the last of some rows, m; 0 there but for rounding, and without a feed."""
    height = 0.0 if feed is None else float(feed[-1])
    return height if abs(height) > ROUNDING else 0.0


def join_rows(parts: Sequence[tuple[ProgrammeRows, float]]) -> ProgrammeRows:
    """Rows of the parts of a leg one after the other, each with the turn of the mast, rad, where it does not change.

    In a part without a feed the mast stands at its working depth, and in one without a share the tool rests.
    """

    def join(name: str, still: Sequence[float]) -> Array | None:
        found = [getattr(rows, name) for rows, _ in parts]
        if all(item is None for item in found):
            return None
        each = zip(found, still, parts, strict=True)
        return _chain([np.full(len(rows.lengths), rest) if item is None else item for item, rest, (rows, _) in each])

    rest = [0.0] * len(parts)
    return ProgrammeRows(
        lengths=_chain([rows.lengths for rows, _ in parts]),
        feed=join("feed", rest),
        turn=join("turn", [turn for _, turn in parts]),
        tool=join("tool", rest),
    )


def _chain(parts: Sequence[Array]) -> Array:
    """Parts one after the other, each of which begins where the one before ends."""
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


class PacedRows(NamedTuple):
    """Rows, shape (T, C), m, and their places on the rows that they are made of, shape (T,)."""

    rows: Array
    places: Array


def stop_rows(rows: Array, row: int, timestep: float, acceleration: float) -> PacedRows:
    """Rows of lengths, shape (T, C), m, up to a row, and on along the same path to rest, the soonest that an acceleration allows.

    A stop that takes longer than the rest of the path ends with it.
    """
    ahead, before = len(rows) - 1 - row, np.arange(row + 1.0)
    if row == 0 or np.abs(rows[row] - rows[row - 1]).max() < _ALREADY:
        return PacedRows(rows[: row + 1], before)
    path = _spline(rows, row)
    count = max(int(np.ceil(_SOONEST / timestep)), 2)
    while count / 2 <= ahead:
        part = np.arange(1, count + 1) / count
        places = row + count * (part - 2.5 * part**4 + 3 * part**5 - part**6)
        found = np.concatenate([rows[: row + 1], path(places)])
        if _ask(found[max(row - 1, 0) :], timestep) <= acceleration:
            return PacedRows(found, np.concatenate([before, places]))
        count = int(np.ceil(_LONGER * count))
    return PacedRows(rows, np.arange(float(len(rows))))


def go_on_rows(rows: Array, place: float, timestep: float, acceleration: float) -> PacedRows:
    """Rows of lengths, shape (T, C), m, from rest at a place of them, which is left out, to their end.

    The speed comes back to that of the rows as soon as an acceleration allows. Twice the place is a whole number.
    """
    last, row = len(rows) - 1, int(place)
    if row == place and (row == last or np.abs(rows[row + 1] - rows[row]).max() < _ALREADY):
        return PacedRows(rows[row + 1 :], np.arange(row + 1.0, last + 1))
    path = _spline(rows, row)
    here = np.tile(path(place), (2, 1))
    count = max(int(np.ceil(_SOONEST / timestep)), 2)
    while True:
        count += int(2 * place + count) % 2  # so that the rise ends on a row
        part, end = np.arange(1, count + 1) / count, place + count / 2
        if end <= last:
            places = place + count * (2.5 * part**4 - 3 * part**5 + part**6)
            tail = np.arange(end + 1, last + 1)
        else:
            places, tail = place + (last - place) * (10 * part**3 - 15 * part**4 + 6 * part**5), np.zeros(0)
        found = np.concatenate([path(places), rows[tail.astype(int)]])
        if _ask(np.concatenate([here, found[: count + 2]]), timestep) <= acceleration:
            return PacedRows(found, np.concatenate([places, tail]))
        count = int(np.ceil(_LONGER * count))


def _spline(rows: Array, row: int):  # noqa: ANN202 - scipy is loaded late
    """Rows from a little before one as a spline over their numbers."""
    from scipy.interpolate import make_interp_spline  # slow to load, and few runs need it

    first = max(row - _BEFORE, 0)
    return make_interp_spline(np.arange(first, len(rows)), rows[first:], k=min(5, len(rows) - first - 1))


def _ask(rows: Array, timestep: float) -> float:
    """Greatest acceleration of rows."""
    return float(np.abs(np.diff(rows, n=2, axis=0)).max() / timestep**2)
