from __future__ import annotations

import numpy as np
import pytest

from studies.swept_surface import end_tangent
from vgtsim.errors import ReachError
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.objectives import MidStroke
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.shape import F, cubic, fit, solve_shapes
from vgtsim.positioning.strokes import make_box

pytestmark = pytest.mark.long

GOAL = 1e-9
ROUNDING = 1e-12

# goals of thirty-actuator shapes in the manner of figures 8.4 to 8.6: end point, end angles gamma, beta and twist
SHAPES = (([4.0, 1.0, 6.0], 0.3, 0.9, 0.5), ([-3.0, 5.0, 4.0], -1.2, 0.2, -0.8), ([2.0, -2.0, -1.0], 2.9, 0.4, 1.5))


@pytest.fixture(scope="module")
def box(hanging_arm):
    return make_box(hanging_arm, 0.005)


def curve_of(index, first=8.0, last=8.0):
    end, gamma, beta, _ = SHAPES[index]
    return cubic(np.zeros(3), end, [0, 0, first], last * end_tangent(gamma, beta))


def test_coefficient_matrix_is_the_inverse_of_the_end_conditions():
    """Appendix A: 7.7 by inversion of A.4."""
    ends = np.array([[1, 0, 0, 0], [1, 1, 1, 1], [0, 1, 0, 0], [0, 1, 2, 3]])
    np.testing.assert_allclose(np.linalg.inv(ends).T, F, atol=1e-15)


@pytest.mark.parametrize("index", range(3))
def test_cubic_meets_its_end_conditions(index):
    curve, (end, gamma, beta, _) = curve_of(index, 3.0, 7.0), SHAPES[index]
    np.testing.assert_allclose(curve.point(np.array([0.0, 1.0])), [[0, 0, 0], end], atol=ROUNDING)
    np.testing.assert_allclose(curve.tangent(np.array([0.0]))[0], [0, 0, 3.0], atol=ROUNDING)
    np.testing.assert_allclose(curve.tangent(np.array([1.0]))[0], 7 * end_tangent(gamma, beta), atol=ROUNDING)
    u = np.array([0.3])
    np.testing.assert_allclose(curve.tangent(u), (curve.point(u + 1e-6) - curve.point(u - 1e-6)) / 2e-6, atol=1e-7)


def test_fitted_segments_end_on_the_curve(hanging_arm):
    base = hanging_arm.mount[:3, 3]
    curve = cubic(base, base + [7.0, 2.0, -8.0], [0, 0, -14.0], [14.0, 0, 0])
    q = fit(hanging_arm, curve)
    faces = hanging_arm.frames(q)[1]
    dense = curve.point(np.linspace(0, 1, 40_001))
    for end in faces[2::2]:
        assert np.min(np.linalg.norm(dense - end, axis=1)) < 5e-4
    np.testing.assert_allclose(faces[-1], base + [7.0, 2.0, -8.0], atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_shape_meets_the_goal_exactly_inside_the_strokes(hanging_arm, box, seed):
    rng = np.random.default_rng(seed)
    azimuth, bend = rng.uniform(-np.pi, np.pi), rng.uniform(0.05, 0.16)
    q = np.array(hanging_arm.straight)
    q[::3], q[1::3] = bend * np.cos(azimuth), bend * np.sin(azimuth)
    position, direction = hanging_arm.tool(q)
    found = solve_shapes(Problem(box, tool_goal(position, direction), MidStroke()))
    at, along = hanging_arm.tool(found.q[0])
    np.testing.assert_allclose(at, position, atol=GOAL)
    np.testing.assert_allclose(along, direction, atol=GOAL)
    assert np.min(box.spare(hanging_arm.lengths(found.q[0]))) > 0


def test_other_magnitudes_give_other_shapes_with_the_same_end(hanging_arm, box):
    q = np.array(hanging_arm.straight)
    q[::3] = 0.12
    position, direction = hanging_arm.tool(q)
    problem = Problem(box, tool_goal(position, direction), MidStroke())
    found = [solve_shapes(problem, (pair,)).q[0] for pair in ((10.0, 10.0), (13.0, 16.0))]
    assert np.abs(found[0] - found[1]).max() > 0.01
    np.testing.assert_allclose(hanging_arm.tool(found[0])[0], position, atol=GOAL)
    np.testing.assert_allclose(hanging_arm.tool(found[1])[0], position, atol=GOAL)


def test_goal_beyond_every_curve_is_refused(hanging_arm, box):
    with pytest.raises(ReachError, match="shape"):
        solve_shapes(Problem(box, tool_goal([40.0, 0, 0], [1, 0, 0])))
