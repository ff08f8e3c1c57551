import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies import tetrahedron as tetra
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import triangle_frame, triangle_nodes

ROUNDING = 1e-13  # m or rad: rounding of a few operations on metres
STEP, DIFFERENCE = 1e-6, 1e-8  # central differences: step² plus rounding over the step, with a margin
MODULE = tetra.HingeModule(side=0.9, hinge=0.8)
open_angle = st.floats(0.05, 3.0)
geometry = st.builds(
    lambda side, ratio: tetra.HingeModule(side, side * ratio), st.floats(0.5, 2.0), st.floats(0.3, 1.7)
)


@given(geometry, open_angle)
def test_forward_after_inverse_is_identity(module, theta):
    for branch in (1, -1):
        found = tetra.forward(module, tetra.inverse(module, branch * theta), branch)
        assert found == pytest.approx(branch * theta, abs=1e-12 / np.cos(theta / 2))


@given(geometry, open_angle)
def test_closed_forms_as_printed_hold(module, theta):
    """3.1 to 3.3 with L1 and L2."""
    L1, L2 = module.side, module.hinge
    length = np.sqrt((2 * L1**2 - L2**2 / 2) * (1 - np.cos(theta)))
    assert tetra.inverse(module, theta) == pytest.approx(length, rel=1e-12)
    assert np.cos(theta) == pytest.approx(1 - length**2 / (2 * L1**2 - L2**2 / 2), abs=1e-12)


@given(geometry, st.floats(-3.0, 3.0))
def test_members_have_their_lengths_and_frame_t_sits_on_n2_n4_n3(module, theta):
    n1, n2, n3, n4 = tetra.nodes(module, theta)
    for a, b, length in [
        (n1, n2, module.side),
        (n1, n3, module.side),
        (n4, n2, module.side),
        (n4, n3, module.side),
    ]:
        assert np.linalg.norm(a - b) == pytest.approx(length, abs=ROUNDING)
    assert np.linalg.norm(n2 - n3) == pytest.approx(module.hinge, abs=ROUNDING)
    assert np.linalg.norm(n4 - n1) == pytest.approx(float(tetra.inverse(module, theta)), abs=ROUNDING)
    R, P = triangle_frame(np.array([n2, n4, n3]))
    found = tetra.transform(module, theta)
    assert np.allclose(found[0], R, atol=ROUNDING)
    assert np.allclose(found[1], P, atol=ROUNDING)


def test_printed_transform_is_not_the_frame_of_n1_n2_n4():
    n1, n2, _, n4 = tetra.nodes(MODULE, 1.0)
    P = tetra.transform(MODULE, 1.0)[1]
    assert np.linalg.norm(np.mean([n1, n2, n4], axis=0) - P) > 0.1


def test_base_is_a_face_triangle_and_faces_mate():
    """The base's own frame is B; at theta = 0 the top lies on it, corner on corner."""
    n1, n2, n3, n4 = tetra.nodes(MODULE, 0.0)
    assert np.allclose(triangle_nodes(MODULE.face), [n2, n1, n3], atol=ROUNDING)
    assert np.allclose(n4, n1, atol=ROUNDING)
    assert np.allclose(tetra.transform(MODULE, 0.0)[0], np.eye(3))


@given(open_angle)
def test_module_lies_above_its_base_and_below_its_top_on_the_working_branch(theta):
    for branch in (1, -1):
        n1, _, _, n4 = tetra.nodes(MODULE, branch * theta)
        R, P = tetra.transform(MODULE, branch * theta)
        assert branch * n4[2] > 0
        assert branch * ((n1 - P) @ R[:, 2]) < 0


def test_regular_tetrahedron_has_its_dihedral_angle():
    module = tetra.HingeModule(1.0, 1.0)
    assert tetra.forward(module, 1.0) == pytest.approx(np.arccos(1 / 3), abs=1e-14)


@given(open_angle)
def test_twist_matches_central_differences(theta):
    R, _ = tetra.transform(MODULE, theta)
    (Ra, Pa), (Rb, Pb) = (tetra.transform(MODULE, theta + s) for s in (STEP, -STEP))
    W = (Ra - Rb) / (2 * STEP) @ R.T
    angular, linear = tetra.twist(MODULE, theta)
    assert np.allclose(angular[:, 0], [W[2, 1], W[0, 2], W[1, 0]], atol=DIFFERENCE)
    assert np.allclose(linear[:, 0], (Pa - Pb) / (2 * STEP), atol=DIFFERENCE)


@given(st.floats(-2.8, 2.8).filter(lambda x: abs(x) > 0.1))
def test_chain_rule_matches_central_differences_in_length(theta):
    branch = 1 if theta > 0 else -1
    length = tetra.inverse(MODULE, theta)
    angles = [tetra.forward(MODULE, length + s, branch) for s in (STEP, -STEP)]
    poses = [tetra.transform(MODULE, angle)[1] for angle in angles]
    angular, linear = tetra.twist_per_length(MODULE, theta)
    assert angular[0, 0] == pytest.approx((angles[0] - angles[1]) / (2 * STEP), abs=1e-7)
    assert np.allclose(linear[:, 0], (poses[0] - poses[1]) / (2 * STEP), atol=1e-7)


@pytest.mark.parametrize("theta", [0.0, np.pi, -np.pi])
def test_flat_poses_are_singular(theta):
    with pytest.raises(AssemblyError, match="flat"):
        tetra.twist_per_length(MODULE, theta)


def test_branches_meet_at_the_longest_length():
    longest = 2 * MODULE.height
    assert tetra.forward(MODULE, longest, 1) == pytest.approx(np.pi)
    assert tetra.forward(MODULE, longest, -1) == pytest.approx(-np.pi)
    assert tetra.length_derivative(MODULE, np.pi) == pytest.approx(0.0, abs=1e-15)


def test_lengths_that_do_not_close_are_refused_with_the_gap():
    with pytest.raises(AssemblyError) as caught:
        tetra.forward(MODULE, [0.5, 2 * MODULE.height + 0.02])
    assert caught.value.residual == pytest.approx(0.02)
    with pytest.raises(AssemblyError):
        tetra.forward(MODULE, -0.1)
    with pytest.raises(AssemblyError, match="flat"):
        tetra.HingeModule(0.4, 0.9)
