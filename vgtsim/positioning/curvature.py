"""Curvature of goal rows and of leg lengths: what Gauss and Newton's model of the Lagrangian leaves out.

Between two modules it is a closed form: moving an input i nearer the base turns the velocity v_j that an input j
farther out gives, so the second derivative is omega_i x v_j. Within a module it is a difference of closed-form first
derivatives, all modules moved at once: as many evaluations as a module has inputs, whatever the number of modules.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.state import State, cross
from vgtsim.positioning.goals import GoalSpace, Pull, pulls

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_STEP = 1e-5  # of one-sided differences, in units of the inputs: errors of both kinds are near 1e-5 of the curvature


def lagrangian_curvature(goal: GoalSpace, state: State, which: Index, multipliers: Array, length_slope: Array) -> Array:
    """Second derivative, shape (b, n, n), of goal rows and leg lengths, weighted.

    Rows have weights of shape (b, m); lengths of shape (b, J), or (b, J + S) with static legs. Direction rows and turns
    are exact where they are met.
    """
    pull = pulls(state.chain, goal, which, multipliers)
    owner = state.chain.layout.owner
    batch, count = state.q.shape
    total, raw = np.zeros((2, batch, count, count))
    for part in pull:
        upper = _between(part, state)
        lower = np.swapaxes(upper, 1, 2)
        total += (upper + lower) / (2 if np.any(part.turn) else 1)  # of a turn's rows the halves cancel
        raw += upper if np.any(part.turn) else upper + lower
    first = _gradient(pull, state, length_slope)
    place = np.arange(count) - np.searchsorted(owner, owner)  # among the module's own inputs
    for i in range(int(place.max()) + 1):
        mine = np.flatnonzero(place == i)
        moved = state.q.copy()
        moved[:, mine] += _STEP
        change = (_gradient(pull, state.chain.state(moved), length_slope) - first) / _STEP
        change -= raw[:, mine].sum(axis=1)
        row = np.full(int(owner.max()) + 1, -1)
        row[owner[mine]] = mine
        has = row[owner] >= 0
        total[:, row[owner[has]], np.flatnonzero(has)] += change[:, has]
    return (total + np.swapaxes(total, 1, 2)) / 2


def _gradient(pull: tuple[Pull, ...], state: State, length_slope: Array) -> Array:
    """First derivative of the pulled quantities and weighted lengths by the inputs, shape (b, n)."""
    total = state.pull(length_slope)
    for part in pull:
        # forces and moments about the origin of G that the multipliers are
        R, P = state.face(part.face)
        moment = cross(P + part.offset * R[..., 2], part.point) + cross(R[..., 2], part.direction) + part.turn
        n = part.inputs
        slope = state.linear[:, :n] @ part.point[:, :, None] + state.angular[:, :n] @ moment[:, :, None]
        total[:, :n] += slope[..., 0]
    return total


def _between(part: Pull, state: State) -> Array:
    """Derivative by inputs nearer the base of what inputs farther out do, shape (b, n, n)."""
    angular, owner = state.angular, state.chain.layout.owner
    R, P = state.face(part.face)
    velocity = state.linear + cross(angular, (P + part.offset * R[..., 2])[:, None])
    turning = cross(angular, R[..., 2][:, None])
    found = np.zeros((*angular.shape[:2], angular.shape[1]))
    for weight, rate in ((part.point, velocity), (part.direction, turning), (part.turn, angular)):
        if np.any(weight):
            found += cross(weight[:, None], angular) @ np.swapaxes(rate, 1, 2)
    found *= (owner[:, None] < owner[None, :]) & (np.arange(len(owner)) < part.inputs)[None, :]
    return found
