"""Inverse solutions of the general double-octahedral module (section 3.5.2).

The module has three freedoms, so a goal has three parameters: a position, two angles and a coordinate, or the
unit normal of the top face and an extension. A goal may ask for more, a whole pose or several goals at once.
The result is then the nearest state in least squares, with its residual.

The iteration is on the canonical input with the closed-form Jacobian: the procedure of section 3.5.4, carried
over to the general module. It is damped after Levenberg and Marquardt. Every step keeps the upper cell on its mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studies.pose_rates import angular_velocity_matrix
from vgtsim.kinematics.closure import triangle_frame
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.modules.two_cells import (
    TwoCellGeometry,
    actuator_lengths,
    advance,
    angle_jacobian,
    jacobian,
    nodes,
)
from vgtsim.kinematics.roll_pitch_yaw import roll_pitch_yaw

Array = NDArray[np.float64]

_MOST_ITERATIONS = 100
_STILL = 1e-13  # m: error, or its slope per radian of every input, that counts as none
_LARGEST_STEP = 0.25  # rad: of the canonical input in one iteration


def transform(geometry: TwoCellGeometry, state: ArrayLike) -> tuple[Array, Array]:
    """R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m, of a state: 3.47 to 3.51 with the top nodes 7 to 9."""
    return triangle_frame(nodes(geometry, state)[..., 6:, :])


def length_jacobian(geometry: TwoCellGeometry, state: ArrayLike) -> tuple[Array, Array]:
    """l1, l2, l3, shape (..., 3), m, of a state, and dtwist/dl of the top, shape (..., 6, 3), by the chain rule (section 3.2).

    Raises:
        SingularPoseError: Either cell is singular.
    """
    angles = np.asarray(state, float)
    usual = float(np.mean(geometry.circles.radius))
    inverse = invert_sound(angle_jacobian(geometry, angles), usual, lambda _: "double octahedron, lower cell")
    return actuator_lengths(geometry, angles), jacobian(geometry, angles) @ inverse


@dataclass(frozen=True)
class Position:
    """T's origin at a point.

    Attributes:
        point: In frame B, shape (..., 3), m.
    """

    point: ArrayLike


@dataclass(frozen=True)
class AnglesAndCoordinate:
    """Roll and pitch of T, and one coordinate of its origin.

    Attributes:
        roll: gamma about X_B, shape (...), rad.
        pitch: beta about Y_B, shape (...), rad.
        axis: Which coordinate: 0, 1 or 2.
        coordinate: Its value in frame B, shape (...), m.
    """

    roll: ArrayLike
    pitch: ArrayLike
    axis: int
    coordinate: ArrayLike


@dataclass(frozen=True)
class NormalAndExtension:
    """Unit normal of the top face, and the distance between the two faces' centroids.

    Attributes:
        normal: Q in frame B, shape (..., 3).
        extension: |P_BT|, shape (...), m.
    """

    normal: ArrayLike
    extension: ArrayLike


@dataclass(frozen=True)
class Pose:
    """T's position and orientation: six parameters, which the module can in general only come near to.

    Attributes:
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.
    """

    R: ArrayLike
    P: ArrayLike


Goal = Position | AnglesAndCoordinate | NormalAndExtension | Pose


@dataclass(frozen=True)
class InverseSolution:
    """What an inverse solution found.

    Attributes:
        state: phi_1 to phi_6, shape (..., 6), rad.
        error: What is left of every goal's errors in order, shape (..., M), m; angles times the top's radius.
        slope: Derivative of half the squared error with respect to phi_1 to phi_3, shape (..., 3), m²/rad:
            zero at the nearest state; not where a singularity at the edge of the mode stops short of it.
        iterations: Iterations made, of the slowest of the batch.
    """

    state: Array
    error: Array
    slope: Array
    iterations: int

    @property
    def residual(self) -> Array:
        """Norm of the error, shape (...), m."""
        return np.linalg.norm(self.error, axis=-1)


def inverse(geometry: TwoCellGeometry, goals: Goal | Sequence[Goal], start: ArrayLike) -> InverseSolution:
    """State that meets a goal, or comes nearest to it in least squares.

    Args:
        geometry: Fixed dimensions.
        goals: One goal or several together; their batch dimensions broadcast with the start's.
        start: State to start from, shape (..., 6), rad: `home`, or the present one.

    Returns:
        The state on the mode of the start, and what is left of the error.

    Raises:
        SingularPoseError: The upper cell, or roll and pitch at a pitch of 90 degrees, is singular at an iterate.

    Source: section 3.5.2, and 3.5.4 steps 1 to 8. Differs: damped, and on the general module.
    """
    wanted = [goals] if isinstance(goals, Position | AnglesAndCoordinate | NormalAndExtension | Pose) else list(goals)
    state = np.array(start, float)
    error, J = _errors(geometry, wanted, state)
    state = np.broadcast_to(state, (*error.shape[:-1], 6)).copy()
    damping = np.full(error.shape[:-1], 1e-6)
    iterations = 0
    while iterations < _MOST_ITERATIONS:
        slope = np.einsum("...mi,...m->...i", J, error)
        if not np.any(_unfinished(error, slope)):
            break
        iterations += 1
        step = _damped_step(J, slope, damping)
        trial, reached = advance(geometry, state, state[..., :3] + step)
        trial = np.where((reached == 1.0)[..., None], trial, state)
        trial_error, trial_J = _errors(geometry, wanted, trial)
        better = (reached == 1.0) & (np.sum(trial_error**2, axis=-1) < np.sum(error**2, axis=-1))
        state = np.where(better[..., None], trial, state)
        error = np.where(better[..., None], trial_error, error)
        J = np.where(better[..., None, None], trial_J, J)
        stuck = ~better & (np.max(np.abs(step), axis=-1) < 1e-15)
        damping = np.where(better, np.maximum(damping / 10, 1e-14), damping * 10)
        if np.all(stuck | ~_unfinished(error, np.einsum("...mi,...m->...i", J, error)) | (damping > 1e14)):
            break
    return InverseSolution(state, error, np.einsum("...mi,...m->...i", J, error), iterations)


def _unfinished(error: Array, slope: Array) -> NDArray[np.bool_]:
    return (np.max(np.abs(error), axis=-1) > _STILL) & (np.max(np.abs(slope), axis=-1) > _STILL)


def _damped_step(J: Array, slope: Array, damping: Array) -> Array:
    square = np.swapaxes(J, -1, -2) @ J
    # not quite zero where no goal depends on the state: no step there, and no singular matrix in the batch
    weight = damping * np.trace(square, axis1=-2, axis2=-1) + np.finfo(float).tiny
    step = np.linalg.solve(square + weight[..., None, None] * np.eye(3), -slope[..., None])[..., 0]
    largest = np.max(np.abs(step), axis=-1, keepdims=True)
    return step * np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, 1e-300))


def _errors(geometry: TwoCellGeometry, goals: Sequence[Goal], state: Array) -> tuple[Array, Array]:
    """Errors of all goals, shape (..., M), m, and their derivative per canonical input, shape (..., M, 3)."""
    R, P = transform(geometry, state)
    parts = [_error(goal, R, P, float(geometry.twist_units[3])) for goal in goals]
    batch = np.broadcast_shapes(P.shape[:-1], *(error.shape[:-1] for error, _ in parts))
    error = np.concatenate([np.broadcast_to(e, (*batch, e.shape[-1])) for e, _ in parts], axis=-1)
    rows = np.concatenate([np.broadcast_to(r, (*batch, *r.shape[-2:])) for _, r in parts], axis=-2)
    return error, rows @ jacobian(geometry, state)


def _error(goal: Goal, R: Array, P: Array, radius: float) -> tuple[Array, Array]:
    """Error of one goal, shape (..., m), m, and its derivative per twist of the top, shape (..., m, 6)."""
    if isinstance(goal, Position):
        return P - np.asarray(goal.point, float), _moves(np.broadcast_to(np.eye(3), R.shape))
    if isinstance(goal, NormalAndExtension):
        return _normal_error(goal, R, P, radius)
    if isinstance(goal, AnglesAndCoordinate):
        return _angle_error(goal, R, P, radius)
    return _pose_error(goal, R, P, radius)


def _normal_error(goal: NormalAndExtension, R: Array, P: Array, radius: float) -> tuple[Array, Array]:
    size = np.sqrt(np.sum(P**2, axis=-1, keepdims=True))
    off = radius * (R[..., :, 2] - np.asarray(goal.normal, float))
    lag = size - np.asarray(goal.extension, float)[..., None]
    rows = [_turns(-radius * _cross_matrix(R[..., :, 2])), _moves((P / size)[..., None, :])]
    return _joined(off, lag), np.concatenate(rows, axis=-2)


def _angle_error(goal: AnglesAndCoordinate, R: Array, P: Array, radius: float) -> tuple[Array, Array]:
    angles = roll_pitch_yaw(R)
    wanted = np.stack(np.broadcast_arrays(goal.roll, goal.pitch), axis=-1).astype(float)
    off = angles[..., :2] - wanted
    lag = P[..., goal.axis] - np.asarray(goal.coordinate, float)
    rate = radius * invert_sound(angular_velocity_matrix(angles), 1.0, lambda _: "roll and pitch of a goal")[..., :2, :]
    axis = np.broadcast_to(np.eye(3)[goal.axis], (*P.shape[:-1], 1, 3))
    error = _joined(radius * np.arctan2(np.sin(off), np.cos(off)), lag[..., None])
    return error, np.concatenate([_turns(rate), _moves(axis)], axis=-2)


def _pose_error(goal: Pose, R: Array, P: Array, radius: float) -> tuple[Array, Array]:
    """Position, and the differences of the three axes over sqrt(2): the angle times the radius if small."""
    unit = radius / np.sqrt(2)
    wanted = np.asarray(goal.R, float)
    axes = [unit * (R[..., :, k] - wanted[..., :, k]) for k in range(3)]
    turns = [_turns(-unit * _cross_matrix(R[..., :, k])) for k in range(3)]
    moves = _moves(np.broadcast_to(np.eye(3), R.shape))
    return _joined(P - np.asarray(goal.P, float), *axes), np.concatenate([moves, *turns], axis=-2)


def _joined(*parts: Array) -> Array:
    shape = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    return np.concatenate([np.broadcast_to(part, (*shape, part.shape[-1])) for part in parts], axis=-1)


def _moves(rows: Array) -> Array:
    """Derivative per twist of what depends on the position alone."""
    return np.concatenate([rows, np.zeros_like(rows)], axis=-1)


def _turns(rows: Array) -> Array:
    """Derivative per twist of what depends on the orientation alone."""
    return np.concatenate([np.zeros_like(rows), rows], axis=-1)


def _cross_matrix(v: Array) -> Array:
    """[v]x with [v]x w = v x w, shape (..., 3, 3)."""
    M = np.zeros((*v.shape, 3))
    M[..., 0, 1], M[..., 0, 2], M[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return M - np.swapaxes(M, -1, -2)
