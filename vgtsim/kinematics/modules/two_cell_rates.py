"""Rates of the general double-octahedral module, and its singularities (sections 3.2, 3.5.2 and 3.5.4).

A state is phi_1 to phi_6, see `two_cells`. The upper longerons and the top triangle are
rigid, so the twist of the top follows from the velocities of n4', n5', n6' by one linear system, the same
matrix as that of a longeron-actuated octahedron; no derivative of the upper angles is needed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.closure import circle_tangents
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.mode_following import worst_direction
from vgtsim.kinematics.modules.octahedron import leg_jacobian
from vgtsim.kinematics.modules.two_cells import (
    UPPER_LEGS,
    TwoCellGeometry,
    actuator_lengths,
    angle_jacobian,
    mid_nodes,
    nodes,
)

Array = NDArray[np.float64]


def jacobian(geometry: TwoCellGeometry, state: ArrayLike) -> Array:
    """Motion of the top per unit rate of phi_1 to phi_3 at a state, shape (..., 6, 3), in closed form.

    The motion is the velocity of the origin of T, then the angular velocity of T, in frame B.

    Raises:
        SingularPoseError: The upper cell is singular.

    Source: section 3.5.4, step 5, for the general module.
    """
    angles = np.asarray(state, float)
    points = nodes(geometry, angles)
    velocity = mid_velocities(geometry, angles)[..., 3 + UPPER_LEGS[:, 0], :, :]
    length, J = upper_jacobian(points)
    unit = (points[..., 6 + UPPER_LEGS[:, 1], :] - points[..., 3 + UPPER_LEGS[:, 0], :]) / length[..., None]
    inverse = invert_sound(J, [1.0, 1.0, 1.0, *(geometry.radius,) * 3], lambda _: "double octahedron, upper cell")
    return inverse @ np.einsum("...ik,...ikj->...ij", unit, velocity)


def upper_jacobian(points: Array) -> tuple[Array, Array]:
    """L7 to L12, shape (..., 6), m, of all moving nodes, shape (..., 9, 3), m, and dL/dtwist, shape (..., 6, 6)."""
    origin = np.mean(points[..., 6:, :], axis=-2)
    return leg_jacobian(points[..., 3 + UPPER_LEGS[:, 0], :], points[..., 6 + UPPER_LEGS[:, 1], :], origin)


def mid_velocities(geometry: TwoCellGeometry, phi: ArrayLike) -> Array:
    """Derivatives of n4, n5, n6, n4', n5', n6' in frame B by phi_1 to phi_3, shape (..., 6 nodes, 3, 3 inputs), m/rad.

    Angles are phi_1 to phi_3, or a state, shape (..., 3) or (..., 6), rad.
    """
    angles = np.asarray(phi, float)
    points = mid_nodes(geometry, angles)
    tangent = circle_tangents(geometry.circles, angles[..., :3])
    moves = tangent[..., :, :, None] * np.eye(3)[:, None, :]
    first, second = points[..., 1, :] - points[..., 0, :], points[..., 2, :] - points[..., 0, :]
    cross = np.cross(first, second)
    size = np.linalg.norm(cross, axis=-1)[..., None, None]
    rate = np.cross(moves[..., 1, :, :] - moves[..., 0, :, :], second[..., None], axis=-2)
    rate = rate + np.cross(first[..., None], moves[..., 2, :, :] - moves[..., 0, :, :], axis=-2)
    w = cross[..., None] / size
    turn = (rate - w * np.sum(w * rate, axis=-2, keepdims=True)) / size
    return np.concatenate([moves, moves + geometry.joint_offset * turn[..., None, :, :]], axis=-3)


def length_jacobian(geometry: TwoCellGeometry, state: ArrayLike) -> tuple[Array, Array]:
    """l1, l2, l3, shape (..., 3), m, of a state, and dtwist/dl of the top, shape (..., 6, 3), by the chain rule (section 3.2).

    Raises:
        SingularPoseError: Either cell is singular.
    """
    angles = np.asarray(state, float)
    usual = float(np.mean(geometry.circles.radius))
    inverse = invert_sound(angle_jacobian(geometry, angles), usual, lambda _: "double octahedron, lower cell")
    return actuator_lengths(geometry, angles), jacobian(geometry, angles) @ inverse


def singularity(geometry: TwoCellGeometry, state: ArrayLike) -> tuple[float, str]:
    """How near one state is to a singularity of either cell, and the member with most of the lost length change.

    Returns:
        The smaller of two pure numbers, and the member. The numbers are the smallest singular values of dl/dphi over
        the mean radius of the circles, and of dL/dtwist of the upper longerons with rotations in units of
        `TwoCellGeometry.radius`.
    """
    angles = np.asarray(state, float)
    value, row = worst_direction(angle_jacobian(geometry, angles), float(np.mean(geometry.circles.radius)))
    _, J = upper_jacobian(nodes(geometry, angles))
    upper, leg = worst_direction(J, [1.0, 1.0, 1.0, *(geometry.radius,) * 3])
    return (value, f"actuator l{row + 1}") if value <= upper else (upper, f"longeron L{leg + 7}")
