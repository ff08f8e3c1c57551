"""Long logs in stretches: memory stays that of a stretch, however long the run was."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Mask
from vgtsim.log.book import LogBook
from vgtsim.log.runlog import BESIDE, RunLog

_LENGTH = 3000  # records: two minutes of a shipped scene, of which verification makes some 200 MB
_OVERVIEW = 6000  # records: what plots can show, and some more

LogSource = RunLog | LogBook  # in memory or on disk


@dataclass(frozen=True)
class Hold:
    """A settled stay at the goal of an index, from its first to its last record, and from start to end, s."""

    goal: int
    first: int
    last: int
    start: float
    end: float


@dataclass(frozen=True)
class Outline:
    """The little that several checks must know of the whole run, T records.

    Attributes:
        time, goal, settled, saturation: As in `RunLog`; saturation in one byte each.
        commanded: Lengths of the cylinders at the first record, shape (J,), m.
    """

    time: Array
    goal: NDArray[np.int64]
    settled: Mask
    saturation: NDArray[np.uint8]
    commanded: Array

    @property
    def holds(self) -> tuple[Hold, ...]:
        """The unbroken settled stretches at one goal each, in order."""
        key = np.where(self.settled, self.goal, -1)
        edges = np.flatnonzero(np.diff(key)) + 1
        starts, ends = np.append(0, edges).tolist(), np.append(edges - 1, len(key) - 1).tolist()
        return tuple(
            Hold(goal=int(key[i]), first=i, last=j, start=float(self.time[i]), end=float(self.time[j]))
            for i, j in zip(starts, ends, strict=True)
            if key[i] >= 0
        )


@dataclass(frozen=True)
class LogStretch:
    """Records of a log, `first` of which is that of the run; `wide` has some records on either side as well.

    `inner` is where the records stand in the wide ones.
    """

    log: RunLog
    wide: RunLog
    first: int
    inner: slice


def cut(source: LogSource) -> Iterator[LogStretch]:
    """Cut a log into stretches of about equal lengths; a short log is one."""
    count = source.count
    edges = np.linspace(0, count, max(-(-count // _LENGTH), 1) + 1).astype(int).tolist()
    for first, stop in pairwise(edges):
        low = max(first - BESIDE, 0)
        wide = source.read(low, min(stop + BESIDE, count))
        inner = slice(first - low, stop - low)
        yield LogStretch(log=wide.read(inner.start, inner.stop), wide=wide, first=first, inner=inner)


def outline(source: LogSource) -> Outline:
    """Read a log for its outline."""
    logs = (stretch.log for stretch in cut(source))  # of which views would keep all that is read: so copies are made
    read = [(log.time.copy(), log.goal.copy(), log.settled.copy(), log.saturation.astype(np.uint8)) for log in logs]
    time, goal, settled, saturation = (np.concatenate(parts) for parts in zip(*read, strict=True))
    return Outline(time, goal, settled, saturation, commanded=source.read(0, 1).commanded[:1].sum(axis=0))


def thinning(source: LogSource) -> int:
    """Every how many records one is kept for plots, film and tables of a long run."""
    return max(-(-source.count // _OVERVIEW), 1)


def thin(source: LogSource) -> RunLog:
    """Every so many records of a log, few enough for plots; all of a short one."""
    return source.read(0, source.count, thinning(source))
