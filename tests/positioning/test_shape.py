from __future__ import annotations

import numpy as np
import pytest

from vgtsim.errors import ReachError
from vgtsim.positioning.directrix import (
    F,
    arc_length,
    bryant_angles,
    bryant_rotation,
    cubic,
    end_tangent,
    equal_partition,
    leg_lengths,
    regular_partition,
    spline,
    sweep,
)
from vgtsim.positioning.fitting import fit
from vgtsim.positioning.shape import follow_curve, solve_shape
from vgtsim.positioning.strokes import make_box

GOAL = 1e-9
ROUNDING = 1e-12
ARC = 1e-9  # relative, of an 8-point rule on 64 pieces of a smooth curve

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


def test_spline_goes_through_its_way_points():
    way = np.array([[0, 0, 0], [1, 0, 2], [2, 2, 3], [2, 4, 3.0]])
    curve = spline(way, [0, 0, 4], [0, 3, 0])
    u = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    np.testing.assert_allclose(curve.point(u / u[-1]), way, atol=ROUNDING)
    np.testing.assert_allclose(curve.tangent(np.array([0.0, 1.0])), [[0, 0, 4], [0, 3, 0]], atol=ROUNDING)
    with pytest.raises(ValueError, match="coincide"):
        spline(way[[0, 1, 1, 2]], [0, 0, 1], [0, 0, 1])


def test_equal_partition_has_equal_arcs_and_regular_one_has_not():
    curve = curve_of(0, 20.0, 3.0)
    arcs = np.diff(arc_length(curve, equal_partition(curve, 10)))
    np.testing.assert_allclose(arcs, arcs.mean(), rtol=1e3 * ARC)
    assert np.ptp(np.diff(arc_length(curve, regular_partition(10)))) > 0.1 * arcs.mean()
    fine = curve.point(np.linspace(0, 1, 200_001))
    chords = np.sum(np.linalg.norm(np.diff(fine, axis=0), axis=1))
    assert arc_length(curve, np.ones(1))[0] == pytest.approx(chords, rel=ARC)


@pytest.mark.parametrize("index", range(3))
def test_swept_frames_follow_the_curve_and_twist_evenly(index):
    curve, twist = curve_of(index), SHAPES[index][3]
    u = equal_partition(curve, 10)
    surface = sweep(curve, u, 0.8, (0.0, twist))
    tangent = curve.tangent(u)
    np.testing.assert_allclose(
        surface.R[:, :, 2], tangent / np.linalg.norm(tangent, axis=1, keepdims=True), atol=ROUNDING
    )
    np.testing.assert_allclose(surface.R @ np.swapaxes(surface.R, 1, 2), np.tile(np.eye(3), (11, 1, 1)), atol=ROUNDING)
    sides = np.linalg.norm(surface.triangles - np.roll(surface.triangles, 1, axis=1), axis=-1)
    np.testing.assert_allclose(sides, 0.8, atol=ROUNDING)
    gamma, beta = bryant_angles(tangent)
    untwisted = bryant_rotation(gamma, beta, 0.0)
    turned = np.swapaxes(untwisted, 1, 2) @ surface.R
    np.testing.assert_allclose(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]), twist * np.arange(11) / 10, atol=1e-9)


def test_three_goals_have_three_shapes_each():
    """Figures 8.4 to 8.6: the tangent magnitudes leave two infinities of solutions with the same ends."""
    for index in range(3):
        ends, lengths = [], []
        for magnitude in (4.0, 8.0, 14.0):
            curve = curve_of(index, magnitude, magnitude)
            surface = sweep(curve, equal_partition(curve, 10), 0.8, (0.0, SHAPES[index][3]))
            ends.append(surface.triangles[-1])
            lengths.append(leg_lengths(surface.triangles))
        np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=ROUNDING)
        assert lengths[0].shape == (10, 6)
        assert min(np.abs(lengths[0] - lengths[1]).max(), np.abs(lengths[1] - lengths[2]).max()) > 0.05


def test_straight_sweep_has_known_lengths():
    curve = cubic(np.zeros(3), [0, 0, 5], [0, 0, 5], [0, 0, 5])
    lengths = leg_lengths(sweep(curve, regular_partition(10), 0.8).triangles)
    np.testing.assert_allclose(lengths[:, :3], 0.5, atol=ROUNDING)
    np.testing.assert_allclose(lengths[:, 3:], np.hypot(0.5, 0.8), atol=ROUNDING)


def test_tangent_angles_as_printed_fail_where_the_tangent_points_down():
    """Erratum 7.14: pi is added for t_z < 0 although ATAN2 in 7.12 has covered it."""
    down = np.array([0.3, 0.4, -0.8]) / np.linalg.norm([0.3, 0.4, -0.8])
    gamma, beta = bryant_angles(down)
    np.testing.assert_allclose(bryant_rotation(gamma, beta, 0.0)[:, 2], down, atol=ROUNDING)
    printed = bryant_rotation(gamma, beta + np.pi, 0.0)[:, 2]
    np.testing.assert_allclose(printed, -down, atol=ROUNDING)


def test_end_tangent_as_printed_is_no_unit_vector():
    """Erratum 8.10."""
    gamma, beta = 0.4, 0.9
    assert np.linalg.norm(end_tangent(gamma, beta)) == pytest.approx(1.0)
    printed = np.array([np.cos(beta), np.cos(gamma), np.sin(gamma)])
    assert np.linalg.norm(printed) == pytest.approx(np.sqrt(1 + np.cos(beta) ** 2))
    np.testing.assert_allclose(end_tangent(gamma, beta), bryant_rotation(gamma, beta, 0.7) @ [0, 0, 1], atol=ROUNDING)


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
    shape = solve_shape(hanging_arm, box, position, direction)
    at, along = hanging_arm.tool(shape.solution.q[0])
    np.testing.assert_allclose(at, position, atol=GOAL)
    np.testing.assert_allclose(along, direction, atol=GOAL)
    assert np.min(box.spare(hanging_arm.lengths(shape.solution.q[0]))) > 0


def test_other_magnitudes_give_other_shapes_with_the_same_end(hanging_arm, box):
    q = np.array(hanging_arm.straight)
    q[::3] = 0.12
    position, direction = hanging_arm.tool(q)
    found = [solve_shape(hanging_arm, box, position, direction, pair) for pair in ((10.0, 10.0), (13.0, 16.0))]
    assert np.abs(found[0].solution.q - found[1].solution.q).max() > 0.01
    np.testing.assert_allclose(hanging_arm.tool(found[0].solution.q[0])[0], position, atol=GOAL)
    np.testing.assert_allclose(hanging_arm.tool(found[1].solution.q[0])[0], position, atol=GOAL)


def test_arm_follows_a_spline(hanging_arm, box):
    base = hanging_arm.mount[:3, 3]
    way = base + np.array([[0, 0, 0], [0.6, 0.2, -4.0], [3.0, 0.5, -8.2], [6.8, 0.0, -10.5]])
    shape = follow_curve(hanging_arm, box, spline(way, [0, 0, -14], [12, 0, -6]), [12, 0, -6])
    assert shape.solution.met[0]


def test_goal_beyond_every_curve_is_refused(hanging_arm, box):
    with pytest.raises(ReachError, match="shape"):
        solve_shape(hanging_arm, box, [40.0, 0, 0], [1, 0, 0], settings=None)
