import numpy as np
import pytest

from studies.octahedron import all_lengths, angle_jacobian, angles, find_actuated, inverse, twist_jacobian
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import circle_nodes, triangle_frame
from vgtsim.kinematics.modules import octahedron as octa
from vgtsim.kinematics.roll_pitch_yaw import roll_pitch_yaw, rotation

ROUNDING = 1e-12  # m or rad: Newton's last step leaves rounding, magnified by the conditioning of the pose
STEP, DIFFERENCE = 1e-6, 1e-7  # central differences of smooth functions of order one
MODULE = octa.OctahedronGeometry((0.80, 0.85, 0.90), (0.70, 0.75, 0.65))


def _poses(count, seed=0, turn=0.3, shift=0.12, module=MODULE):
    rng = np.random.default_rng(seed)
    R, P = octa.home(module, np.full(6, 0.9))
    rpy = roll_pitch_yaw(R) + rng.uniform(-turn, turn, (count, 3))
    return rotation(rpy), P + rng.uniform(-shift, shift, (count, 3))


def _moved(R, P, twist):
    """Pose after a small twist, to second order."""
    angle = np.linalg.norm(twist[3:])
    if angle == 0:
        return R, P + twist[:3]
    x, y, z = twist[3:] / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K) @ R, P + twist[:3]


def test_forward_after_inverse_is_identity():
    R, P = _poses(500)
    R2, P2 = octa.forward(MODULE, inverse(MODULE, R, P), octa.home(MODULE, np.full(6, 0.9)))
    assert np.max(np.abs(R2 - R)) < ROUNDING
    assert np.max(np.abs(P2 - P)) < ROUNDING


def test_inverse_after_forward_is_identity_for_lengths_all_different():
    rng = np.random.default_rng(1)
    longerons = rng.uniform(0.82, 0.98, (300, 6))
    assert np.allclose(inverse(MODULE, *octa.forward(MODULE, longerons)), longerons, atol=ROUNDING, rtol=0)


def test_nodes_of_the_inverse_are_the_frame_s():
    """3.15 to 3.19 undo 3.25 and 3.26."""
    R, P = _poses(50)
    R2, P2 = triangle_frame(octa.top_nodes(MODULE, R, P))
    assert np.allclose(R2, R, atol=ROUNDING)
    assert np.allclose(P2, P, atol=ROUNDING)


def test_batch_is_the_same_as_one_by_one():
    R, P = _poses(6)
    lengths = inverse(MODULE, R, P).reshape(2, 3, 6)
    batch = octa.forward(MODULE, lengths)
    single = octa.forward(MODULE, lengths[1, 2])
    assert batch[0].shape == (2, 3, 3, 3)
    assert np.allclose(batch[1][1, 2], single[1], atol=ROUNDING)


def test_length_jacobian_matches_central_differences():
    for R, P in zip(*_poses(20), strict=True):
        _, J = octa.length_jacobian(MODULE, R, P)
        for k in range(6):
            step = np.eye(6)[k] * STEP
            ends = [octa.lengths(MODULE, *_moved(R, P, sign * step)) for sign in (1, -1)]
            assert np.allclose((ends[0] - ends[1]) / (2 * STEP), J[:, k], atol=DIFFERENCE)


def test_twist_jacobian_matches_central_differences_in_length():
    for R, P in zip(*_poses(20), strict=True):
        J = twist_jacobian(MODULE, R, P)
        lengths = octa.lengths(MODULE, R, P)
        for k in range(6):
            step = np.eye(6)[k] * STEP
            (Ra, Pa), (Rb, Pb) = (octa.forward(MODULE, lengths + sign * step, (R, P)) for sign in (1, -1))
            W = (Ra - Rb) / (2 * STEP) @ R.T
            twist = [*(Pa - Pb) / (2 * STEP), W[2, 1], W[0, 2], W[1, 0]]
            assert np.allclose(twist, J[:, k], atol=DIFFERENCE * np.max(np.abs(J)))


def test_angle_jacobian_matches_central_differences():
    """The matrix of 3.14, with its three zeros."""
    R, P = (item[0] for item in _poses(1))
    J, phi = angle_jacobian(MODULE, R, P), angles(MODULE, R, P)
    circles, _ = octa.closure(MODULE, octa.lengths(MODULE, R, P))
    for k in range(3):
        ends = []
        for sign in (1, -1):
            n = circle_nodes(circles, phi + sign * STEP * np.eye(3)[k])
            ends.append(np.linalg.norm(n[[1, 2, 0]] - n, axis=-1))
        assert np.allclose((ends[0] - ends[1]) / (2 * STEP), J[:, k], atol=DIFFERENCE)
    assert J[0, 2] == J[1, 0] == J[2, 1] == 0.0


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5])
def test_pose_outside_the_subspace_of_static_longerons_is_refused_with_the_residual(k):
    R, P = (item[0] for item in _poses(1, seed=k))
    lengths = octa.lengths(MODULE, R, P)
    static = tuple(float(lengths[i]) if i < k else None for i in range(6))
    module = octa.OctahedronGeometry(MODULE.base, MODULE.top, static)
    assert find_actuated(module).size == 6 - k
    assert np.allclose(inverse(module, R, P), lengths)
    off = P + np.array([0.0, 0.0, 0.01])
    with pytest.raises(AssemblyError, match=f"{6 - k}-dimensional subspace") as caught:
        inverse(module, R, off)
    error = np.abs(octa.lengths(module, R, off) - lengths)[:k]
    assert caught.value.residual == pytest.approx(error.max())
    assert f"l{int(np.argmax(error)) + 1} " in str(caught.value)


def test_motion_by_the_actuated_longerons_stays_in_the_subspace():
    R, P = (item[0] for item in _poses(1))
    lengths = octa.lengths(MODULE, R, P)
    module = octa.OctahedronGeometry(
        MODULE.base, MODULE.top, (None, float(lengths[1]), None, float(lengths[3]), None, None)
    )
    moving = lengths[find_actuated(module)] + 0.03
    joined = all_lengths(module, moving)
    assert np.allclose(inverse(module, *octa.forward(module, joined, (R, P)))[[1, 3]], lengths[[1, 3]])
    J = twist_jacobian(module, R, P)
    assert J.shape == (6, 4)
    assert np.max(np.abs(octa.length_jacobian(module, R, P)[1][[1, 3]] @ J)) < ROUNDING


def test_impossible_longerons_are_named():
    with pytest.raises(AssemblyError, match="longerons 1 and 4") as caught:
        octa.forward(MODULE, [0.3, 0.9, 0.9, 0.4, 0.9, 0.9], octa.home(MODULE, np.full(6, 0.9)))
    assert caught.value.residual == pytest.approx(0.9 - 0.7)  # over the edge n3 n1
