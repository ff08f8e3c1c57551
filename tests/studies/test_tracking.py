from __future__ import annotations

import numpy as np
import pytest

from studies.tracking import RateError, resolve_globally, sheets, track
from vgtsim.geometry.stretches import line
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.methods import solve
from vgtsim.positioning.objectives import MidStroke
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.restarts import make_postures
from vgtsim.positioning.solver import solve_anywhere
from vgtsim.positioning.strokes import make_box

pytestmark = pytest.mark.long

GOAL = 1e-9
MOST = 0.05  # m of actuator motion between two goals


@pytest.fixture(scope="module")
def problem(hanging_arm):
    box = make_box(hanging_arm, 0.005)
    return Problem(box, tool_goal(np.zeros(3), [0, 0, 1]), MidStroke())


@pytest.fixture(scope="module")
def start(hanging_arm, problem):
    goal = tool_goal([6.0, -1.5, -1.0], [0.6, 0.0, -0.8])
    return solve_anywhere(Problem(problem.box, goal, MidStroke()), hanging_arm.straight).q[0]


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
    points, direction = line([6.0, -0.7, -1.0], [6.0, 0.7, -1.0], 15), [0.6, 0.0, -0.8]
    local = track(problem, points, direction, start, 2 * MOST)
    goal = tool_goal(np.tile(points[0], (12, 1)), np.tile(direction, (12, 1)))
    others = solve(Problem(problem.box, goal, MidStroke()), make_postures(problem.box, 12).q[:12])
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
