"""Curvature of clearance hinges that Gauss and Newton leave out.

A goal near a wall holds the tool, and with it the hinges of the last nodes: their slopes are then balanced by the
multipliers of the goal rows, and so must their curvatures be, or steps along the null space look far too long.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.positioning.objectives import Clearance, Configurations, Objective, WeightedSum

Array = NDArray[np.float64]

_STEP = 1e-6


def hinge_curvature(objective: Objective, at: Configurations) -> Array | float:
    """What the curvature of an objective's clearance hinges has beyond the known part.

    Args:
        objective: Any; only `Clearance`, alone or in a sum, has hinges.
        at: Configurations.

    Returns:
        Shape (b, n, n), symmetric, not definite, by one-sided differences of closed-form slopes; or zero.
    """
    if isinstance(objective, WeightedSum):
        return sum((weight * hinge_curvature(part, at) for weight, part in objective.parts), 0.0)
    if not isinstance(objective, Clearance):
        return 0.0
    first = objective.terms(at)
    assert first.dense is not None
    found, used = np.zeros_like(first.dense), np.flatnonzero(first.value > 0)
    if not len(used):
        return found
    shift = _STEP * np.eye(first.slope.shape[1])
    moved = (at.state.q[used, None] + shift).reshape(-1, len(shift))
    there = replace(at, state=at.kernel.state(moved), which=np.repeat(at.which[used], len(shift)))
    slope = objective.terms(there).slope.reshape(len(used), len(shift), -1)
    found[used] = (slope - first.slope[used, None]) / _STEP - first.dense[used]
    return (found + np.swapaxes(found, 1, 2)) / 2
