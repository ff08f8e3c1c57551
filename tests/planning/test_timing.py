from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar

from vgtsim.kinematics import bend_all, swing
from vgtsim.planning.timing import make_limits, time_lengths

TIMESTEP = 0.005
FRACTION, ACCELERATION = 0.8, 0.05
DIFFERENCES = 1.002  # differences over a step against derivatives, with the grid the plan is judged on


@pytest.fixture(scope="module")
def spline(hanging_arm):
    part = np.linspace(0, 1, 30)
    shape = bend_all(hanging_arm, np.radians([15.0, 30.0, 30.0, 10.0, -10.0]), 0.0)
    more = bend_all(hanging_arm, np.radians([25.0, 20.0, 30.0, 20.0, 10.0]), 0.0)
    way = swing(hanging_arm, (1 - part)[:, None] * shape + part[:, None] * more, 0.3 + 2.0 * part)
    return make_interp_spline(part, way, k=5)


@pytest.fixture(scope="module")
def limits(hanging_arm):
    return make_limits(hanging_arm, FRACTION, ACCELERATION)


@pytest.fixture(scope="module")
def lengths(hanging_arm, spline, limits):
    return time_lengths(hanging_arm, spline, limits, TIMESTEP)


def test_speeds_stay_within_the_rates_and_reach_them(lengths, limits):
    speed = np.abs(np.diff(lengths, axis=0)) / TIMESTEP / limits.rate
    assert speed.max() <= DIFFERENCES
    assert speed.max() > 0.95


def test_accelerations_stay_within_their_limit(lengths):
    acceleration = np.abs(np.diff(lengths, n=2, axis=0)) / TIMESTEP**2
    assert acceleration.max() <= ACCELERATION * DIFFERENCES


def test_a_path_that_turns_back_keeps_the_limits_at_its_turn(hanging_arm, limits):
    """A module bends and comes back while another hardly moves: at the turn every actuator is slow at once."""
    part = np.linspace(0, 1, 41)[:, None]
    start = bend_all(hanging_arm, np.radians([15.0, 20.0, 20.0, 10.0, -10.0]), 0.0)
    out, drift = np.zeros((2, len(start)))
    out[0], drift[3] = 0.2, 1e-4
    spline = make_interp_spline(part[:, 0], start + 4 * part * (1 - part) * out + part * drift, k=5)
    fine = 5e-4
    lengths = time_lengths(hanging_arm, spline, limits, fine)
    acceleration = np.abs(np.diff(lengths, n=2, axis=0)).max() / fine**2
    assert acceleration <= ACCELERATION * DIFFERENCES
    assert acceleration > 0.5 * ACCELERATION
    speed = np.abs(np.diff(lengths, axis=0)) / fine / limits.rate
    assert 0.5 < speed.max() <= DIFFERENCES


@pytest.mark.parametrize("seed", [1, 27, 29])
def test_a_path_to_and_fro_takes_little_more_than_its_rates_ask(hanging_arm, limits, seed):
    """All actuators turn twice, at different places; each is slow at its turns, and no other one waits for long."""
    draw, part = np.random.default_rng(seed), np.linspace(0, 1, 30)
    first, last = (bend_all(hanging_arm, np.radians(bends), 0.0) for bends in draw.uniform(-20, 35, (2, 5)))
    way = swing(hanging_arm, (1 - part)[:, None] * first + part[:, None] * last, 0.3 + 0.3 * part)
    spline = make_interp_spline(
        part, way + np.outer(np.sin(2 * np.pi * part) ** 2, draw.uniform(-0.05, 0.05, len(first))), k=5
    )
    even = np.linspace(0, 1, 2001)
    rates = np.abs(hanging_arm.length_rates(spline(even), spline(even, 1))) / limits.rate
    least = np.trapezoid(rates.max(axis=1), even)  # s, each place at the rate of its fastest actuator
    lengths = time_lengths(hanging_arm, spline, limits, TIMESTEP)
    assert least < len(lengths) * TIMESTEP < 1.7 * least
    assert np.abs(np.diff(lengths, n=2, axis=0)).max() <= ACCELERATION * DIFFERENCES * TIMESTEP**2
    assert (np.abs(np.diff(lengths, n=3, axis=0)) / limits.jerk).max() <= DIFFERENCES * TIMESTEP**3


def test_acceleration_has_no_steps(lengths):
    acceleration = np.diff(lengths, n=2, axis=0) / TIMESTEP**2
    jump = np.abs(np.diff(acceleration, axis=0)).max()
    assert jump < 0.02 * ACCELERATION  # a ramp of speed lasts hundreds of steps


def test_motion_starts_and_ends_at_rest_at_the_ends_of_the_path(hanging_arm, spline, lengths):
    ends = hanging_arm.lengths(spline(np.array([0.0, 1.0])))
    np.testing.assert_allclose(lengths[[0, -1]], ends, atol=1e-12)
    for end in (lengths[:3], lengths[-3:]):
        assert np.abs(np.diff(end, axis=0)).max() < 1e-9  # the smooth step starts with the fourth power of time


def test_every_row_lies_on_the_path(hanging_arm, spline, lengths):
    def off(u, row):
        return float(np.linalg.norm(hanging_arm.lengths(spline(u)) - row))

    samples = np.linspace(0, 1, 400)
    on_path = hanging_arm.lengths(spline(samples))
    for row in lengths[:: len(lengths) // 7]:
        near = samples[np.argmin(np.linalg.norm(on_path - row, axis=1))]
        bounds = (max(near - 0.005, 0), min(near + 0.005, 1))
        best = minimize_scalar(off, bounds=bounds, args=(row,), method="bounded", options={"xatol": 1e-13})
        assert min(best.fun, off(bounds[0], row), off(bounds[1], row)) < 1e-8


def test_half_the_rate_takes_longer_but_not_twice_the_ramps(hanging_arm, spline, lengths):
    slow = time_lengths(hanging_arm, spline, make_limits(hanging_arm, FRACTION / 2, ACCELERATION), TIMESTEP)
    assert 1.6 < len(slow) / len(lengths) < 2.0


def test_a_path_that_goes_nowhere_takes_one_step(hanging_arm, limits):
    still = make_interp_spline(np.linspace(0, 1, 10), np.repeat(hanging_arm.straight[None], 10, axis=0), k=5)
    lengths = time_lengths(hanging_arm, still, limits, TIMESTEP)
    assert len(lengths) == 2
    np.testing.assert_allclose(lengths[0], lengths[1], atol=1e-12)


def test_a_short_path_never_reaches_full_speed(hanging_arm, spline, limits):
    part = np.linspace(0.0, 1.0, 12)
    short = make_interp_spline(part, spline(0.01 * part), k=5)
    lengths = time_lengths(hanging_arm, short, limits, TIMESTEP)
    speed = np.abs(np.diff(lengths, axis=0)) / TIMESTEP / limits.rate
    acceleration = np.abs(np.diff(lengths, n=2, axis=0)) / TIMESTEP**2
    jerk = np.abs(np.diff(lengths, n=3, axis=0)) / TIMESTEP**3 / limits.jerk
    assert speed.max() < 0.9
    assert 0.95 < max(acceleration.max() / ACCELERATION, jerk.max()) <= DIFFERENCES


def test_jerk_is_bounded_where_the_actuator_that_leads_changes(hanging_arm, limits, monkeypatch):
    part = np.linspace(0.0, 1.0, 30)[:, None]
    bends = np.radians([1.0, 0.0, 0.0, 0.0, 0.0]) * part + np.radians([0.0, 0.0, 0.0, 6.0, 0.0]) * (part - 0.3) ** 4
    curve = make_interp_spline(part[:, 0], bend_all(hanging_arm, bends, 0.0), k=5)

    def jerk():
        return np.abs(np.diff(time_lengths(hanging_arm, curve, limits, TIMESTEP), n=3, axis=0)) / TIMESTEP**3

    assert np.max(jerk() / limits.jerk) <= DIFFERENCES
    bound = limits.jerk
    monkeypatch.setattr("vgtsim.planning.timing._JERK", np.inf)
    assert np.max(jerk() / bound) > 1.5


def test_jerk_alone_never_slows_a_long_path(hanging_arm, spline, lengths, limits, monkeypatch):
    monkeypatch.setattr("vgtsim.planning.timing._JERK", np.inf)
    np.testing.assert_array_equal(time_lengths(hanging_arm, spline, limits, TIMESTEP), lengths)
