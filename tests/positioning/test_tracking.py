from __future__ import annotations

import numpy as np
import pytest

from vgtsim.errors import RateError
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.objectives import MidStroke
from vgtsim.positioning.positioning import Positioning, solve
from vgtsim.positioning.restarts import make_postures, solve_anywhere
from vgtsim.positioning.strokes import make_box
from vgtsim.positioning.tracking import arc, line, resolve_globally, sheets, spline, track

GOAL = 1e-9
MOST = 0.05  # m of actuator motion between two goals


@pytest.fixture(scope="module")
def problem(hanging_arm):
    box = make_box(hanging_arm, 0.005)
    return Positioning(hanging_arm, box, tool_goal(np.zeros(3), [0, 0, 1]), MidStroke())


@pytest.fixture(scope="module")
def start(hanging_arm, problem):
    goal = tool_goal([6.0, -1.5, -1.0], [0.6, 0.0, -0.8])
    return solve_anywhere(Positioning(hanging_arm, problem.box, goal, MidStroke()), hanging_arm.straight).q[0]


def test_points_of_paths():
    np.testing.assert_allclose(line([0, 0, 0], [2, 0, 4], 3), [[0, 0, 0], [1, 0, 2], [2, 0, 4]])
    ring = arc([1, 1, 1], [3, 1, 2], [0, 0, 1], np.pi, 3)
    np.testing.assert_allclose(ring, [[3, 1, 2], [1, 3, 2], [-1, 1, 2]], atol=1e-12)


def test_spline_goes_through_its_way_points_and_is_straight_through_two():
    way = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 3]])
    dense = spline(way, 6001)
    assert np.linalg.norm(dense[:, None] - way, axis=2).min(axis=0).max() < 1e-3
    np.testing.assert_allclose(spline(way[:2], 5), line(way[0], way[1], 5), atol=1e-12)
    turn = np.diff(dense, axis=0) / np.linalg.norm(np.diff(dense, axis=0), axis=1, keepdims=True)
    assert np.linalg.norm(np.diff(turn, axis=0), axis=1).max() < 5e-3  # no corner


def test_line_is_tracked_at_every_point_in_few_iterations(hanging_arm, problem, start):
    points = line([6.0, -1.5, -1.0], [6.0, 1.5, -1.0], 61)
    done = track(problem, points, [0.6, 0.0, -0.8], start, MOST)
    position, direction = hanging_arm.tool(done.q)
    np.testing.assert_allclose(position, points, atol=GOAL)
    np.testing.assert_allclose(np.cross(direction, [0.6, 0.0, -0.8]), 0.0, atol=2 * GOAL)
    assert np.abs(np.diff(done.lengths, axis=0)).max() <= MOST
    assert done.iterations[1:].mean() < 4


def test_too_fast_a_path_is_refused_with_its_figure(problem, start):
    with pytest.raises(RateError, match=r"allowed 0\.02 m"):
        track(problem, line([6.0, -1.5, -1.0], [6.0, 1.5, -1.0], 9), [0.6, 0.0, -0.8], start, 0.02)


def test_global_resolution_costs_no_more_than_the_local_method(hanging_arm, problem, start):
    points, direction = line([6.0, -1.5, -1.0], [6.0, 1.5, -1.0], 31), [0.6, 0.0, -0.8]
    local = track(problem, points, direction, start, 2 * MOST)
    goal = tool_goal(np.tile(points[0], (12, 1)), np.tile(direction, (12, 1)))
    others = solve(
        Positioning(hanging_arm, problem.box, goal, MidStroke()), make_postures(hanging_arm, problem.box, 12).q[:12]
    )
    seeds = np.concatenate([start[None], others.q[others.met]])
    layers = np.concatenate([sheets(problem, points, direction, seeds), local.q[:, None]], axis=1)
    best = resolve_globally(problem, layers, 2 * MOST)
    assert best.cost <= local.cost + 1e-12
    np.testing.assert_allclose(hanging_arm.tool(best.q)[0], points, atol=GOAL)
    assert np.abs(np.diff(best.lengths, axis=0)).max() <= 2 * MOST


def test_dynamic_programming_is_the_best_of_all_choices(hanging_arm, problem):
    """Against all 81 paths through three candidates at four goals."""
    rng = np.random.default_rng(3)
    low, high = problem.box.least, problem.box.greatest
    layers = hanging_arm.inputs_from_lengths(low + (0.4 + 0.2 * rng.random((4, 3, 15))) * (high - low))
    best = resolve_globally(problem, layers, 1.0)
    costs = []
    for choice in np.ndindex(3, 3, 3, 3):
        path = np.array([layers[k, c] for k, c in enumerate(choice)])
        costs.append(resolve_globally(problem, path[:, None], 1.0).cost)
    assert best.cost == pytest.approx(min(costs), rel=1e-12)
