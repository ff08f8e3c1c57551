"""The leader's path against dense points of itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from studies.drawn_directrices import least_offset
from vgtsim.planning.directrix import make_directrix

CURVE = make_directrix(6.0, [(3.0, 1 / 4.8), (2.0, -0.2), (3.0, 0.1)])


def test_curve_is_smooth_and_as_long_as_its_pieces():
    arc = np.linspace(-2.0, 12.0, 14001)
    points, heading = CURVE.at(arc)
    step = np.diff(points, axis=0)
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), 0.001, rtol=1e-6)
    middle = np.stack([np.sin(heading), -np.cos(heading)], axis=-1)
    np.testing.assert_allclose(step / 0.001, (middle[1:] + middle[:-1]) / 2, atol=1e-6)


def test_offsets_are_distances_from_dense_points():
    rng = np.random.default_rng(5)
    points, heading = CURVE.at(rng.uniform(-2.0, 10.0, 400))
    aside = rng.uniform(-0.8, 0.8, 400)
    away = points + aside[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    off, lead = CURVE.offsets(away)
    dense, _ = CURVE.at(np.linspace(-4.0, 12.0, 160001))
    np.testing.assert_allclose(np.abs(off), cKDTree(dense).query(away)[0], atol=1e-6)
    np.testing.assert_allclose(off, aside, atol=1e-9)
    for axis in range(2):
        step = 1e-6 * np.eye(2)[axis]
        slope = (CURVE.offsets(away + step)[0] - CURVE.offsets(away - step)[0]) / 2e-6
        np.testing.assert_allclose(lead[:, axis], slope, atol=1e-7)


def test_least_offset_of_an_arc_is_the_formula():
    arc = make_directrix(6.0, [(9.0, 1 / 4.8)])
    assert least_offset(arc, 1.69, 9.0) == pytest.approx(1.69**2 / 16 / 4.8, rel=0.005)
    assert least_offset(arc, 1.69, 0.0) < 1.69**2 / 16 / 4.8


def test_no_straight_section_does_better_than_the_least_offset():
    """Many lines laid on the arc: the best of them is the bound."""
    arc = make_directrix(6.0, [(9.0, 1 / 4.8)])
    (middle,), (heading,) = arc.at([4.0])
    along = np.linspace(-1.0, 1.0, 41)
    best = np.inf
    for shift in np.linspace(0.0, 0.1, 101):
        for turn in np.linspace(-0.03, 0.03, 13):
            way = np.array([np.sin(heading + turn), -np.cos(heading + turn)])
            points = middle + shift * np.array([np.cos(heading), np.sin(heading)]) + along[:, None] * way
            best = min(best, np.abs(arc.offsets(points)[0]).max())
    assert best == pytest.approx(least_offset(arc, 2.0, 9.0), rel=0.02)
    assert best >= 0.99 * least_offset(arc, 2.0, 9.0)
