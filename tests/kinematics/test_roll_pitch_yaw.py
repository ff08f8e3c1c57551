import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.pose_rates import angular_velocity_matrix, pose_twist
from vgtsim.kinematics.roll_pitch_yaw import (
    pose_parameters,
    pose_transform,
    roll_pitch_yaw,
    rotation,
)

ROUNDING = 1e-12  # rad or pure: rounding, magnified by at most 1/cos(beta) below
STEP, DIFFERENCE = 1e-6, 1e-9  # central differences of sines: error of order step², plus rounding over step
angle = st.floats(-np.pi, np.pi)


def _elementary(axis, turn):
    c, s = np.cos(turn), np.sin(turn)
    R = np.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


@given(angle, st.floats(-1.5, 1.5), angle)
def test_printed_matrix_is_yaw_after_pitch_after_roll(gamma, beta, alpha):  # 3.20
    product = _elementary(2, alpha) @ _elementary(1, beta) @ _elementary(0, gamma)
    assert np.allclose(rotation([gamma, beta, alpha]), product, atol=ROUNDING)


@given(angle, st.floats(-1.5, 1.5), angle)
def test_angles_after_rotation_is_identity(gamma, beta, alpha):  # 3.21
    found = roll_pitch_yaw(rotation([gamma, beta, alpha]))
    gap = np.angle(np.exp(1j * (found - [gamma, beta, alpha])))
    assert np.max(np.abs(gap)) < 1e-10  # 1/cos(1.5) = 14 times rounding, and the arctangents'


@pytest.mark.parametrize("beta", [np.pi / 2, -np.pi / 2])
@given(angle, angle)
def test_rotation_after_angles_is_identity_where_x_is_vertical(beta, gamma, alpha):
    """3.22 and 3.23 with their cases exchanged."""
    R = _elementary(2, alpha) @ _elementary(1, beta) @ _elementary(0, gamma)
    found = roll_pitch_yaw(R)
    assert found[2] == 0.0
    assert found[1] == pytest.approx(beta)
    assert np.allclose(rotation(found), R, atol=ROUNDING)


@pytest.mark.parametrize(("x_tz", "beta", "sign"), [(1, np.pi / 2, 1), (-1, -np.pi / 2, -1)])
def test_vertical_cases_as_printed_do_not_give_the_rotation_back(x_tz, beta, sign):
    R = _elementary(1, -beta) @ _elementary(0, 0.7)
    assert R[2, 0] == pytest.approx(x_tz)
    as_printed = rotation([sign * np.arctan2(R[0, 1], R[1, 1]), beta, 0.0])
    assert np.max(np.abs(as_printed - R)) > 1.0


@given(angle, st.floats(-1.4, 1.4), angle)
def test_angular_velocity_matches_central_differences(gamma, beta, alpha):
    rpy = np.array([gamma, beta, alpha])
    E = angular_velocity_matrix(rpy)
    for k in range(3):
        step = np.eye(3)[k] * STEP
        W = (rotation(rpy + step) - rotation(rpy - step)) / (2 * STEP) @ rotation(rpy).T
        assert np.allclose([W[2, 1], W[0, 2], W[1, 0]], E[:, k], atol=DIFFERENCE)


def test_six_parameters_of_a_pose_come_back_and_move_it():
    rng = np.random.default_rng(0)
    pose = rng.uniform(-1, 1, (30, 6))
    assert np.allclose(pose_parameters(*pose_transform(pose)), pose, atol=ROUNDING)
    angular, linear = pose_twist(pose)
    R, _ = pose_transform(pose)
    for k in range(6):
        (Ra, Pa), (Rb, Pb) = (pose_transform(pose + s * STEP * np.eye(6)[k]) for s in (1, -1))
        W = (Ra - Rb) / (2 * STEP) @ np.swapaxes(R, -1, -2)
        assert np.allclose(np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], -1), angular[..., k], atol=DIFFERENCE)
        assert np.allclose((Pa - Pb) / (2 * STEP), linear[..., k], atol=DIFFERENCE)
