"""Every number printed in chapters 5 and 6 for the planar arm, to half its last digit."""

from __future__ import annotations

import numpy as np
import pytest

from studies.jacobian_analysis import analyse, bases_by_qr, bases_by_svd
from studies.planar import PlanarArm
from vgtsim.positioning.newton import condition_numbers

PRINTED = 0.5e-4  # half the fourth decimal
COARSE = 0.5e-2  # half the second decimal
PRINTED_TIP = 2e-3  # angles to half a hundredth of a degree, with 5 units of reach
ARM = PlanarArm()
FIRST = np.radians([0.0, 45.0, 30.0])
FEASIBLE = np.radians([-6.92, 67.42, 27.82])

J_611 = np.array([[-2.3801, -2.3801, -0.9659], [3.6730, 1.6730, 0.2588]])
U_638 = np.array([[-0.6497, -0.7602, 0.0], [0.7602, -0.6497, 0.0], [0.0, 0.0, 1.0]])
V_640 = np.array([[0.8282, -0.5321, 0.1761], [0.5379, 0.6664, -0.5162], [0.1573, 0.5222, 0.8382]])
U_647 = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
V_649 = np.array([[0.8452, -0.5345, 0.0], [0.5071, 0.8018, -0.3162], [0.1690, 0.2673, 0.9487]])
J_656 = np.array([[-2.4851, -2.7546, -1.0000], [2.9392, 0.9575, -0.0023]])
U_657 = np.array([[-0.7917, -0.6110, 0.0], [0.6110, -0.7917, 0.0], [0.0, 0.0, 0.0]])
V_659 = np.array([[0.7945, -0.5889, 0.1482], [0.5839, 0.6738, -0.4529], [0.1668, 0.4463, 0.8792]])


def augmented(jacobian):
    return np.vstack([jacobian, np.zeros((jacobian.shape[1] - len(jacobian), jacobian.shape[1]))])


def signed_as(found, printed):
    """Columns of a factor with the signs the print has; a column's sign is free."""
    return found * np.where(np.sum(found * printed, axis=0) < 0, -1.0, 1.0)


def assert_printed(found, printed, tolerance=PRINTED):
    np.testing.assert_allclose(found, printed, rtol=0, atol=tolerance * 1.02)  # the printed digit may sit on the edge


def test_printed_jacobian_is_found_by_differences_and_in_closed_form():
    assert_printed(ARM.jacobian(FIRST), J_611)
    assert_printed(ARM.jacobian_by_differences(FIRST), J_611)


def test_printed_qr_factors_of_the_jacobian():
    Q, R = np.linalg.qr(augmented(ARM.jacobian(FIRST)))
    Q_620 = np.array([[-0.5438, -0.8392, 0.0], [0.8392, -0.5438, 0.0], [0.0, 0.0, 1.0]])
    R_621 = np.array([[4.3768, 2.6984, 0.7425], [0.0, 1.0876, 0.6699], [0.0, 0.0, 0.0]])
    assert_printed(signed_as(Q, Q_620), Q_620)
    assert_printed(signed_as(R.T, R_621.T).T, R_621)


def test_printed_qr_factors_of_the_transpose():
    Q, R = np.linalg.qr(augmented(ARM.jacobian(FIRST)).T)
    Q_623 = np.array([[-0.6797, 0.7121, 0.1761], [-0.6797, -0.5211, -0.5162], [-0.2758, -0.4705, 0.8382]])
    R_624 = np.array([[3.5019, -3.7050, 0.0], [0.0, 1.6218, 0.0], [0.0, 0.0, 0.0]])
    assert_printed(signed_as(Q, Q_623), Q_623)
    assert_printed(R, R_624)


def test_both_factorisations_find_the_printed_null_vector():
    N_625 = np.array([[0.1761], [-0.5162], [0.8382]])
    for bases in (bases_by_qr(ARM.jacobian(FIRST)), bases_by_svd(ARM.jacobian(FIRST))):
        assert (bases.rank, bases.nullity) == (2, 1)
        assert_printed(signed_as(bases.null, N_625), N_625)


def test_printed_singular_value_decomposition():
    bases = bases_by_svd(augmented(ARM.jacobian(FIRST)))
    assert_printed(bases.values, [5.2388, 1.0841, 0.0])
    assert_printed(signed_as(bases.left, U_638), U_638)
    assert_printed(signed_as(bases.right, V_640), V_640)
    assert (bases.rank, bases.nullity) == (2, 1)


def test_printed_condition_number_and_pseudo_inverse():
    found = analyse(ARM.jacobian(FIRST))
    assert_printed(found.condition, 4.8324)
    assert_printed(found.inverse, [[0.2704, 0.4391], [-0.5340, -0.3213], [-0.3857, -0.2901]])


def test_printed_singular_start():
    J = ARM.jacobian(np.zeros(3))
    assert_printed([3.0, 2.5] - ARM.tip(np.zeros(3)), [-2.0, 2.5])
    assert_printed(J, [[0.0, 0.0, 0.0], [5.0, 3.0, 1.0]])
    found = analyse(J, ("x", "y"))
    assert_printed(found.bases.values, [5.9161, 0.0])
    assert (found.bases.rank, found.bases.nullity) == (1, 2)
    assert_printed(np.abs(found.bases.range), [[0.0], [1.0]])
    assert found.lost_names == ("x",)
    assert found.condition == np.inf
    assert_printed(found.inverse, [[0.0, 0.1429], [0.0, 0.0857], [0.0, 0.0286]])
    step, refused = found.step([-2.0, 2.5])
    assert_printed(step, [0.3571, 0.2143, 0.0714])
    assert_printed(refused, [-2.0, 0.0])


def test_printed_factors_of_the_singular_start_multiply_back():
    """The null vectors of 6.49 are one choice of two: what is unique is their span."""
    J = augmented(ARM.jacobian(np.zeros(3)))
    assert_printed(U_647 @ np.diag([5.9161, 0.0, 0.0]) @ V_649.T, J, 6 * PRINTED)  # 5.9 times half a digit of V
    assert_printed(V_649.T @ V_649, np.eye(3), 2 * PRINTED)
    assert_printed(J @ V_649[:, 1:], np.zeros((3, 2)), 5 * PRINTED)


def test_undamped_iteration_does_not_reach_the_printed_solution():
    theta = np.zeros(3)
    for _ in range(40):
        theta = theta + analyse(ARM.jacobian(theta)).step([3.0, 2.5] - ARM.tip(theta))[0]
    np.testing.assert_allclose(ARM.tip(theta), [3.0, 2.5], atol=1e-12)
    turns = np.degrees(theta - FEASIBLE) / 360
    assert np.max(np.abs(turns - np.round(turns))) > 0.1  # it ends on another point of the solution space


def test_limited_steps_come_to_the_printed_solution_from_zero():
    """No joint turned by more than 84 degrees in a step: six steps of 6.35 end within 0.05 degrees of 6.55."""
    theta, limit = np.zeros(3), np.radians(84)
    for _ in range(6):
        step = analyse(ARM.jacobian(theta)).step([3.0, 2.5] - ARM.tip(theta))[0]
        theta = theta + step * min(1.0, limit / np.abs(step).max())
    np.testing.assert_allclose(ARM.tip(theta), [3.0, 2.5], atol=1e-5)
    assert np.degrees(np.abs(theta - FEASIBLE)).max() < 0.05


def test_one_step_leads_from_the_configuration_of_the_printed_jacobian_to_the_printed_solution():
    """6.56 is of the iterate before 6.55, to the hundredth of a degree in which both are known."""
    before = np.radians([-7.74, 69.06, 28.81])
    after = before + analyse(ARM.jacobian(before)).step([3.0, 2.5] - ARM.tip(before))[0]
    assert np.degrees(np.abs(after - FEASIBLE)).max() < 0.01


def test_singular_vectors_as_first_printed_are_exchanged():
    """6.28 and 6.30 have A v = s u and its transpose on u; 6.29 has them the other way round, which holds for no triple."""
    A = ARM.jacobian(FIRST)
    left, values, right = np.linalg.svd(A)
    whole = np.block([[np.zeros((2, 2)), A], [A.T, np.zeros((3, 3))]])
    for u, value, v in zip(left.T, values, right, strict=False):
        assert whole @ [*u, *v] == pytest.approx(value * np.array([*u, *v]))  # 6.30
        square = augmented(A)
        wide = np.array([*u, 0.0])
        assert square @ v == pytest.approx(value * wide)
        assert np.abs(square @ wide - value * v).max() > 0.1  # 6.29


def test_printed_feasible_solution_is_feasible():
    np.testing.assert_allclose(ARM.tip(FEASIBLE), [3.0, 2.5], atol=PRINTED_TIP)


def test_printed_feasible_jacobian_belongs_to_another_configuration():
    """The first column of 6.10 is (-y, x) of the tip: 6.56 has the tip at (2.9392, 2.4851), off the goal by 0.06."""
    assert np.abs(ARM.jacobian(FEASIBLE) - J_656).max() > 0.05
    headings = np.cumsum([np.arctan2(2.7546 - 2.4851, 2.9392 - 0.9575) * -1, 0.0, 0.0])
    headings[1] = np.arctan2(2.7546 - 1.0, 0.9575 + 0.0023)
    headings[2] = np.arctan2(1.0, -0.0023)
    theta = np.diff(headings, prepend=0.0)
    assert_printed(ARM.jacobian(theta), J_656, 2 * PRINTED)  # it is a Jacobian of this arm, of an earlier iterate
    assert np.degrees(theta) == pytest.approx([-7.74, 69.06, 28.81], abs=0.02)


def test_printed_factors_and_condition_number_are_those_of_the_printed_jacobian():
    bases = bases_by_svd(augmented(J_656))
    assert_printed(bases.values, [4.7365, 1.3729, 0.0], 2 * PRINTED)
    assert_printed(signed_as(bases.left, U_657)[:, :2], U_657[:, :2], 2 * PRINTED)
    assert_printed(signed_as(bases.right, V_659), V_659, 2 * PRINTED)
    assert pytest.approx(3.45, abs=COARSE) == 4.7365 / 1.3729
    assert U_657[2, 2] == 0.0  # printed; an orthonormal factor has 1 there
    assert abs(bases.left[2, 2]) == 1.0


def test_condition_number_of_the_printed_feasible_solution_is_not_the_printed_one():
    assert condition_numbers(ARM.jacobian(FEASIBLE)) == pytest.approx(3.55, abs=COARSE)


def test_the_two_branches_of_the_printed_goal_are_one_closed_curve():
    """Section 5.1.1 lets branches meet at interior singularities only; they meet at theta_2 = 0, where rank is full."""
    branches = ARM.solutions([2.5, 2.5], np.linspace(-np.pi, np.pi, 20001))
    there = ~np.isnan(branches[..., 0])
    np.testing.assert_allclose(ARM.tip(branches[there]) - 2.5, 0.0, atol=1e-12)
    ends = np.flatnonzero(np.diff(there[0].astype(int)))
    assert len(ends) == 2  # one interval of headings: both branches begin and end together
    wrist = np.hypot(2.5, 2.5)
    turn = np.arccos((wrist**2 + 1 - 16) / (2 * wrist))  # from the goal's direction: elbow straight
    for sign in (1, -1):
        heading = np.pi / 4 + sign * turn
        shoulder = np.arctan2(2.5 - np.sin(heading), 2.5 - np.cos(heading))
        meeting = [shoulder, 0.0, heading - shoulder]
        np.testing.assert_allclose(ARM.tip(meeting), [2.5, 2.5], atol=1e-12)
        assert condition_numbers(ARM.jacobian(meeting)) < 10


def test_printed_extreme_condition_numbers():
    """Figures 6.4 and 6.5: 3.39 and 4.46 are the local extremes on the branch, by search over all of it."""
    branch = ARM.solutions([3.0, 2.5], np.linspace(-np.pi, np.pi, 20001))[0]
    kappa = condition_numbers(ARM.jacobian(branch[~np.isnan(branch[:, 0])]))
    inner = kappa[1:-1]
    least = inner[(inner < kappa[:-2]) & (inner < kappa[2:])]
    greatest = inner[(inner > kappa[:-2]) & (inner > kappa[2:])]
    assert least.min() == pytest.approx(3.39, abs=COARSE)
    assert greatest.max() == pytest.approx(4.46, abs=COARSE)


def test_steps_stay_bounded_up_to_the_singularity():
    for bend in (1e-1, 1e-3, 1e-5, 1e-7, 0.0):
        found = analyse(ARM.jacobian([0.3, bend, bend]))
        step, refused = found.step([1e-3, 0.0])
        assert np.linalg.norm(step) <= 1e-3 / found.bases.values[found.bases.rank - 1] * (1 + 1e-12)
        assert found.kept_condition <= 1e5
        lost = found.bases.rank < 2
        assert lost == (bend <= 1e-5)
        assert (np.linalg.norm(refused) > 0) == lost
