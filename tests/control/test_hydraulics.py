"""Hydraulic cylinders: step and ramp of the linear model, limits, leakage and lock."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.control.hydraulics import FLOW, PRESSURE, STROKE, Hydraulics

GAIN, STEP, STIFFNESS = 4.0, 1e-3, np.array([2e8])
DISCRETE = 2 * GAIN * STEP  # explicit steps of a first-order lag err by half a step's decay; twice that is allowed


def cylinder(**changes):
    area = np.pi / 4 * 0.1**2
    parts = {
        "push": np.array([area * 20e6]),
        "pull": np.array([area * 15e6]),
        "bore": np.array([area]),
        "rate": np.array([0.05]),
        "leakage": np.zeros(1),
        "retracted": np.array([0.8]),
        "extended": np.array([1.4]),
        "gain": GAIN,
        "lock_band": 0.0,
        "timestep": STEP,
    }
    return Hydraulics(**(parts | changes))


def play(oil, command, load, seconds):
    """Lengths of a massless load that pulls with a constant force, shape (T,), and all saturations."""
    unloaded, lengths, hit = np.array([1.0]), [], 0
    times = np.arange(round(seconds / STEP)) * STEP
    for t in times:
        length = unloaded + load / STIFFNESS
        speed = (command(t) - command(t - STEP)) / STEP if t > 0 else np.zeros(1)
        unloaded, now = oil.advance(unloaded, command(t), speed, length, STIFFNESS)
        lengths.append(length[0])
        hit |= int(now[0])
    return times, np.array(lengths), hit


def test_small_step_is_the_first_order_lag():
    """L = c (1 - exp(-K t)): the closed form of flow in proportion to error."""
    times, length, hit = play(cylinder(), lambda t: np.array([1.005]), 0.0, 1.5)
    assert length == pytest.approx(1.005 - 0.005 * np.exp(-GAIN * times), abs=0.005 * DISCRETE)
    assert hit == 0


def test_ramp_without_feed_forward_lags_by_speed_over_gain():
    oil = cylinder()
    unloaded = np.array([1.0])
    for count in range(3000):
        command = np.array([1.0 + 0.01 * count * STEP])
        unloaded, _ = oil.advance(unloaded, command, np.zeros(1), unloaded, STIFFNESS)
    assert command[0] - unloaded[0] == pytest.approx(0.01 / GAIN, rel=DISCRETE)


def test_ramp_with_feed_forward_is_followed():
    _, length, hit = play(cylinder(), lambda t: np.array([1.0 + 0.01 * t]), 0.0, 1.0)
    assert length[-1] == pytest.approx(1.0 + 0.01 * 0.999, abs=2 * 0.01 * STEP)
    assert hit == 0


def test_large_step_moves_at_the_flow_limit_and_says_so():
    times, length, hit = play(cylinder(), lambda t: np.array([1.3]), 0.0, 2.0)
    assert np.polyfit(times, length, 1)[0] == pytest.approx(0.05, rel=1e-6)
    assert hit == FLOW


def test_load_takes_the_root_of_the_pressure_left():
    """Half the push force leaves the root of one half of the speed."""
    oil = cylinder()
    times, length, _ = play(oil, lambda t: np.array([1.3]), -0.5 * oil.push[0], 1.0)
    assert np.polyfit(times, length, 1)[0] == pytest.approx(0.05 * np.sqrt(0.5), rel=1e-6)


def test_load_beyond_the_pressure_pushes_the_rod_back_through_the_relief_valve():
    oil = cylinder()
    unloaded = np.array([1.0])
    length = unloaded - 1.2 * oil.push / STIFFNESS
    moved, hit = oil.advance(unloaded, unloaded, np.zeros(1), length, STIFFNESS)
    assert STIFFNESS * (moved - length) == pytest.approx(oil.push)
    assert hit[0] & PRESSURE


def test_stroke_ends_the_travel():
    _, length, hit = play(cylinder(), lambda t: np.array([1.6]), 0.0, 12.0)
    assert length[-1] == pytest.approx(1.4)
    assert hit & STROKE


def test_lock_valve_holds_a_load_that_leakage_would_let_creep():
    leaky = cylinder(leakage=np.array([1e-11]))
    pull = 50e3
    open_, locked = leaky, cylinder(leakage=np.array([1e-11]), lock_band=1e-3)
    sag = []
    for oil in (open_, locked):
        unloaded = np.array([1.0])
        for _ in range(4000):
            length = unloaded + pull / STIFFNESS
            unloaded, _ = oil.advance(unloaded, np.array([1.0]), np.zeros(1), length, STIFFNESS)
        sag.append(unloaded[0] + pull / STIFFNESS[0] - 1.0)
    assert sag[1] == pytest.approx(pull / STIFFNESS[0])
    creep = 1e-11 * pull / (np.pi / 4 * 0.1**2) ** 2
    assert sag[0] == pytest.approx(creep / GAIN, rel=0.02)
