from __future__ import annotations

import numpy as np

from vgtsim.planning.stretches import arc, line, spline


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
