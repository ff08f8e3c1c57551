from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vgtsim.errors import ReachError
from vgtsim.geometry import segment_distance
from vgtsim.kinematics.bending import bend_all, swing
from vgtsim.redundancy import SolverSettings, Surroundings, descent, solve_goal
from vgtsim.redundancy.problem import Problem
from vgtsim.redundancy.strokes import bring_inside, make_box

GOAL = 1e-9  # the accuracy a solved goal is promised to have, m and rad
ROUNDING = 1e-12  # a few hundred roundings of metres
SLOPE = 2e-6  # relative, of central differences with a step of 1e-6 against curvatures near the end of a stroke
STEP = 1e-6


@pytest.fixture(scope="module")
def posture(hanging_arm):
    return bend_all(hanging_arm, np.radians([20.0, 30.0, 30.0, 20.0, 0.0]), -3.0)


@pytest.fixture(scope="module")
def tank_around(hanging_arm, type_ii):
    return Surroundings(hanging_arm, type_ii, 0.15, 0.4572)


def random_inputs(chain, rng, margin):
    low, high = chain.stroke
    return chain.inputs_from_lengths(low + margin + (high - low - 2 * margin) * rng.random(low.shape))


def goal_problem(chain, around):
    return Problem(
        chain,
        make_box(chain, 0.005),
        np.array([4.0, -8.0, 1.0]),
        np.array([0.6, 0.0, 0.8]),
        around,
        1.5,
        0.5,
        7.0,
    )


@pytest.mark.parametrize("seed", range(8))
def test_goals_made_by_forward_kinematics_are_met(hanging_arm, posture, seed):
    position, direction = hanging_arm.tool(random_inputs(hanging_arm, np.random.default_rng(seed), 0.03))
    found = solve_goal(hanging_arm, "made", position, direction, posture)
    at, along = hanging_arm.tool(found.q)
    assert found.converged
    assert np.linalg.norm(at - position) <= GOAL
    assert np.linalg.norm(np.cross(along, direction)) <= GOAL
    assert along @ direction > 0
    assert found.position_error == pytest.approx(np.linalg.norm(at - position), abs=ROUNDING)


def test_no_iterate_leaves_the_strokes(hanging_arm, posture, monkeypatch):
    seen = []
    make = descent.Iterate
    monkeypatch.setattr(descent, "Iterate", lambda q, *rest: seen.append(q) or make(q, *rest))
    margin = 0.02
    near_the_end = random_inputs(hanging_arm, np.random.default_rng(3), 0.021)
    position, direction = hanging_arm.tool(near_the_end)
    solve_goal(hanging_arm, "edge", position, direction, posture, None, SolverSettings(stroke_margin=margin))
    lengths = hanging_arm.lengths(np.array(seen))
    assert len(seen) > 3
    assert np.all(lengths > hanging_arm.stroke[0] + margin)
    assert np.all(lengths < hanging_arm.stroke[1] - margin)


def test_solution_keeps_the_clearance_asked_for(hanging_arm, posture, tank_around):
    goal = ([-9.3, -3.4, 0.9], [-0.9, -0.34, -0.25])
    asked = {wanted: SolverSettings(clearance=wanted) for wanted in (0.05, 0.2)}
    found = {wanted: solve_goal(hanging_arm, "low", *goal, posture, tank_around, how) for wanted, how in asked.items()}
    for wanted, solution in found.items():
        assert solution.clearance >= wanted
        assert tank_around.least(solution.q)[0] == solution.clearance
    careless = solve_goal(hanging_arm, "low", *goal, posture)
    assert careless.clearance == np.inf


def test_shortfall_of_a_goal_beyond_the_straight_arm_is_the_distance_to_it(hanging_arm, posture):
    box = make_box(hanging_arm, 0.005)
    longest = hanging_arm.inputs_from_lengths(box.least)
    tip, down = hanging_arm.tool(longest)
    beyond = 0.7
    with pytest.raises(ReachError) as caught:
        solve_goal(hanging_arm, "deep", tip + beyond * down, down, posture)
    assert caught.value.shortfall == pytest.approx(beyond, abs=0.02)  # the actuators stop short of the ends by mm
    assert set(caught.value.binding) == {f"m{a}/actuator/{i} retracted" for a in range(1, 6) for i in range(1, 4)}


def test_goal_that_cannot_be_met_clear_of_things_names_what_is_near(hanging_arm, posture, tank_around):
    by_the_wall = ([-10.9, 0.0, 3.0], [-1.0, 0.0, 0.0])
    settings = SolverSettings(clearance=0.6, most=25)
    with pytest.raises(ReachError, match="shell") as caught:
        solve_goal(hanging_arm, "close", *by_the_wall, posture, tank_around, settings)
    assert caught.value.shortfall == 0.0
    assert caught.value.binding == ("shell",)


def test_goal_beyond_the_wall_names_the_wall(hanging_arm, posture, tank_around):
    settings = SolverSettings(most=25)
    with pytest.raises(ReachError, match="near enough") as caught:
        solve_goal(hanging_arm, "outside", [-12.5, 0.0, 4.0], [-1.0, 0.0, 0.0], posture, tank_around, settings)
    assert caught.value.shortfall == 0.0
    assert caught.value.binding == ("shell",)


def test_same_problem_has_the_same_solution_bit_for_bit(hanging_arm, posture, tank_around):
    goal = ([8.0, -4.0, 3.0], [0.9, -0.4, 0.1])
    first, second = (solve_goal(hanging_arm, "again", *goal, posture, tank_around) for _ in range(2))
    assert first.q.tobytes() == second.q.tobytes()
    assert not first.q.flags.writeable


def test_planar_goal_has_a_planar_solution(hanging_arm, posture):
    angle = 1.1
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    found = solve_goal(hanging_arm, "plane", 9 * outward + [0, 0, 3.0], outward, posture)
    nodes_across = found.q[:, 0] * np.sin(-angle) - found.q[:, 1] * np.cos(-angle)
    assert np.max(np.abs(nodes_across)) < 0.02  # a sideways bend of 2 degrees


def test_swing_turns_the_tool_about_the_mast(hanging_arm):
    q, angle = random_inputs(hanging_arm, np.random.default_rng(5), 0.1), 0.7
    position, direction = hanging_arm.tool(q)
    turned_position, turned_direction = hanging_arm.tool(swing(hanging_arm, q, angle))
    cos, sin = np.cos(-angle), np.sin(-angle)  # z of the hanging base points down
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned_position, turn @ position, atol=ROUNDING)
    np.testing.assert_allclose(turned_direction, turn @ direction, atol=ROUNDING)


def test_bring_inside_moves_only_modules_that_are_outside(hanging_arm):
    box = make_box(hanging_arm, 0.005)
    q = np.array(hanging_arm.straight)
    q[2, 0] = 0.6
    moved = bring_inside(hanging_arm, box, q)
    assert np.all(box.spare(hanging_arm.lengths(moved)) > 0)
    np.testing.assert_array_equal(np.delete(moved, 2, axis=0), np.delete(q, 2, axis=0))


def test_slopes_are_those_of_central_differences(hanging_arm, tank_around):
    problem = goal_problem(hanging_arm, tank_around)
    rng = np.random.default_rng(11)
    q = random_inputs(hanging_arm, rng, 0.05)
    move = rng.standard_normal(q.shape)

    def objective(x):
        return problem.objective(x, hanging_arm.lengths(x))

    rise = (objective(q + STEP * move) - objective(q - STEP * move)) / (2 * STEP)
    assert problem.slopes(q)[0] @ move.ravel() == pytest.approx(rise, rel=SLOPE)
    shift = (problem.error(q + STEP * move) - problem.error(q - STEP * move)) / (2 * STEP)
    np.testing.assert_allclose(problem.error_jacobian(q) @ move.ravel(), shift, rtol=SLOPE, atol=SLOPE)
    bare = replace(problem, surroundings=None)
    assert bare.objective(q, hanging_arm.lengths(q)) < objective(q)  # hinges took part


def test_direction_rows_see_the_opposite_direction(hanging_arm):
    q = random_inputs(hanging_arm, np.random.default_rng(2), 0.1)
    position, direction = hanging_arm.tool(q)
    problem = replace(goal_problem(hanging_arm, None), position=position, direction=direction)
    assert np.linalg.norm(problem.error(q)) < ROUNDING
    nearly = -direction + 1e-3 * problem.axes[0]
    opposite = replace(problem, direction=nearly / np.linalg.norm(nearly))
    assert np.linalg.norm(opposite.error(q)) > 1e3


def test_rows_and_clearance_agree(hanging_arm, tank_around):
    rng = np.random.default_rng(7)
    q = np.array([random_inputs(hanging_arm, rng, 0.1) for _ in range(6)])
    reach = 0.45  # below what separates modules that the rows leave out
    least = tank_around.clearance(q)[0]
    rows = tank_around.rows(q, reach)
    assert np.any(least < reach)
    for w in np.flatnonzero((least < reach) & (least > 0)):
        assert rows.gap[rows.config == w].min() == pytest.approx(least[w], abs=1e-9)


def test_row_gradients_are_those_of_central_differences(hanging_arm, tank_around):
    rng = np.random.default_rng(13)
    q = bend_all(hanging_arm, np.radians([30.0, 40.0, 20.0, 10.0, 0.0]), -0.9)[None]
    move = rng.standard_normal(q.shape)
    rows = tank_around.rows(q, 2.0)
    ahead, behind = (tank_around.rows(q + sign * STEP * move, 2.0, slopes=False) for sign in (1, -1))
    assert len(rows.gap) > 20
    assert len(rows.gap) == len(ahead.gap) == len(behind.gap)
    rise = (ahead.gap - behind.gap) / (2 * STEP)
    np.testing.assert_allclose(rows.gradient @ move.ravel(), rise, rtol=1e-4, atol=1e-4)


def test_modules_two_apart_stay_apart_over_the_strokes(hanging_arm, tank_around):
    rng = np.random.default_rng(17)
    low, high = hanging_arm.stroke
    corners = np.round(rng.random((60, *low.shape)))  # ends of strokes are the worst
    q = hanging_arm.inputs_from_lengths(low + corners * (high - low))
    capsules, points = tank_around.capsules, tank_around.points(q)
    first, second = np.nonzero(capsules.module[None, :] - capsules.module[:, None] == 2)
    a, b = points[:, capsules.ends[first]], points[:, capsules.ends[second]]
    distance = segment_distance(a[..., 0, :], a[..., 1, :], b[..., 0, :], b[..., 1, :])[0]
    assert np.min(distance - capsules.radii[first] - capsules.radii[second]) > 0.45
