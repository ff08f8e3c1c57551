"""Goals of an operator: read from outside, and met by a posture that is solved at once, which may take seconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.commands import read_row
from vgtsim.constants import Method
from vgtsim.errors import CommandError
from vgtsim.planning import make_problem
from vgtsim.positioning import solve_by_method, tool_goal
from vgtsim.site import Site

_UNIT = 1e-3  # of a direction: a shorter one is none


def read_goal_pose(values: ArrayLike) -> Array:
    """A pose of the tool, shape (6,) or (2, 3), with its direction made a unit vector.

    Raises:
        CommandError: The size is wrong, something is not finite, or the direction is zero.
    """
    try:
        whole = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise CommandError("goal", repr(values), "6 numbers") from None
    pose = read_row("goal", whole.ravel() if whole.shape == (2, 3) else whole, 6)
    size = float(np.linalg.norm(pose[3:]))
    if size < _UNIT:
        raise CommandError("goal", f"a direction of length {size:g}", "a direction that is not zero")
    return np.concatenate([pose[:3], pose[3:] / size])


def find_posture(site: Site, goal: ArrayLike, near: Array, objective: Sequence[str]) -> Array:
    """Lengths of the cylinders, shape (J,), m, of a posture clear of everything with the tool at a goal, see `read_goal_pose`.

    It is looked for near inputs of shape (n,), with the terms of an objective, or without any in mid-stroke. A goal out of reach
    takes seconds to be found so.

    Raises:
        CommandError: The goal is none.
        DescriptionError: A term of the objective is not known.
        ReachError: The goal cannot be met.
    """
    pose = read_goal_pose(goal)
    terms = tuple(objective) or ("mid_stroke",)
    problem = make_problem(site, tool_goal(pose[:3], pose[3:]), Method.NULLSPACE, terms)
    return np.asarray(site.chain.lengths(solve_by_method("command", problem, near).q))
