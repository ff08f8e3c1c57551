"""The settled stays at the goals: when they were, and how well the tool stood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.description import Scene
from vgtsim.runlog import RunLog


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
    """List the settled stays in order.

    Args:
        log: The run.

    Returns:
        One for each unbroken settled stretch at one goal.
    """
    key = np.where(log.settled, log.goal, -1)
    edges = np.flatnonzero(np.diff(key)) + 1
    starts, ends = np.append(0, edges), np.append(edges, len(key)) - 1
    return tuple(
        Hold(int(key[first]), int(first), int(last), float(log.time[first]), float(log.time[last]))
        for first, last in zip(starts, ends, strict=True)
        if key[first] >= 0
    )


def goal_name(scene: Scene, index: int) -> str:
    """Name of a logged goal.

    Args:
        scene: The scene.
        index: As logged; -1 before the first goal.

    Returns:
        The name, or an empty string where there is none.
    """
    goals = scene.task.motion.goals
    return goals[index].name if 0 <= index < len(goals) else ""
