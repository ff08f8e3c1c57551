from __future__ import annotations

import numpy as np
import pytest

from studies.free_ratios import couple_freely
from vgtsim.errors import GoalError
from vgtsim.positioning import methods
from vgtsim.positioning.goals import GoalSpace, Position, tool_goal
from vgtsim.positioning.methods import anchor_successively, solve
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.objectives import LengthVariation, MidStroke
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.reduction import Reduction, anchor, couple
from vgtsim.positioning.strokes import make_box

GOAL = 1e-9
STEP = 1e-6
PAIRS = ((0, 1), (4, 3))  # modules 1 and 2, 4 and 5 of section 8.1


@pytest.fixture(scope="module")
def box(hanging_arm):
    return make_box(hanging_arm, 0.005)


@pytest.fixture(scope="module")
def target(hanging_arm):
    q = np.array(hanging_arm.straight)
    q[::3], q[1::3] = [0.2, 0.2, 0.1, -0.1, -0.1], [0.05, 0.05, -0.1, 0.0, 0.0]
    return tool_goal(*hanging_arm.tool(q))


def test_slopes_of_a_reduction_are_those_of_differences(hanging_arm):
    rng = np.random.default_rng(0)
    for reduction in (
        couple(hanging_arm.straight, PAIRS),
        couple_freely(hanging_arm.straight, PAIRS),
        Reduction(np.eye(15), np.zeros(15)),
    ):
        z = rng.standard_normal((4, reduction.order))
        move = rng.standard_normal(z.shape)
        rise = (reduction.inputs(z + STEP * move) - reduction.inputs(z - STEP * move)) / (2 * STEP)
        np.testing.assert_allclose((reduction.slope(z) @ move[..., None])[..., 0], rise, atol=1e-8)
        np.testing.assert_allclose(reduction.variables(reduction.inputs(z)), z, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("tie", "order"), [(couple, 9), (couple_freely, 11)])
def test_coupled_arm_meets_the_goal_with_coupled_inputs(hanging_arm, box, target, tie, order):
    """Equation 8.7: fifteen inputs become nine; with a free ratio for each pair, eleven."""
    zero = hanging_arm.straight
    reduction = tie(zero, PAIRS)
    assert reduction.order == order
    problem = Problem(box, target, MidStroke(), reduction=reduction)
    found = solve(problem, hanging_arm.straight)
    assert found.met[0]
    away = (found.q[0] - hanging_arm.straight).reshape(5, 3)
    for follower, leader in PAIRS:
        k = np.dot(away[follower], away[leader]) / np.dot(away[leader], away[leader])
        np.testing.assert_allclose(away[follower], k * away[leader], atol=1e-12)
        assert tie is couple_freely or k == pytest.approx(1.0)


def test_one_pair_with_a_free_ratio_leaves_thirteen(hanging_arm):
    assert couple_freely(hanging_arm.straight, ((0, 1),)).order == 13
    assert couple(hanging_arm.straight, ((0, 1),)).order == 12


def test_reduced_optimum_is_no_better_than_the_whole_one(hanging_arm, box, target):
    """Section 7.1: tau-dagger against tau-star; figure 8.2's objective (8.8)."""
    objective, how = LengthVariation(0.005), NewtonSettings(most=300)
    start = solve(Problem(box, target, MidStroke()), hanging_arm.straight).q[0]
    coupled = Problem(box, target, objective, reduction=couple(hanging_arm.straight, PAIRS))
    reduced = solve(coupled, hanging_arm.straight, how)
    free = solve(Problem(box, target, objective), reduced.q[0], how)
    assert reduced.met[0]
    assert free.optimal[0]
    length = hanging_arm.lengths(np.array([free.q[0], start]))
    after, before = np.sum(np.abs(length - length.mean(axis=1, keepdims=True)), axis=1)  # (8.8) as printed
    assert after < before
    assert free.value[0] <= reduced.value[0]


def test_anchored_inputs_stay(hanging_arm, box, target):
    q = solve(Problem(box, target), hanging_arm.straight).q[0]
    fixed = np.zeros(15, bool)
    fixed[3:6], fixed[11] = True, True
    problem = Problem(box, target, MidStroke(), reduction=anchor(q, fixed))
    found = solve(problem, q)
    assert found.optimal[0]
    np.testing.assert_array_equal(found.q[0][fixed], q[fixed])


@pytest.fixture
def windows(monkeypatch):
    """The problem and the start of each window of an anchoring."""
    begun, plain = [], methods.solve

    def follow(problem, start, settings):
        begun.append((problem, start))
        return plain(problem, start, settings)

    monkeypatch.setattr(methods, "solve", follow)
    return begun


def check_descent(problem, windows, found):
    """The objective never rises from window to window, and the windows come to an end before their greatest number."""
    count = found.notes["stages"]
    starts = np.array([start for _, start in windows[1 : count + 1]] + [found.q[0]])  # the first solve is for the goal
    values = solve(problem, starts, NewtonSettings(most=0)).value
    assert np.all(np.diff(values) <= 1e-12 * (1 + np.abs(values[:-1])))
    assert count < methods._STAGES
    assert values[-1] == pytest.approx(found.value[0])


def test_successive_anchoring_comes_to_the_whole_optimum(hanging_arm, box, target, windows):
    problem = Problem(box, target, MidStroke())
    best = solve(problem, hanging_arm.straight)
    found = anchor_successively(problem, hanging_arm.straight, 3)
    check_descent(problem, windows, found)
    assert found.value[0] == pytest.approx(best.value[0], rel=1e-4)
    assert found.met[0]


def test_successive_anchoring_of_a_coupled_arm_comes_to_the_coupled_optimum(hanging_arm, box, target, windows):
    """Two modules next to the mast move as one in every window; no window ever has all."""
    start = solve(Problem(box, target, reduction=couple(hanging_arm.straight, PAIRS)), hanging_arm.straight).q[0]
    tied = couple(hanging_arm.straight, PAIRS[:1])
    problem = Problem(box, target, MidStroke(), reduction=tied)
    best = solve(problem, start)
    found = anchor_successively(problem, start, 3)
    assert best.optimal[0]
    check_descent(problem, windows, found)
    assert found.value[0] == pytest.approx(best.value[0], rel=1e-4)
    q = found.q[0]
    np.testing.assert_allclose((q - hanging_arm.straight)[3:6], (q - hanging_arm.straight)[:3], atol=1e-12)
    held = anchor(q, np.arange(15) < 6, tied)
    assert held.order == 9
    np.testing.assert_array_equal(held.inputs(np.zeros(9))[:6], q[:6])


def test_couplings_that_leave_too_few_inputs_are_refused(hanging_arm, box, target):
    tied = couple(hanging_arm.straight, tuple((i, 4) for i in range(4)))
    with pytest.raises(GoalError, match="5 goal rows for 3 inputs"):
        solve(Problem(box, target, reduction=tied), hanging_arm.straight)
    with pytest.raises(GoalError, match="5 goal rows for 3 free inputs of 15"):
        anchor_successively(Problem(box, target), hanging_arm.straight, 1)
    with pytest.raises(ValueError, match="may follow once"):
        couple(hanging_arm.straight, ((0, 1), (1, 2)))


def test_anchored_arm_that_cannot_reach_says_so(hanging_arm, box):
    goal = GoalSpace((Position(np.array([0.0, 0.0, 100.0])),))
    with pytest.raises(GoalError, match="not met even with all inputs free"):
        anchor_successively(Problem(box, goal), hanging_arm.straight, 3, NewtonSettings(most=10))
