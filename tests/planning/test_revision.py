"""A leg is stopped on its own path, inside the acceleration, and soon."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.planning.programme import go_on_rows, stop_rows
from vgtsim.planning.timing import run_ramps

STEP, ACCELERATION, WAY = 0.04, 0.02, 0.3  # s, m/s², m
STOP = 1.875 * 0.02 / ACCELERATION  # s: a fifth-order smooth step from 20 mm/s at that acceleration


@pytest.fixture(scope="module")
def leg():
    """Two cylinders from rest to rest at 20 mm/s, one of them there and half back."""
    time = np.arange(0.0, 16.9, STEP)
    part = run_ramps(time / time[-1], STOP / time[-1])
    return np.stack([1 + WAY * part, 1 + 0.05 * np.sin(3 * part)], axis=-1)


@pytest.mark.parametrize("row", [30, 150, 300])
def test_a_leg_stops_on_its_path(leg, row):
    rows = stop_rows(leg, row, STEP, ACCELERATION).rows
    np.testing.assert_array_equal(rows[: row + 1], leg[: row + 1])
    assert np.abs(np.diff(rows, n=2, axis=0)).max() <= ACCELERATION * STEP**2 * (1 + 1e-9)
    assert np.abs(rows[-1] - rows[-2]).max() < 1e-3 * np.abs(leg[row] - leg[row - 1]).max()  # it stands
    assert STOP / 2 < (len(rows) - 1 - row) * STEP < 1.6 * STOP
    part = (rows[:, 0] - 1) / WAY  # how far the first cylinder is tells where the second must be
    np.testing.assert_allclose(rows[:, 1], 1 + 0.05 * np.sin(3 * part), atol=1e-9)


def test_an_arm_at_rest_stays_there(leg):
    assert len(stop_rows(leg, 0, STEP, ACCELERATION).rows) == 1


def test_a_leg_that_ends_before_it_can_be_stopped_runs_to_its_end(leg):
    np.testing.assert_array_equal(stop_rows(leg, len(leg) - 60, STEP, ACCELERATION / 100).rows, leg)


@pytest.mark.parametrize("row", [0, 30, 151, 300, 400])
def test_a_leg_goes_on_from_where_it_stopped(leg, row):
    stopped = stop_rows(leg, row, STEP, ACCELERATION)
    rest = go_on_rows(leg, stopped.places[-1], STEP, ACCELERATION)
    rows = np.concatenate([stopped.rows, stopped.rows[-1:], stopped.rows[-1:], rest.rows])
    np.testing.assert_allclose(rows[-1], leg[-1], atol=1e-9)
    assert np.abs(np.diff(rows, n=2, axis=0)).max() <= 1.01 * ACCELERATION * STEP**2  # the leg itself comes near it
    assert np.abs(np.diff(rows, axis=0)).max() <= 1.001 * np.abs(np.diff(leg, axis=0)).max()
    assert np.diff(rest.places).min(initial=1.0) > 0
    part = (rows[:, 0] - 1) / WAY
    np.testing.assert_allclose(rows[:, 1], 1 + 0.05 * np.sin(3 * part), atol=1e-9)
