from __future__ import annotations

import numpy as np
import pytest

from studies.swept_surface import (
    bryant_angles,
    bryant_rotation,
    end_tangent,
    equal_partition,
    leg_lengths,
    regular_partition,
    sweep,
)
from vgtsim.positioning.shape import arc_length, cubic

ROUNDING = 1e-12
ARC = 1e-9  # relative, of an 8-point rule on 64 pieces of a smooth curve

# goals of thirty-actuator shapes in the manner of figures 8.4 to 8.6: end point, end angles gamma, beta and twist
SHAPES = (([4.0, 1.0, 6.0], 0.3, 0.9, 0.5), ([-3.0, 5.0, 4.0], -1.2, 0.2, -0.8), ([2.0, -2.0, -1.0], 2.9, 0.4, 1.5))


def curve_of(index, first=8.0, last=8.0):
    end, gamma, beta, _ = SHAPES[index]
    return cubic(np.zeros(3), end, [0, 0, first], last * end_tangent(gamma, beta))


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
