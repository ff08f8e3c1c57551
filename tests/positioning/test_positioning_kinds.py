"""Positioning of arms of octahedra, hinges and static longerons: the same laws as of double octahedra."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.errors import GoalError
from vgtsim.kinematics import Chain, azimuth, bend_all, hanging_mount, sample_inputs, swing
from vgtsim.positioning.goals import Direction, GoalSpace, Orientation, Position, evaluate, tabulate, tool_goal
from vgtsim.positioning.methods import _STAGES, anchor_successively, solve
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.objectives import (
    Configurations,
    LengthVariation,
    MidStroke,
    Nearness,
    StrokeBarrier,
    WeightedSum,
    goal_plane,
)
from vgtsim.positioning.problem import Problem, lagrangian_curvature
from vgtsim.positioning.reduction import couple
from vgtsim.positioning.restarts import make_postures
from vgtsim.positioning.solver import solve_anywhere
from vgtsim.positioning.strokes import bring_inside, inside, make_box

MODELS = Path(__file__).parents[2] / "models"
GOAL = 1e-9  # each row, m and rad
MODE = 1e-8  # of inputs found again from their lengths, m and rad: the goal's accuracy over the least singular value
ROUNDING = 1e-11
STEP = 1e-6
SLOPE = 1e-5  # of central differences with that step, relative to the greatest
BEND = 2e-3  # of one-sided differences with a step of 1e-5, relative to the greatest curvature


@pytest.fixture(scope="module", params=["arm30", "arm60", "mixed", "stewart", "tetra4"])
def chain(request):
    return make_chain(request.param)


def make_chain(name):
    return Chain(load_manipulator(MODELS / name / f"{name}.toml"), hanging_mount(7.3))


def test_state_agrees_with_the_chain(chain):
    q = sample_inputs(chain, 8, 1, 0.8)
    state = chain.state(q)
    length, slope = chain.length_jacobian(q)
    tool, _, J = chain.tool_jacobian(q)
    linear, angular = (np.swapaxes(half, -1, -2) for half in (J[:, :3], J[:, 3:]))
    at_origin = linear - np.cross(angular, tool[:, None])  # a state's velocities are of the point at the origin of G
    theirs = (angular, at_origin, length, slope)
    count = chain.layout.actuators
    found = (*state.motion[2:], state.legs[:, :count], state.leg_slopes[:, :count])
    for ours, other in zip(found, theirs, strict=True):
        np.testing.assert_allclose(ours, other, atol=ROUNDING)
    np.testing.assert_allclose(state.legs[:, count:], np.tile(chain.layout.static, (8, 1)), atol=GOAL)
    assert np.all(state.assembles)


@pytest.mark.long
def test_rows_and_curvatures_are_those_of_differences(chain):
    q, rng = sample_inputs(chain, 2, 2, 0.6), np.random.default_rng(3)
    module = chain.manipulator.modules[len(chain.manipulator.modules) // 2].name
    face = [m.name for m in chain.manipulator.modules].index(module) + 1
    R, P = chain.frames(q)
    position, direction = chain.tool(q)
    tool = (Position(position), Direction(direction))
    inner = (Orientation(R[:, face], module=module), Position(P[:, face], module=module))
    goal, which, x = GoalSpace((*tool, *inner)), np.arange(2), q
    state = chain.state(x)
    error, J = evaluate(chain, goal, state, which)
    np.testing.assert_allclose(error, 0.0, atol=ROUNDING)
    weights, pull = rng.standard_normal(error.shape), rng.standard_normal(state.legs.shape)

    def slope(at):
        there = chain.state(at)
        return (weights[:, None] @ evaluate(chain, goal, there, which)[1])[:, 0] + there.pull(pull)

    numeric = np.empty((2, x.shape[1], x.shape[1]))
    for i, shift in enumerate(STEP * np.eye(x.shape[1])):
        ahead, behind = (evaluate(chain, goal, chain.state(x + s * shift), which)[0] for s in (1, -1))
        np.testing.assert_allclose(J[:, :, i], (ahead - behind) / (2 * STEP), atol=SLOPE * np.abs(J).max())
        numeric[:, i] = (slope(x + shift) - slope(x - shift)) / (2 * STEP)
    numeric = (numeric + np.swapaxes(numeric, 1, 2)) / 2
    found = lagrangian_curvature(tabulate(state.chain, goal), state, which, weights, pull)
    np.testing.assert_allclose(found, numeric, atol=BEND * np.abs(numeric).max())


def test_objectives_have_the_slopes_of_differences(chain):
    q, box = sample_inputs(chain, 2, 4, 0.6), make_box(chain, 0.0)
    x, move = q, np.random.default_rng(5).standard_normal((2, chain.layout.inputs))
    lengths = chain.lengths(chain.straight)
    plane = goal_plane(chain, [3.0, 2.0, 1.0])
    parts = (StrokeBarrier(), MidStroke(), LengthVariation(), Nearness(lengths), plane)
    for objective in (*parts, WeightedSum(((2.0, MidStroke()), (0.5, plane)))):
        states = (chain.state(x + s * STEP * move) for s in (0, 1, -1))
        here, ahead, behind = (objective.terms(Configurations(box, at, np.arange(2))) for at in states)
        rise = (ahead.value - behind.value) / (2 * STEP)
        np.testing.assert_allclose(
            np.sum(here.slope * move, axis=1), rise, rtol=1e-4, atol=1e-7, err_msg=objective.name
        )


@pytest.mark.long
@pytest.mark.parametrize(("name", "part"), [("arm30", 1.0), ("arm60", 1.0), ("stewart", 1.0), ("mixed", 0.95)])
def test_goals_are_met_on_the_mode_of_the_straight_arm_inside_all_limits(name, part):
    chain = make_chain(name)
    box = make_box(chain, 0.005)
    q = sample_inputs(chain, 40, 6, 0.8)
    problem = Problem(box, tool_goal(*chain.tool(q)))
    found = solve_anywhere(problem, chain.straight, postures=make_postures(box, 150))
    assert np.mean(found.met) >= part
    good = found.q[found.met]
    position, direction = chain.tool(good)
    wanted = chain.tool(q[found.met])
    np.testing.assert_allclose(position, wanted[0], atol=2 * GOAL)
    np.testing.assert_allclose(direction, wanted[1], atol=2 * GOAL)
    lengths = chain.lengths(good)  # refuses static longerons of another length
    assert np.min(box.spare(lengths)) > 0
    np.testing.assert_allclose(chain.inputs_from_lengths(lengths), good, atol=MODE)


def test_a_stewart_platform_has_one_freedom_left_by_a_tool_goal_and_none_by_a_pose():
    chain = make_chain("stewart")
    box, q = make_box(chain, 0.005), sample_inputs(chain, 6, 7, 0.7)
    position = chain.tool(q)[0]
    pose = GoalSpace((Position(position), Orientation(chain.frames(q)[0][:, -1])))
    found = solve(Problem(box, pose), chain.straight)
    assert np.all(found.optimal)
    np.testing.assert_allclose(found.q, q, atol=MODE)
    free = solve(Problem(box, tool_goal(*chain.tool(q))), chain.straight)
    assert np.all(free.met)
    assert np.all(free.value <= found.value + 1e-9)


def test_a_hinged_arm_of_four_meets_points_and_refuses_more_rows_than_it_has_inputs():
    chain = make_chain("tetra4")
    box, q = make_box(chain, 0.005), sample_inputs(chain, 10, 8, 0.6)
    position, direction = chain.tool(q)
    found = solve_anywhere(Problem(box, GoalSpace((Position(position),))), chain.straight)
    assert np.mean(found.met) >= 0.8
    np.testing.assert_allclose(chain.tool(found.q[found.met])[0], position[found.met], atol=GOAL)
    with pytest.raises(GoalError, match="5 goal rows for 4 inputs"):
        solve(Problem(box, tool_goal(position, direction)), chain.straight)


def test_poses_beyond_a_singularity_do_not_count_as_assembled():
    chain = make_chain("arm30")
    row = np.tile(chain.straight, (4, 1))
    row[1, 8] *= -1.0  # the second module's top below its base
    row[2, 5] += np.pi  # the first turned by half a turn: another mode
    row[3, 3] = np.nan
    state = chain.state(row)
    assert state.assembles.tolist() == [True, False, False, False]
    assert state.valid[1].tolist() == [True, False, True, True, True]


def test_bends_add_up_in_one_plane_and_swing_with_the_arm():
    chain = make_chain("arm30")
    bends, angle = np.radians([10.0, 15.0, 20.0, -5.0, 8.0]), 0.8
    q = bend_all(chain, bends, angle)
    position, direction = chain.tool(q)
    assert azimuth(chain, position) == pytest.approx(angle)
    assert np.arccos(-direction[2]) == pytest.approx(bends.sum())
    turned, along = chain.tool(swing(chain, q, 1.1))
    assert azimuth(chain, turned) == pytest.approx(angle + 1.1)
    np.testing.assert_allclose([turned[2], along[2]], [position[2], direction[2]], atol=ROUNDING)
    plane = goal_plane(chain, position)
    states = (chain.state(x[None]) for x in (q, swing(chain, q, 0.5)))
    at = [Configurations(make_box(chain, 0.0), state, np.zeros(1, int)) for state in states]
    assert plane.terms(at[0]).value[0] < 1e-3 * plane.terms(at[1]).value[0]  # the top's normal to first order


@pytest.mark.long
def test_octahedral_arms_are_coupled_and_anchored():
    chain = make_chain("arm30")
    box, q = make_box(chain, 0.005), bend_all(chain, np.radians([8.0, 12.0, 12.0, 9.0, 4.0]), 0.4)
    goal = tool_goal(*chain.tool(q))
    pairs = ((0, 1), (4, 3))
    reduction = couple(chain.straight, pairs, owner=chain.layout.owner)
    found = solve(Problem(box, goal, MidStroke(), reduction=reduction), chain.straight)
    assert reduction.order == 18
    assert found.met[0]
    away = (found.q[0] - chain.straight).reshape(5, 6)
    np.testing.assert_allclose(away[[0, 4]], away[[1, 3]], atol=ROUNDING)
    anchored = anchor_successively(Problem(box, goal, MidStroke()), q, 2, NewtonSettings(most=100))
    whole = solve(Problem(box, goal, MidStroke()), q, NewtonSettings(most=100))
    assert anchored.notes["stages"] < _STAGES
    assert anchored.value[0] == pytest.approx(whole.value[0], rel=1e-3)
    mixed = make_chain("mixed")
    with pytest.raises(ValueError, match="different kinds"):
        couple(mixed.straight, ((0, 1),), owner=mixed.layout.owner)


def test_what_is_outside_the_strokes_is_brought_inside_module_by_module():
    chain = make_chain("arm30")
    box = make_box(chain, 0.005)
    q = bend_all(chain, np.radians([10.0, 45.0, 10.0, 10.0, 10.0]), 0.0)
    assert not inside(box, q[None])[0]
    moved = bring_inside(box, q)
    assert inside(box, moved[None])[0]
    assert np.all((moved != q).reshape(5, 6).any(axis=1) == [False, True, False, False, False])
