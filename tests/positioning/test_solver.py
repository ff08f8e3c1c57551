from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.optimize import least_squares

from vgtsim.description import Method
from vgtsim.errors import ReachError
from vgtsim.geometry import enclosure_distance, segment_distance
from vgtsim.kinematics import bend_all, swing
from vgtsim.positioning import Keep, Surroundings, solve_by_method, solver
from vgtsim.positioning.goals import evaluate, tool_goal
from vgtsim.positioning.objectives import (
    ClearanceHinges,
    Configurations,
    MidStroke,
    StrokeBarrier,
    WeightedSum,
    goal_plane,
)
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.reduction import couple
from vgtsim.positioning.restarts import bring_starts_inside, likely_starts
from vgtsim.positioning.solver import come_nearest
from vgtsim.positioning.strokes import bring_inside, make_box

pytestmark = pytest.mark.long

GOAL = 1e-9  # the accuracy a solved goal is promised to have, m and rad
ROUNDING = 1e-12  # a few hundred roundings of metres
NEAR = 1e-9  # m: of a point to the surface that it is on
STEP = 1e-6
BEND_STEP = 1e-5  # of second differences of values


@pytest.fixture(scope="module")
def posture(hanging_arm):
    return bend_all(hanging_arm, np.radians([20.0, 30.0, 30.0, 20.0, 0.0]), -3.0)


@pytest.fixture(scope="module")
def tank_around(hanging_arm, type_ii):
    return Surroundings(hanging_arm, type_ii, 0.15, 0.4572)


def random_inputs(chain, rng, margin):
    low, high = chain.stroke
    return chain.inputs_from_lengths(low + margin + (high - low - 2 * margin) * rng.random(low.shape))


def tool_problem(chain, position, direction, margin=0.005, objective=None):
    box = make_box(chain, margin)
    return Problem(box, tool_goal(position, direction), objective or StrokeBarrier())


def ask(chain, name, position, direction, posture, keep=None, method=Method.NULLSPACE, **more):
    problem = replace(tool_problem(chain, position, direction, **more), method=method, keep=keep)
    return solve_by_method(name, problem, posture)


@pytest.mark.parametrize("seed", range(8))
def test_goals_made_by_forward_kinematics_are_met(hanging_arm, posture, seed):
    position, direction = hanging_arm.tool(random_inputs(hanging_arm, np.random.default_rng(seed), 0.03))
    found = ask(hanging_arm, "made", position, direction, posture)
    at, along = hanging_arm.tool(found.q)
    assert np.linalg.norm(at - position) <= GOAL * np.sqrt(3)
    assert np.linalg.norm(np.cross(along, direction)) <= GOAL * np.sqrt(2)
    assert along @ direction > 0
    np.testing.assert_allclose(found.error[:3], at - position, atol=ROUNDING)
    assert found.optimal


def test_no_iterate_leaves_the_strokes(hanging_arm, posture, monkeypatch):
    seen = []
    evaluate = Problem.model

    def watched(self, z, which):
        found = evaluate(self, z, which)
        seen.append((self.inputs(z), found.inside))
        return found

    monkeypatch.setattr(Problem, "course", None)  # what is compiled whole shows no iterate
    monkeypatch.setattr(Problem, "model", watched)
    margin = 0.02
    near_the_end = random_inputs(hanging_arm, np.random.default_rng(3), 0.021)
    position, direction = hanging_arm.tool(near_the_end)
    found = ask(hanging_arm, "edge", position, direction, posture, margin=margin)
    tried, inside = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    lengths = hanging_arm.lengths(np.concatenate([tried[inside], found.q[None]]))
    assert np.sum(inside) > 3
    assert np.all(lengths > hanging_arm.stroke[0] + margin)
    assert np.all(lengths < hanging_arm.stroke[1] - margin)


@pytest.mark.parametrize("objective", [None, MidStroke()], ids=["barrier", "mid_stroke"])
def test_solution_keeps_the_clearance_asked_for(hanging_arm, posture, tank_around, objective):
    goal = ([-9.3, -3.4, 0.9], [-0.9, -0.34, -0.25])
    careless = ask(hanging_arm, "low", *goal, posture, objective=objective)
    assert careless.clearance == np.inf
    least = tank_around.least(careless.q)[0]
    for wanted in (0.05, max(0.15, least + 0.02)):  # the second not kept by luck
        found = ask(hanging_arm, "low", *goal, posture, Keep(tank_around, wanted), objective=objective)
        assert found.clearance >= wanted
        assert tank_around.least(found.q)[0] == found.clearance


def test_shortfall_of_a_goal_beyond_the_straight_arm_is_the_distance_to_it(hanging_arm, posture):
    box = make_box(hanging_arm, 0.005)
    longest = hanging_arm.inputs_from_lengths(box.least)
    tip, down = hanging_arm.tool(longest)
    beyond = 0.7
    with pytest.raises(ReachError, match="nearest at") as caught:
        ask(hanging_arm, "deep", tip + beyond * down, down, posture)
    assert caught.value.shortfall == pytest.approx(beyond, abs=0.02)  # the actuators stop short of the ends by mm
    assert set(caught.value.binding) == {f"m{a}/actuator/{i} retracted" for a in range(1, 6) for i in range(1, 4)}


def test_no_posture_comes_nearer_than_the_nearest(hanging_arm, posture):
    goal = ([-3.0, 0.0, 3.0], [1.0, 0.0, 0.0])  # back towards the mast: bent too far
    problem = tool_problem(hanging_arm, *goal)
    q, left = come_nearest(
        problem, bring_starts_inside(problem, likely_starts(hanging_arm, posture, np.array(goal[0])))
    )
    best = np.argmin(np.linalg.norm(left, axis=1))
    box, start = problem.box, hanging_arm.lengths(q[best])

    @lru_cache(maxsize=1)  # error and slopes are asked for one after the other
    def find_rows(*lengths):
        state = problem.chain.state(hanging_arm.inputs_from_lengths(np.array(lengths), start=q[best])[None])
        error, J = evaluate(hanging_arm, problem.goal, state, np.zeros(1, int))
        return error[0], np.linalg.solve(state.leg_slopes[0].T, J[0].T).T

    other = least_squares(
        lambda lengths: find_rows(*lengths)[0],
        start,
        lambda lengths: find_rows(*lengths)[1],
        (box.least, box.greatest),
    )
    assert np.linalg.norm(left[best]) > 0.01
    assert np.linalg.norm(left[best]) <= 1.02 * np.linalg.norm(other.fun)  # the barrier keeps millimetres


def test_goal_that_cannot_be_met_clear_of_things_names_what_is_near(hanging_arm, posture, tank_around):
    by_the_wall = ([-10.9, 0.0, 3.0], [-1.0, 0.0, 0.0])
    with pytest.raises(ReachError, match="shell") as caught:
        ask(hanging_arm, "close", *by_the_wall, posture, Keep(tank_around, 0.6))
    assert caught.value.shortfall == 0.0
    assert caught.value.binding == ("shell",)


def test_goal_beyond_the_wall_names_the_wall(hanging_arm, posture, tank_around):
    with pytest.raises(ReachError, match="near enough") as caught:
        ask(hanging_arm, "outside", [-12.5, 0.0, 4.0], [-1.0, 0.0, 0.0], posture, Keep(tank_around, 0.1))
    assert caught.value.shortfall == 0.0
    assert caught.value.binding == ("shell",)


def test_same_problem_has_the_same_solution_bit_for_bit(hanging_arm, posture, tank_around):
    goal = ([8.0, -4.0, 3.0], [0.9, -0.4, 0.1])
    first, second = (ask(hanging_arm, "again", *goal, posture, Keep(tank_around, 0.1)) for _ in range(2))
    assert first.q.tobytes() == second.q.tobytes()
    assert not first.q.flags.writeable


def test_planar_goal_has_a_planar_solution(hanging_arm, posture):
    angle = 1.1
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    goal = (9 * outward + [0, 0, 3.0], outward)
    objective = WeightedSum(((1000.0, goal_plane(hanging_arm, goal[0])), (1.0, StrokeBarrier())))
    found = ask(hanging_arm, "plane", *goal, posture, objective=objective)
    nodes_across = found.q[::3] * np.sin(-angle) - found.q[1::3] * np.cos(-angle)
    assert np.max(np.abs(nodes_across)) < 0.02  # a sideways bend of 2 degrees


def test_coupled_solution_is_coupled(hanging_arm, posture):
    reduction = couple(hanging_arm.straight, ((0, 1), (4, 3)))
    z = reduction.variables(bend_all(hanging_arm, np.radians([30.0, 30.0, 10.0, 5.0, 5.0]), 0.4))
    position, direction = hanging_arm.tool(reduction.inputs(z))
    problem = tool_problem(hanging_arm, position, direction)
    found = solve_by_method("coupled", replace(problem, reduction=reduction, method=Method.COUPLED), posture)
    np.testing.assert_allclose(found.q[:3], found.q[3:6], atol=ROUNDING)
    np.testing.assert_allclose(found.q[12:], found.q[9:12], atol=ROUNDING)
    assert np.linalg.norm(hanging_arm.tool(found.q)[0] - position) <= GOAL * np.sqrt(3)


def test_a_method_that_finds_no_curve_names_the_goal(hanging_arm, posture, monkeypatch):
    def refuse(*_):
        raise ReachError("shape", 1.5, ("a limit",), "no curve")

    monkeypatch.setattr(solver, "solve_shapes", refuse)
    with pytest.raises(ReachError, match="no curve") as caught:
        ask(hanging_arm, "far", [0.0, 0.0, -30.0], [0.0, 0.0, -1.0], posture, method=Method.SHAPE)
    assert (caught.value.goal, caught.value.shortfall, caught.value.binding) == ("far", 1.5, ("a limit",))


def test_plane_and_hinges_have_the_slopes_and_curvatures_of_differences(hanging_arm, tank_around):
    q = bend_all(hanging_arm, np.radians([30.0, 40.0, 20.0, 10.0, 0.0]), -0.9) + 0.02
    box, which = make_box(hanging_arm, 0.0), np.zeros(1, int)
    move = np.random.default_rng(13).standard_normal(q.shape)

    def at(x):
        return Configurations(box, hanging_arm.state(x[None]), which)

    hinges = ClearanceHinges(tank_around, 1.5, 0.5)
    for objective in (goal_plane(hanging_arm, [4.0, -8.0, 1.0]), hinges, WeightedSum(((2.0, hinges),))):
        ahead, here, behind = (objective.terms(at(q + sign * BEND_STEP * move)) for sign in (1, 0, -1))
        rise = (ahead.value - behind.value)[0] / (2 * BEND_STEP)
        assert here.slope[0] @ move == pytest.approx(rise, rel=1e-4)
        curve = here.curve[0] + objective.curvature(at(q))
        bend = (ahead.value - 2 * here.value + behind.value)[0] / BEND_STEP**2
        assert np.squeeze(move @ np.squeeze(curve) @ move) == pytest.approx(bend, rel=1e-3)
    left_out = hinges.curvature(at(q))[0]
    assert np.abs(left_out).max() > 0.1 * np.abs(hinges.terms(at(q)).curve).max()  # it matters


def test_what_the_goal_holds_is_no_part_of_the_hinges(hanging_arm, tank_around):
    q = ask(hanging_arm, "low", [-9.3, -3.4, 0.5], [-0.9, -0.34, 0.1], bend_all(hanging_arm, np.zeros(5), 0.0)).q
    both, bare = (tank_around.rows(q[None], 0.6, payload=payload).gap for payload in (True, False))
    tool = hanging_arm.tool(q)[0]
    own = tool[2] - tank_around.obstacles.waste_level - 0.15
    assert np.min(np.abs(both - own)) < ROUNDING
    assert np.min(np.abs(bare - own)) > 1e-6
    assert len(bare) < len(both)


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
    q[6] = 0.6
    moved = bring_inside(box, q)
    assert np.all(box.spare(hanging_arm.lengths(moved)) > 0)
    np.testing.assert_array_equal(np.delete(moved, [6, 7, 8]), np.delete(q, [6, 7, 8]))


def test_rows_and_clearance_agree(hanging_arm, tank_around):
    rng = np.random.default_rng(7)
    q = np.array([random_inputs(hanging_arm, rng, 0.1) for _ in range(6)])
    reach = 0.45  # below what separates modules that the rows leave out
    least = tank_around.clearance(q)[0]
    rows = tank_around.rows(q, reach)
    assert np.any(least < reach)
    for w in np.flatnonzero((least < reach) & (least > 0)):
        assert rows.gap[rows.config == w].min() == pytest.approx(least[w], abs=1e-9)


def test_the_line_of_the_least_gap_goes_from_the_arm_to_what_is_near(hanging_arm, tank_around):
    rng = np.random.default_rng(23)
    capsules, around, kinds = tank_around.capsules, tank_around.obstacles, set()
    for _ in range(60):
        angles = np.radians(rng.uniform(0, 35, 5)) * [1, 1, 1, 1, 0]
        q = bend_all(hanging_arm, angles, rng.uniform(-np.pi, np.pi))
        points = tank_around.points(q[None])[0]
        found = tank_around.find_nearest(points, 3.0)
        assert found.gap == tank_around.rows(q[None], 3.0).gap.min()
        if found.gap <= 0:
            continue
        on_arm, other = found.ends
        assert tank_around.find_nearest(points, found.gap / 2) is None
        assert np.linalg.norm(other - on_arm) == pytest.approx(found.gap, abs=ROUNDING)

        def off_arm(place, points=points):
            a, b = points[capsules.ends[:, 0]], points[capsules.ends[:, 1]]
            balls = np.linalg.norm(points - place, axis=1) - capsules.point_radii
            return np.append(segment_distance(a, b, place, place)[0] - capsules.radii, balls)

        walls = enclosure_distance(tank_around.tank, tank_around.profile, other)[0], other[2] - around.waste_level
        posts = segment_distance(around.axes[:, 0], around.axes[:, 1], other, other)[0] - around.radii
        mast = segment_distance(*tank_around.mast_axis, other, other)[0] - tank_around.mast_radius
        assert np.abs(off_arm(on_arm)).min() < NEAR
        assert np.abs([*walls, *posts, mast, *off_arm(other)]).min() < NEAR
        kinds.add(found.bodies.split(" to ")[1])
    assert len(kinds) > 2


def test_row_gradients_are_those_of_central_differences(hanging_arm, tank_around):
    rng = np.random.default_rng(13)
    q = bend_all(hanging_arm, np.radians([30.0, 40.0, 20.0, 10.0, 0.0]), -0.9)[None]
    move = rng.standard_normal(q.shape)
    rows = tank_around.rows(q, 2.0)
    ahead, behind = (tank_around.rows(q + sign * STEP * move, 2.0, slopes=False) for sign in (1, -1))
    assert len(rows.gap) > 20
    assert len(rows.gap) == len(ahead.gap) == len(behind.gap)
    rise = (ahead.gap - behind.gap) / (2 * STEP)
    np.testing.assert_allclose(rows.gradient @ move[0], rise, rtol=1e-4, atol=1e-4)


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
