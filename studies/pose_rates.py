"""Rates of poses by their six parameters (equations 3.20 to 3.24), see `vgtsim.kinematics.roll_pitch_yaw`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def angular_velocity_matrix(rpy: ArrayLike) -> Array:
    """E, shape (..., 3, 3), with omega = E d(rpy)/dt in the fixed frame, at gamma, beta, alpha, shape (..., 3), rad.

    The determinant of E is cos(beta).
    """
    angle = np.asarray(rpy, float)
    beta, alpha = angle[..., 1], angle[..., 2]
    E = np.zeros((*angle.shape, 3))
    E[..., 0, 0], E[..., 1, 0], E[..., 2, 0] = (
        np.cos(alpha) * np.cos(beta),
        np.sin(alpha) * np.cos(beta),
        -np.sin(beta),
    )
    E[..., 0, 1], E[..., 1, 1] = -np.sin(alpha), np.cos(alpha)
    E[..., 2, 2] = 1.0
    return E


def pose_twist(pose: ArrayLike) -> tuple[Array, Array]:
    """Motion of frame T per unit rate of each of its six parameters.

    Args:
        pose: x, y, z, m, then gamma, beta, alpha, rad, shape (..., 6).

    Returns:
        Angular velocity of T and velocity of its origin in frame B, each shape (..., 3, 6), inputs along the
        last axis.
    """
    six = np.asarray(pose, float)
    angular, linear = np.zeros((2, *six.shape[:-1], 3, 6))
    angular[..., 3:] = angular_velocity_matrix(six[..., 3:])
    linear[..., :3] = np.eye(3)
    return angular, linear
