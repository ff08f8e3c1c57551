"""Roll, pitch and yaw: three angles for a rotation (equations 3.20 to 3.24).

Roll gamma about X, pitch beta about Y, yaw alpha about Z, all axes fixed: R = R_Z(alpha) R_Y(beta)
R_X(gamma).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array

_UPRIGHT = 1e-12  # X axis this near to vertical, as cos(beta): roll and yaw turn about the same axis


def rotation(rpy: ArrayLike) -> Array:
    """Rotation matrix, shape (..., 3, 3), of gamma, beta, alpha, shape (..., 3), rad (3.20 and 3.24)."""
    angle = np.asarray(rpy, float)
    cos, sin = np.cos(angle), np.sin(angle)
    cg, cb, ca = cos[..., 0], cos[..., 1], cos[..., 2]
    sg, sb, sa = sin[..., 0], sin[..., 1], sin[..., 2]
    along, across = ca * sb, sa * sb
    R = np.empty((*angle.shape, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = ca * cb, along * sg - sa * cg, along * cg + sa * sg
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = sa * cb, across * sg + ca * cg, across * cg - ca * sg
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = -sb, cb * sg, cb * cg
    return R


def roll_pitch_yaw(R: ArrayLike) -> Array:
    """gamma, beta, alpha, shape (..., 3), rad, of rotations, shape (..., 3, 3), in all three cases (3.21 to 3.23).

    beta is in [-pi/2, pi/2]; alpha is zero where X is vertical.
    Differs: X_Tz = -sin(beta), so X_Tz = +1 means beta = -90 degrees and X_Tz = -1 means +90 degrees; as printed, 3.22
    and 3.23 are exchanged.
    """
    R = np.asarray(R, float)
    level = np.hypot(R[..., 0, 0], R[..., 1, 0])
    upright = level < _UPRIGHT
    down = -np.sign(R[..., 2, 0])
    gamma = np.where(upright, down * np.arctan2(R[..., 0, 1], R[..., 1, 1]), np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    alpha = np.where(upright, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    return np.stack([gamma, np.arctan2(-R[..., 2, 0], level), alpha], axis=-1)


def pose_transform(pose: ArrayLike) -> tuple[Array, Array]:
    """R_BT, (..., 3, 3), and P_BT, (..., 3), m, of poses x, y, z, m, gamma, beta, alpha, rad, shape (..., 6) (3.24 and 3.25)."""
    six = np.asarray(pose, float)
    return rotation(six[..., 3:]), six[..., :3]


def pose_parameters(R: ArrayLike, P: ArrayLike) -> Array:
    """Pose, shape (..., 6), see `pose_transform`, of R_BT and P_BT (3.15 and 3.21 to 3.23)."""
    return np.concatenate([np.asarray(P, float), roll_pitch_yaw(R)], axis=-1)


def rotate_upright(turn: ArrayLike) -> Array:
    """Rotations about the vertical by angles of shape (...), rad: shape (..., 3, 3)."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.zeros((*np.shape(c), 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 1, 0], R[..., 1, 1], R[..., 2, 2] = c, -s, s, c, 1.0
    return R


def smallest_turn(first: Array, last: Array) -> Array:
    """Rotation that takes one unit vector to another about the axis across both, shape (3, 3); not to its opposite."""
    v, c = np.cross(first, last), float(first @ last)
    K = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + K + K @ K / max(1 + c, 1e-9)
