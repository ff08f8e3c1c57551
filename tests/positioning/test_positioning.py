from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.planar import PlanarArm
from vgtsim.errors import GoalError, ObjectiveError
from vgtsim.positioning.goals import (
    Direction,
    GoalSpace,
    Orientation,
    Position,
    evaluate,
    report_rows,
    tabulate,
    tool_goal,
)
from vgtsim.positioning.methods import solve
from vgtsim.positioning.newton import NewtonSettings, Quadratic, condition_numbers, minimise
from vgtsim.positioning.objectives import (
    ClearanceHinges,
    Configurations,
    Differences,
    LengthVariation,
    MidStroke,
    Nearness,
    StrokeBarrier,
    WeightedSum,
)
from vgtsim.positioning.problem import Problem, lagrangian_curvature
from vgtsim.positioning.solver import solve_anywhere
from vgtsim.positioning.strokes import make_box
from vgtsim.positioning.surroundings import Surroundings

GOAL = 1e-9  # each row, m and rad
LAST_STEP = 1e-7  # of inputs, ten times what two processors were apart
ROUNDING = 1e-12
STEP = 1e-6
SLOPE = 3e-6  # of central differences with that step
BEND = 2e-3  # of one-sided differences with a step of 1e-5 against curvatures near the end of a stroke, relative


@pytest.fixture(scope="module")
def box(hanging_arm):
    return make_box(hanging_arm, 0.005)


def random_inputs(chain, seed, count, margin=0.03):
    low, high = chain.stroke
    part = np.random.default_rng(seed).random((count, *low.shape))
    return chain.inputs_from_lengths(low + margin + (high - low - 2 * margin) * part)


def goal_spaces(chain, q):
    R, P = chain.frames(q)
    position, direction = chain.tool(q)
    return {
        "tool": tool_goal(position, direction),
        "partial": GoalSpace((Position(position, axes="xz"), Orientation(R[:, -1]))),
        "intermediate": GoalSpace(
            (Position(P[:, 5], module="m3"), Direction(R[:, 4, :, 2], module="s2"), Position(position))
        ),
    }


def test_state_agrees_with_the_chain(hanging_arm):
    q = random_inputs(hanging_arm, 1, 20)
    state = hanging_arm.state(q)
    tool, _, J = hanging_arm.tool_jacobian(q)
    linear, angular = (np.swapaxes(half, -1, -2) for half in (J[:, :3], J[:, 3:]))
    at_origin = linear - np.cross(angular, tool[:, None])  # a state's velocities are of the point at the origin of G
    pairs = zip(
        (*state.motion[2:], state.legs, state.leg_slopes),
        (angular, at_origin, *hanging_arm.length_jacobian(q)),
        strict=True,
    )
    for ours, theirs in pairs:
        np.testing.assert_allclose(ours, theirs, atol=ROUNDING)
    assert np.all(state.assembles)


def test_state_marks_what_does_not_assemble(hanging_arm):
    q = np.repeat(hanging_arm.straight[None], 3, axis=0)
    q[1, 6], q[2, 14] = 1.2, 2.0
    assert hanging_arm.state(q).assembles.tolist() == [True, False, False]


@pytest.mark.parametrize("name", ["tool", "partial", "intermediate"])
def test_row_jacobian_and_curvature_are_those_of_differences(hanging_arm, name):
    q, rng = random_inputs(hanging_arm, 2, 3), np.random.default_rng(3)
    goal, which = goal_spaces(hanging_arm, q)[name], np.arange(3)
    state = hanging_arm.state(q)
    error, J = evaluate(hanging_arm, goal, state, which)
    np.testing.assert_allclose(error, 0.0, atol=ROUNDING * 10)
    weights, pull = rng.standard_normal(error.shape), rng.standard_normal(q.shape)

    def slope(x):
        there = hanging_arm.state(x)
        rows = np.einsum("bri,br->bi", evaluate(hanging_arm, goal, there, which)[1], weights)
        return rows + there.pull(pull)

    numeric = np.empty((3, 15, 15))
    for i in range(15):
        shift = STEP * np.eye(15)[i]
        ahead, behind = (evaluate(hanging_arm, goal, hanging_arm.state(q + s * shift), which)[0] for s in (1, -1))
        np.testing.assert_allclose(J[:, :, i], (ahead - behind) / (2 * STEP), atol=SLOPE)
        numeric[:, i] = (slope(q + shift) - slope(q - shift)) / (2 * STEP)
    found = lagrangian_curvature(tabulate(state.chain, goal), state, which, weights, pull)
    numeric = (numeric + np.swapaxes(numeric, 1, 2)) / 2
    np.testing.assert_allclose(found, numeric, atol=BEND * np.abs(numeric).max())


@pytest.mark.parametrize("away", [0.3, -0.4])
def test_rows_away_from_the_goal_have_their_jacobian(hanging_arm, away):
    q = random_inputs(hanging_arm, 4, 2)
    goal, which = goal_spaces(hanging_arm, q)["partial"], np.arange(2)
    q = q + away * np.tile([0.1, -0.05, 0.02], 5)
    move = np.random.default_rng(5).standard_normal(q.shape)
    J = evaluate(hanging_arm, goal, hanging_arm.state(q), which)[1]
    ahead, behind = (evaluate(hanging_arm, goal, hanging_arm.state(q + s * STEP * move), which)[0] for s in (1, -1))
    np.testing.assert_allclose((J @ move[..., None])[..., 0], (ahead - behind) / (2 * STEP), rtol=SLOPE, atol=SLOPE)


def objectives(chain, tank):
    lengths = chain.lengths(random_inputs(chain, 6, 2))
    around = Surroundings(chain, tank, 0.15, 0.4572)
    return (StrokeBarrier(), MidStroke(), LengthVariation(), Nearness(lengths), ClearanceHinges(around, 1.5, 0.5))


def test_objective_slopes_are_those_of_differences(hanging_arm, box, type_ii):
    q = random_inputs(hanging_arm, 7, 2, 0.05)
    move = np.random.default_rng(8).standard_normal(q.shape)

    def terms(objective, x):
        return objective.terms(Configurations(box, hanging_arm.state(x), np.arange(2)))

    whole = WeightedSum(tuple((0.3 + i, part) for i, part in enumerate(objectives(hanging_arm, type_ii))))
    for objective in (*objectives(hanging_arm, type_ii), whole):
        rise = (terms(objective, q + STEP * move).value - terms(objective, q - STEP * move).value) / (2 * STEP)
        slope = terms(objective, q).slope
        np.testing.assert_allclose(np.sum(slope * move, axis=1), rise, rtol=1e-4, err_msg=objective.name)

    def barrier(x):
        length = hanging_arm.state(x).legs
        share = (length - box.least) * (box.greatest - length) / (box.greatest - box.least) ** 2
        return -np.log(4 * share).sum(axis=1)

    by_differences = Differences("copy", barrier)
    np.testing.assert_allclose(
        terms(by_differences, q).slope, terms(StrokeBarrier(), q).slope, rtol=1e-4, atol=1e-4 * np.abs(slope).max()
    )


@pytest.mark.long
def test_goals_far_away_are_met_from_the_stowed_pose(hanging_arm, box):
    position, direction = hanging_arm.tool(random_inputs(hanging_arm, 9, 60))
    found = solve_anywhere(Problem(box, tool_goal(position, direction)), hanging_arm.stowed)
    at, along = hanging_arm.tool(found.q)
    assert np.all(found.met)
    np.testing.assert_allclose(at, position, atol=GOAL * 1.01)
    np.testing.assert_allclose(np.cross(along, direction), 0.0, atol=2 * GOAL)


@pytest.mark.long
@pytest.mark.parametrize("name", ["partial", "intermediate"])
def test_other_goal_spaces_are_met(hanging_arm, box, name):
    q = random_inputs(hanging_arm, 10, 6, 0.12)
    goal = goal_spaces(hanging_arm, q)[name]
    near = q + 0.02 * np.random.default_rng(11).standard_normal(q.shape)
    found = solve_anywhere(Problem(box, goal), near)
    assert np.all(found.met)
    reports = report_rows(hanging_arm, goal_spaces(hanging_arm, q[3:4])[name], found.q[3])
    assert [row.name for row in reports] == list(goal.names)
    assert all(abs(row.residual) <= row.tolerance for row in reports)


@pytest.mark.parametrize("goal", ["tool", "partial", "intermediate"])
@pytest.mark.parametrize("objective", ["barrier", "mid_stroke", "nearness"])
def test_one_compiled_call_finds_what_the_general_way_finds(hanging_arm, box, monkeypatch, goal, objective):
    q = random_inputs(hanging_arm, 31, 4, 0.1)
    wanted = {"barrier": StrokeBarrier(), "mid_stroke": MidStroke(), "nearness": Nearness(hanging_arm.lengths(q[::-1]))}
    problem = Problem(box, goal_spaces(hanging_arm, q)[goal], wanted[objective])
    start = q + 0.004 * np.random.default_rng(5).standard_normal(q.shape)
    assert problem.course is not None
    whole = solve(problem, start)
    monkeypatch.setattr(Problem, "course", None)
    found = solve(replace(problem), start)
    assert np.all(found.optimal)
    # rounding, which another processor does otherwise, may end one of the two an evaluation earlier: its last step is small,
    # and changes the objective by its square
    np.testing.assert_allclose(whole.q, found.q, atol=LAST_STEP)
    np.testing.assert_allclose(whole.value, found.value, atol=GOAL)
    np.testing.assert_allclose(whole.error, 0.0, atol=GOAL)
    short = found.iterations < 10  # a long way along a boundary may be walked in other steps
    assert short.any()
    assert np.abs(whole.iterations - found.iterations)[short].max() <= 1
    for name in ("met", "optimal"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(found, name), err_msg=name)


@pytest.mark.parametrize("objective", [MidStroke(), LengthVariation()], ids=["compiled", "general"])
def test_a_single_goal_is_solved_from_each_of_several_starts(hanging_arm, box, objective):
    starts = random_inputs(hanging_arm, 37, 3, 0.1)
    position, direction = hanging_arm.tool(starts[0])
    found = solve(Problem(box, tool_goal(position, direction), objective), starts)
    same = tool_goal(np.tile(position, (3, 1)), np.tile(direction, (3, 1)))
    repeated = solve(Problem(box, same, objective), starts)
    assert found.q.tobytes() == repeated.q.tobytes()
    assert found.met[0]


def test_one_compiled_call_names_a_start_outside(hanging_arm, box):
    starts = np.stack([box.middle, 1.5 * hanging_arm.straight])
    position, direction = hanging_arm.tool(np.tile(box.middle, (2, 1)))
    with pytest.raises(ValueError, match="start 1 is outside the strokes"):
        solve(Problem(box, tool_goal(position, direction)), starts)


def test_one_compiled_call_leaves_a_saddle_as_the_general_way_does(hanging_arm, box, monkeypatch):
    """A straight arm that has to be shorter: straight, it is stationary, but bent its cylinders are nearer mid-stroke."""
    position, direction = hanging_arm.tool(box.middle)
    problem = Problem(box, tool_goal(position + [0.0, 0.0, 0.8], direction), MidStroke())
    whole = solve(problem, box.middle)
    monkeypatch.setattr(Problem, "course", None)
    found = solve(replace(problem), box.middle)
    assert whole.optimal[0]
    assert np.max(np.abs(whole.q.reshape(-1, 3)[:, :2])) > 0.05
    np.testing.assert_allclose(whole.value, found.value, rtol=1e-6)


@pytest.mark.long
def test_no_iterate_leaves_the_strokes(hanging_arm, box, monkeypatch):
    position, direction = hanging_arm.tool(random_inputs(hanging_arm, 12, 30, 0.006))
    problem = Problem(box, tool_goal(position, direction))
    accepted = []
    local = Problem.model

    def watched(self, z, which):
        found = local(self, z, which)
        accepted.append((z[found.inside], found.inside))
        return found

    monkeypatch.setattr(Problem, "course", None)  # what is compiled whole shows no iterate
    monkeypatch.setattr(Problem, "model", watched)
    found = solve(problem, hanging_arm.straight)
    q = np.concatenate([item[0] for item in accepted])
    lengths = hanging_arm.lengths(q)
    assert np.all((lengths > box.least) & (lengths < box.greatest))
    assert not all(item[1].all() for item in accepted)  # some trials were outside: refused
    assert np.all(box.spare(hanging_arm.lengths(found.q)) > 0)


@pytest.mark.long
@pytest.mark.parametrize("objective", [StrokeBarrier(), MidStroke(), LengthVariation(0.01)], ids=lambda o: o.name)
def test_no_null_space_step_improves_an_optimum(hanging_arm, box, objective):
    """Equation 6.63, with the goal met again after every step."""
    q = random_inputs(hanging_arm, 13, 4, 0.1)
    position, direction = hanging_arm.tool(q)
    problem = Problem(box, tool_goal(position, direction), objective)
    best = solve(problem, q, NewtonSettings(optimality=1e-10, most=200))
    assert np.all(best.optimal)
    assert np.max(best.stationarity) < 1e-3
    rng = np.random.default_rng(14)
    for b in range(4):
        single = tool_goal(position[b], direction[b])
        for _ in range(6):
            step = 0.01 * rng.standard_normal(q[b].shape)
            hold = Nearness(hanging_arm.lengths(best.q[b] + step))
            again = solve(Problem(box, single, hold, barrier=0.0), best.q[b])
            state = hanging_arm.state(again.q)
            at = Configurations(box, state, np.array([0]))
            assert np.linalg.norm(again.q[0] - best.q[b]) > 1e-3
            assert problem.guarded.terms(at).value[0] > best.value[b] - 1e-9


def test_nearby_goals_take_one_factorisation(hanging_arm, box):
    q = random_inputs(hanging_arm, 15, 200, 0.1)
    made = solve(Problem(box, tool_goal(*hanging_arm.tool(q))), q)
    assert np.mean(made.optimal) > 0.98
    start = made.q[made.optimal]
    position, direction = hanging_arm.tool(start)
    step = np.random.default_rng(16).standard_normal(position.shape)
    step *= 0.004 / np.linalg.norm(step, axis=1, keepdims=True)
    found = solve(Problem(box, tool_goal(position + step, direction)), start)
    assert np.all(found.optimal)
    assert found.iterations.mean() <= 1.1


def test_saddles_and_maxima_are_left_for_the_minimum():
    """Half of zᵀ D z on the unit sphere is stationary at every axis and least at the last: eigenvectors of D."""
    D = np.diag([3.0, 2.0, 1.5, 1.0])

    def local(z, which):
        slope, curve = z @ D, np.tile(D, (len(z), 1, 1))
        error = (np.sum(z * z, axis=1, keepdims=True) - 1) / 2
        return Quadratic(np.ones(len(z), bool), error, z[:, None].copy(), 0.5 * np.sum(z * slope, axis=1), slope, curve)

    def curvature(z, which, y, memo):
        return y[:, :, None] * np.eye(4)

    start = np.concatenate([np.eye(4), -np.eye(4)])
    stuck = minimise(local, start)  # without the whole curvature a stationary point is as far as it goes
    np.testing.assert_allclose(stuck.q, start, atol=ROUNDING)
    found = minimise(local, start, curvature=curvature)
    assert np.all(found.optimal)
    np.testing.assert_allclose(found.value, 0.5, atol=1e-6)  # the promise that counts as none
    np.testing.assert_allclose(np.abs(found.q[:, 3]), 1.0, atol=2e-3)
    assert np.all(found.iterations[[3, 7]] == 0)


def test_straight_arm_under_pressure_buckles_and_one_under_tension_does_not(hanging_arm, box):
    """Straight arms are stationary by symmetry. Long battens make one short: bowed, it comes nearer to mid-stroke."""
    pressed, pulled = (
        hanging_arm.inputs_from_lengths(box.least + part * (box.greatest - box.least)) for part in (0.75, 0.25)
    )
    start = np.array([pressed, pulled])
    np.testing.assert_allclose(start.reshape(2, 5, 3)[..., :2], 0.0, atol=ROUNDING)
    problem = Problem(box, tool_goal(*hanging_arm.tool(start)), MidStroke())
    found, before = solve(problem, start), solve(problem, start, NewtonSettings(most=0))
    np.testing.assert_allclose(before.stationarity, 0.0, atol=1e-6)
    assert before.optimal.tolist() == [False, True]
    assert np.all(found.optimal)
    assert found.value[0] < 0.5 * before.value[0]
    np.testing.assert_allclose(found.q[1], pulled, atol=GOAL)


def test_same_batch_has_the_same_solution_bit_for_bit(hanging_arm, box):
    goal = tool_goal(*hanging_arm.tool(random_inputs(hanging_arm, 17, 5)))
    first, second = (solve_anywhere(Problem(box, goal), hanging_arm.stowed) for _ in range(2))
    assert first.q.tobytes() == second.q.tobytes()


def test_condition_number_of_the_planar_arm_goes_to_both_printed_extremes():
    arm, goal = PlanarArm(), np.array([3.0, 2.5])

    def local_of(sign):
        def kappa(theta):
            return sign * condition_numbers(arm.jacobian(theta))

        def local(theta, which):
            shift = 1e-6 * np.eye(3)
            slope = np.stack([kappa(theta + s) - kappa(theta - s) for s in shift], axis=-1) / 2e-6
            inside, curve = np.ones(len(theta), bool), np.zeros((len(theta), 3, 3))
            return Quadratic(inside, arm.tip(theta) - goal, arm.jacobian(theta), kappa(theta), slope, curve, slope)

        return local

    feasible = np.radians([[-6.92, 67.42, 27.82]])
    settings = NewtonSettings(optimality=1e-7, most=200)
    least, greatest = minimise(local_of(1), feasible, settings), minimise(local_of(-1), feasible, settings)
    assert least.optimal[0]
    assert least.value[0] == pytest.approx(3.39, abs=0.5e-2)
    assert greatest.optimal[0]
    assert -greatest.value[0] == pytest.approx(4.46, abs=0.5e-2)
    np.testing.assert_allclose(arm.tip(least.q[0]), goal, atol=GOAL)


def test_rows_that_contradict_each_other_are_named(hanging_arm, box):
    position, direction = hanging_arm.tool(random_inputs(hanging_arm, 18, 1))
    torn = GoalSpace((Position(position), Direction(direction), Position(position + [0.0, 0.2, 0.0], axes="y")))
    with pytest.raises(GoalError, match=r"tool y, tool y") as caught:
        solve_anywhere(Problem(box, torn), hanging_arm.straight, NewtonSettings(most=10))
    assert caught.value.residual > 0.1


@pytest.mark.parametrize(("position", "direction"), [([np.nan, 0, 0], [0, 0, 1]), ([1, 0, 0], [0, 0, 0])])
def test_goals_that_are_no_goals_are_refused(position, direction):
    with pytest.raises(GoalError, match="finite"):
        tool_goal(position, direction)


def test_objectives_that_are_not_finite_are_refused(hanging_arm, box):
    goal = tool_goal(*hanging_arm.tool(hanging_arm.straight))
    nan = Differences("mine", lambda q: np.where(q[:, 0] > 0, np.nan, 0.0))
    with pytest.raises(ObjectiveError, match="mine"):
        solve(Problem(box, goal, nan), hanging_arm.straight)


def test_modules_that_do_not_exist_are_named(hanging_arm, box):
    with pytest.raises(GoalError, match="no module 'm9'"):
        solve(Problem(box, GoalSpace((Position(np.zeros(3), module="m9"),))), hanging_arm.straight)
