import numpy as np
import pytest
from scipy.signal import savgol_filter

from vgtsim.statics.motion import motion_from_log, uniform_runs

ROUNDING = 1e-7  # m/s²: 1e-15 of the position over the spacing squared, with a factor for the filter


def quartic(time, degree=4):
    rng = np.random.default_rng(5)
    c = rng.normal(size=(degree + 1, 2, 3))
    powers = np.arange(degree + 1)
    t = time[:, None]
    first = np.where(powers > 0, powers * t ** np.maximum(powers - 1, 0), 0.0)
    second = np.where(powers > 1, powers * (powers - 1) * t ** np.maximum(powers - 2, 0), 0.0)
    return tuple(np.einsum("tp,pnk->tnk", weights, c) for weights in (t**powers, first, second))


def test_polynomials_are_differentiated_exactly_to_the_ends():
    time = np.arange(30) * 0.02
    nodes, velocity, acceleration = quartic(time)
    motion = motion_from_log(time, nodes)
    assert motion.velocity == pytest.approx(velocity, abs=ROUNDING)
    assert motion.acceleration == pytest.approx(acceleration, abs=ROUNDING)


def test_noise_is_differentiated_as_by_the_filter_of_scipy():
    nodes, spacing = np.random.default_rng(8).normal(size=(40, 2, 3)), 0.02
    motion = motion_from_log(np.arange(40) * spacing, nodes)
    for order, found in ((1, motion.velocity), (2, motion.acceleration)):
        wanted = savgol_filter(nodes, 7, 6, deriv=order, delta=spacing, axis=0)
        assert found == pytest.approx(
            wanted, rel=1e-11, abs=1e-11 / spacing**order
        )  # SciPy's own weights are off by 1e-12


def places_of(time):
    """Of two swinging points, shape (T, 2, 3), m."""
    phase = np.arange(6).reshape(2, 3)
    return np.sin(2 * np.pi * 0.5 * np.asarray(time)[:, None, None] + phase)


@pytest.mark.parametrize("step", [0.002, 0.02, 0.04])
def test_with_a_step_differences_are_those_of_the_steps(step):
    time = np.arange(80) * 0.04
    motion = motion_from_log(time, places_of(time), step)
    before, at, after = (places_of(time + move) for move in (-step, 0.0, step))
    inner, velocity, acceleration = slice(3, -3), (at - before) / step, (after - 2 * at + before) / step**2
    assert motion.velocity[inner] == pytest.approx(velocity[inner], abs=1e-7)
    assert motion.acceleration[inner] == pytest.approx(acceleration[inner], abs=3e-6)  # truncation: 9.9 times 3e-7
    still = motion_from_log(time, places_of(time))
    if step == 0.04:
        assert np.abs(still.acceleration - acceleration)[inner].max() > 1e-3  # what derivatives miss


def test_where_each_step_is_recorded_three_records_are_differenced():
    time, nodes = np.arange(9) * 0.02, np.random.default_rng(3).normal(size=(9, 2, 3))
    motion = motion_from_log(time, nodes, 0.02)
    assert motion.acceleration[1:-1] == pytest.approx(np.diff(nodes, n=2, axis=0) / 0.02**2, rel=1e-9)
    assert motion.velocity[1:] == pytest.approx(np.diff(nodes, axis=0) / 0.02, rel=1e-9)


@pytest.mark.parametrize("step", [0.0, -1.0, 1e-300, 5e-324, 1e300, np.inf, np.nan])
def test_steps_that_no_record_can_be_of_give_derivatives(step):
    time = np.arange(9) * 0.02
    found, wanted = motion_from_log(time, places_of(time), step), motion_from_log(time, places_of(time))
    assert np.array_equal(found.acceleration, wanted.acceleration)


def test_nothing_is_differenced_across_a_change_of_spacing():
    first, second = np.arange(10) * 0.02, 0.5 + np.arange(12) * 0.05
    time = np.concatenate([first, second])
    before, after = quartic(first), quartic(second, 3)
    motion = motion_from_log(time, np.concatenate([before[0], after[0]]))
    assert motion.acceleration[:10] == pytest.approx(before[2], abs=ROUNDING)
    assert motion.acceleration[10:] == pytest.approx(after[2], abs=ROUNDING)


def test_runs_shorter_than_the_window_stay_open():
    time = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65])
    motion = motion_from_log(time, quartic(time)[0])
    assert np.isfinite(motion.velocity[:6]).all()
    assert np.isnan(motion.velocity[6:]).all()
    assert np.isnan(motion.acceleration[6:]).all()
    assert np.isnan(motion_from_log(time[:1], quartic(time[:1])[0]).velocity).all()


@pytest.mark.parametrize("rate", [50.0, 100.0, 30.0])
def test_rounded_times_of_a_long_record_are_one_run(rate):
    time = np.cumsum(np.full(20000, 1 / rate))
    assert uniform_runs(time) == (slice(0, 20000),)


def test_neighbouring_runs_share_the_record_where_the_spacing_changes():
    assert uniform_runs(np.array([0.0, 1.0, 2.0, 2.5, 3.0])) == (slice(0, 3), slice(2, 5))


@pytest.mark.parametrize("step", [0.01, 0.02, 0.04])
def test_an_arm_that_stands_until_time_zero_is_moved_by_the_step_that_follows(step):
    """Growth by the fourth power from rest: no polynomial through the records knows that the arm stood before."""
    time = np.arange(20) * 0.04
    nodes = 0.7 * time[:, None, None] ** 4 * np.arange(1, 7).reshape(1, 2, 3)
    motion = motion_from_log(time, nodes, step)
    assert not motion.velocity[0].any()
    assert motion.acceleration[0] == pytest.approx(0.7 * step**2 * np.arange(1, 7).reshape(2, 3), abs=1e-9)
    later = motion_from_log(time + 1.0, nodes, step)  # of a stretch of a log, in which nothing stood still
    assert later.velocity[0].any() or step == 0.04
