from __future__ import annotations

import numpy as np

from vgtsim.description import ToolPath
from vgtsim.geometry.stretches import arc, find_nearest, line, make_stretches, spline


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


def test_nearest_points_of_a_path_are_those_of_its_line_and_arc():
    """Feet of perpendiculars on the line, and on the circle; the tool has turned in proportion to the way."""
    path = ToolPath.model_validate(
        {
            "name": "path",
            "start": [0, 0, 0],
            "direction": [1, 0, 0],
            "pieces": [
                {"shape": "line", "to": [4, 0, 0], "direction": [0, 1, 0]},
                {"shape": "arc", "centre": [4, 5, 0], "axis": [0, 0, 1], "angle": "90 deg"},
            ],
        }
    )
    random = np.random.default_rng(3)
    along, angle = random.uniform(0, 4, 20), random.uniform(0.1, 1.4, 20)
    off = random.uniform(-0.2, 0.2, (20, 2))
    turn = along / 4 * np.pi / 2
    feet = [np.stack([along, 0 * along, 0 * along, np.cos(turn), np.sin(turn), 0 * along], axis=1)]
    ring = np.array([4.0, 5, 0]) + 5 * np.stack([np.sin(angle), -np.cos(angle), 0 * angle], axis=1)
    feet.append(np.concatenate([ring, np.tile([0.0, 1, 0], (20, 1))], axis=1))
    out = np.stack([np.sin(angle), -np.cos(angle), 0 * angle], axis=1)
    beside = feet[0][:, :3] - np.abs(off[:, :1]) * [0, 1, 0] + off[:, 1:] * [0, 0, 1]
    points = np.concatenate([beside, ring + off[:, :1] * out + off[:, 1:] * [0, 0, 1]])
    found = find_nearest(make_stretches(path), points)
    wanted = np.concatenate(feet)
    np.testing.assert_allclose(found, wanted, atol=1e-5)
    apart, least = (np.linalg.norm(points - place[:, :3], axis=1) for place in (found, wanted))
    np.testing.assert_allclose(apart, least, atol=1e-7)
