"""Curvature of goal rows and of actuator lengths: what Gauss and Newton's model of the Lagrangian leaves out.

Between two modules it is a closed form: moving an input i nearer the base turns the velocity v_j that an input j
farther out gives, so the second derivative is omega_i x v_j. Within a module it is a difference of closed-form first
derivatives, all modules moved at once: three evaluations in all, whatever the number of modules.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.redundancy.goals import GoalSpace, Pull, pulls
from vgtsim.redundancy.kernel import Kernel, State, cross

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_STEP = 1e-5


def lagrangian_curvature(
    kernel: Kernel, goal: GoalSpace, state: State, which: Index, multipliers: Array, length_slope: Array
) -> Array:
    """Second derivative of the goal rows and lengths, weighted.

    Args:
        kernel: The arm.
        goal: Rows.
        state: Kinematics of b configurations inside the strokes.
        which: Goal of each, shape (b,).
        multipliers: Of the goal rows, shape (b, m).
        length_slope: Weights of the actuator lengths, shape (b, A, 3).

    Returns:
        Shape (b, 3 A, 3 A), symmetric; not definite. Of direction rows and turns it is exact where they are met.
    """
    q = state.q
    pull = pulls(kernel.chain, goal, q, which, multipliers)
    batch, count = q.shape[:2]
    total, raw = np.zeros((2, batch, count, 3, count, 3))
    for part in pull:
        upper, lower = _between(part, state, count)
        total += (upper + lower) / (2 if np.any(part.turn) else 1)  # of a turn's rows the halves cancel
        raw += upper if np.any(part.turn) else upper + lower
    first = _gradient(pull, state, length_slope)
    place = np.arange(count)
    inner = np.empty((batch, count, 3, 3))
    for i in range(3):
        moved = q.copy()
        moved[..., i] += _STEP
        inner[:, :, i] = (_gradient(pull, kernel.state(moved), length_slope) - first) / _STEP - raw[:, :, i].sum(axis=1)
    total[:, place, :, place, :] += np.moveaxis(inner, 1, 0)
    total = total.reshape(batch, 3 * count, 3 * count)
    return (total + np.swapaxes(total, 1, 2)) / 2


def _gradient(pull: tuple[Pull, ...], state: State, length_slope: Array) -> Array:
    """First derivative of the pulled quantities and weighted lengths by the inputs, shape (b, A, 3)."""
    total = (length_slope[..., None, :] @ state.blocks)[..., 0, :]
    for part in pull:
        # forces and moments about the origin of G that the multipliers are
        R, P = state.R[:, part.face], state.P[:, part.face]
        moment = cross(P + part.offset * R[..., 2], part.point) + cross(R[..., 2], part.direction) + part.turn
        slope = state.linear @ part.point[:, None, :, None] + state.angular @ moment[:, None, :, None]
        total[:, : part.active] += slope[:, : part.active, :, 0]
    return total


def _between(part: Pull, state: State, count: int) -> tuple[Array, Array]:
    """Derivative by inputs nearer the base of what inputs farther out do, and its transpose, shape (b, A, 3, A, 3)."""
    R, P, angular = state.R[:, part.face], state.P[:, part.face], state.angular
    velocity = state.linear + cross(angular, (P + part.offset * R[..., 2])[:, None, None])
    turning = cross(angular, R[..., 2][:, None, None])
    flat, shape = (len(angular), 3 * count, 3), (len(angular), count, 3, count, 3)
    found = np.zeros((len(angular), 3 * count, 3 * count))
    for weight, rate in ((part.point, velocity), (part.direction, turning), (part.turn, angular)):
        if np.any(weight):
            levers = cross(weight[:, None, None], angular).reshape(flat)
            found += levers @ np.swapaxes(rate.reshape(flat), 1, 2)
    module = np.repeat(np.arange(count), 3)
    found *= (module[:, None] < module[None, :]) & (module[None, :] < part.active)
    return found.reshape(shape), np.swapaxes(found, 1, 2).reshape(shape)
