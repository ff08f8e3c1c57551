"""The settled stays at the goals: when they were, and at which goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.runlog import RunLog
from vgtsim.site import Site


@dataclass(frozen=True)
class Hold:
    """A settled stay at a goal.

    Attributes:
        goal: Index of the goal.
        first: Index of its first record.
        last: Index of its last record.
        start: s.
        end: s.
    """

    goal: int
    first: int
    last: int
    start: float
    end: float


def find_holds(log: RunLog) -> tuple[Hold, ...]:
    """List the unbroken settled stretches at one goal each, in order."""
    key = np.where(log.settled, log.goal, -1)
    edges = np.flatnonzero(np.diff(key)) + 1
    starts, ends = np.append(0, edges), np.append(edges, len(key)) - 1
    return tuple(
        Hold(goal=int(key[i]), first=int(i), last=int(j), start=float(log.time[i]), end=float(log.time[j]))
        for i, j in zip(starts, ends, strict=True)
        if key[i] >= 0
    )


def goal_name(site: Site, index: int) -> str:
    """Name of a logged goal; empty for the index -1, which stands before the first goal."""
    goals = site.task.motion.goals
    return goals[index].name if 0 <= index < len(goals) else ""
