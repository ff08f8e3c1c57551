"""Hydraulic cylinders against closed forms: springs of oil, valves, limits, seal leakage, lock valves, cavities."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.plant.hydraulics import CAVITY, FLOW, PRESSURE, STROKE, Hydraulics, step_oil
from vgtsim.plant.oil import VAPOUR, Cylinders, fill, find_state
from vgtsim.statics.elasticity import TRAPPED

GAIN, STEP = 4.0, 1e-3
BORE, ANNULUS, SUPPLY, RATE = 8e-3, 6e-3, 20e6, 0.05
MODULUS, ROD = 1.4e9, 6e8
DISCRETE = 2 * GAIN * STEP  # one step late in a first-order lag errs by half of this; twice that is allowed
SMALL = 2e-2  # of a response: what pressures that change by a hundredth of the bulk modulus leave of a linear one


def one(value):
    return np.array([float(value)])


def cylinder(**changes):
    parts = {
        "area": np.array([[BORE], [ANNULUS]]),
        "modulus": one(MODULUS),
        "rod": one(ROD),
        "retracted": one(0.8),
        "stroke": one(0.6),
        "supply": one(SUPPLY),
        "rate": one(RATE),
        "leakage": one(0),
    }
    settings = {"gain": GAIN, "lock_band": 0.0, "timestep": STEP}
    parts |= {name: value for name, value in changes.items() if name in parts}
    return Hydraulics(
        Cylinders(**parts), **(settings | {name: value for name, value in changes.items() if name in settings})
    )


@dataclasses.dataclass
class Run:
    """What a test looks at, a value a step; lengths in m, tension in N, pressures in Pa."""

    time: np.ndarray
    length: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    hit: int


def play(hydraulics, command, seconds, mass=500.0, load=0.0, start=1.1, feed=True, damping=0.0):
    """A mass on the rod, pulled outward by `load(t)`; taken implicitly, as MuJoCo takes the arm."""
    pull = load if callable(load) else lambda t: load
    dt, parts = hydraulics.timestep, hydraulics.cylinders
    length, speed, rows, hit = one(start), np.zeros(1), [], 0
    oil = fill(parts, length, one(pull(0.0)))
    for t in np.arange(round(seconds / dt)) * dt:
        state = find_state(parts, oil, length)
        wanted = one(command(t))
        rate = one(command(t + dt)) - wanted if feed else np.zeros(1)
        rows.append((t, length[0], state.force[0], *state.pressure[:, 0]))
        oil, drift, now = step_oil(hydraulics, oil, state, wanted, rate / dt, length, speed)
        after = find_state(parts, oil, length)
        c = damping * after.stiffness
        push = pull(t) - after.force + c * drift
        speed = (speed + dt / mass * push) / (1 + dt / mass * (c + dt * after.stiffness))
        length = length + dt * speed
        hit |= int(now[0])
    table = np.array(rows)
    return Run(table[:, 0], table[:, 1], table[:, 2], table[:, 3:], hit)


def columns(piston):
    """Oil stiffness of either side, N/m, from areas and volumes."""
    return MODULUS * BORE / (piston + TRAPPED), MODULUS * ANNULUS / (0.6 - piston + TRAPPED)


def stiffness(piston):
    return 1 / (1 / sum(columns(piston)) + 1 / ROD)


@pytest.mark.parametrize("force", [-90e3, 0.0, 60e3])
def test_filled_cylinder_carries_its_load_at_its_length_with_pressures_that_sum_to_the_supply(force):
    parts = cylinder().cylinders
    state = find_state(parts, fill(parts, one(1.1), one(force)), one(1.1))
    assert state.force[0] == pytest.approx(force, abs=1e-3)
    assert state.pressure.sum() == pytest.approx(SUPPLY, rel=1e-9)
    assert state.pressure[1, 0] * ANNULUS - state.pressure[0, 0] * BORE == pytest.approx(force, abs=1e-3)


@pytest.mark.parametrize("length", [0.85, 1.1, 1.35])
def test_shut_cylinder_is_the_spring_of_its_columns_and_rod(length):
    """Central difference of the force, and Merritt's k = beta (A1²/V1 + A2²/V2) in series with the rod."""
    parts = cylinder().cylinders
    oil = fill(parts, one(length), np.zeros(1))
    high, low = (find_state(parts, oil, one(length + shift)).force[0] for shift in (1e-5, -1e-5))
    found = find_state(parts, oil, one(length)).stiffness[0]
    assert found == pytest.approx((high - low) / 2e-5, rel=1e-5)
    assert found == pytest.approx(stiffness(length - 0.8), rel=1e-9)


@pytest.mark.long
def test_small_step_of_a_light_load_is_the_first_order_lag():
    """L = c (1 - exp(-K t)): the closed form of flow in proportion to error."""
    run = play(cylinder(), lambda t: 1.105, 1.5, mass=10.0, start=1.1)
    assert run.length == pytest.approx(1.105 - 0.005 * np.exp(-GAIN * run.time), abs=0.005 * DISCRETE)
    assert run.hit == 0


@pytest.mark.long
def test_small_step_of_a_heavy_load_on_the_oil_spring_is_the_third_order_response():
    """K w² / (s³ + 2 z w s² + w² s + K w²): valve, oil spring and mass, H. E. Merritt, Hydraulic Control Systems, 6-2."""
    from scipy.signal import lti, step  # costs a third of a second, which every collection of tests would pay

    mass, beta, dt = 2e5, 2e-2, 1e-4
    w = np.sqrt(stiffness(0.3) / mass)
    run = play(cylinder(timestep=dt), lambda t: 1.1005, 1.5, mass=mass, damping=beta)
    # damper and valve share a piston: its speed is that of the flow, which the damper follows
    s = lti([w**2 * GAIN * beta, w**2 * GAIN], [1.0, w**2 * beta, w**2 * (1 + GAIN * beta), w**2 * GAIN])
    _, closed = step(s, T=run.time)
    moved = (run.length - 1.1) / 5e-4
    late = (GAIN + w) * dt  # a step's lag of valve and integrator
    assert np.abs(moved - closed).max() < SMALL + late
    assert closed.max() > 1.02  # it rings: a first-order lag would not do
    assert run.hit == 0


@pytest.mark.long
def test_ramp_without_feed_forward_lags_by_speed_over_gain():
    run = play(cylinder(), lambda t: 1.1 + 0.01 * t, 3.0, mass=10.0, feed=False)
    assert 1.1 + 0.01 * run.time[-1] - run.length[-1] == pytest.approx(0.01 / GAIN, rel=DISCRETE)


def test_ramp_with_feed_forward_is_followed():
    run = play(cylinder(), lambda t: 1.1 + 0.01 * t, 1.0, mass=10.0)
    assert run.length[-1] == pytest.approx(1.1 + 0.01 * run.time[-1], abs=2 * 0.01 * STEP)
    assert run.hit == 0


@pytest.mark.long
@pytest.mark.parametrize(("target", "load"), [(1.35, 0.0), (0.85, 0.0), (1.35, -0.5 * SUPPLY * BORE), (0.85, 6e4)])
def test_large_step_moves_at_the_flow_that_the_load_leaves_and_says_so(target, load):
    """Unloaded at the rated speed either way; half the push force leaves the root of one half of it."""
    run = play(cylinder(), lambda t: target, 2.0, mass=10.0, load=load)
    late = run.time > 0.5
    left = 1 + load / (SUPPLY * BORE) if target > 1.1 else 1 - load / (SUPPLY * ANNULUS)
    speed = np.polyfit(run.time[late], run.length[late], 1)[0]
    assert abs(speed) == pytest.approx(RATE * np.sqrt(left), rel=SMALL)
    assert run.hit == FLOW


def test_load_beyond_the_pressure_pushes_the_rod_back_through_the_relief_valve():
    limit = SUPPLY * BORE
    run = play(cylinder(), lambda t: 1.1, 0.5, mass=2e5, load=lambda t: -0.5 * limit if t < 0.1 else -1.3 * limit)
    assert run.hit & PRESSURE
    assert run.length[-1] < 1.1 - 5e-3
    assert run.pressure[:, 0].max() < SUPPLY * 1.05  # what a step of speed adds before the valve lets it out


@pytest.mark.long
def test_stroke_ends_the_travel():
    run = play(cylinder(), lambda t: 1.6, 3.5, mass=10.0, start=1.3)
    assert run.length[-1] == pytest.approx(1.4, abs=SUPPLY * BORE / ROD)
    assert run.hit & STROKE
    assert abs(run.force[-1]) < 1.0  # the gland takes what the supply pushes; nothing is left on the pin


def test_pull_on_a_shut_cylinder_opens_a_cavity_and_no_pressure_falls_below_the_vapours():
    shut = cylinder(lock_band=1.0)
    run = play(
        shut, lambda t: 1.1, 0.4, mass=5e3, load=lambda t: 0.0 if t < 0.1 else 3 * SUPPLY * ANNULUS, damping=1e-2
    )
    assert run.hit & CAVITY
    assert run.pressure.min() == VAPOUR
    free = play(shut, lambda t: 1.1, 0.4, mass=5e3, load=0.3 * SUPPLY * ANNULUS)
    assert not free.hit
    assert free.pressure.min() > 0


@pytest.mark.long
def test_locked_cylinder_sags_by_its_compressibility_and_does_not_drift():
    """Shut in without load, then loaded: the stretch is force over stiffness, and stays for a million steps' worth."""
    shut = cylinder(lock_band=1.0)
    pull = 5e3
    run = play(shut, lambda t: 1.1, 20.0, mass=500.0, load=lambda t: 0.0 if t < 0.01 else pull, damping=1e-2)
    assert run.length[-1] - 1.1 == pytest.approx(pull / stiffness(0.3), rel=2e-3)
    assert abs(run.length[-1] - run.length[len(run.length) // 2]) < 1e-12


@pytest.mark.long
def test_locked_cylinder_with_a_leaking_seal_drifts_exponentially_at_the_closed_forms_rate():
    """A1 p1' = A2 p2' under a constant load: drift and pressure difference fall together.

    Flow Q = C (p1 - p2) and piston speed v give p1' = -beta (Q + A1 v) / V1, p2' = beta (Q + A2 v) / V2; with columns
    k = beta A² / V on either side, v = -Q (k1 / A1 + k2 / A2) / (k1 + k2).
    """
    leakage, pull = 2e-12, 3e4
    leaky = cylinder(lock_band=1.0, leakage=one(leakage))
    run = play(leaky, lambda t: 1.1, 3.0, load=pull, damping=1e-2)
    k1, k2 = columns(0.3 - pull / ROD)
    p1 = (SUPPLY * ANNULUS - pull) / (BORE + ANNULUS)
    speed = -leakage * (2 * p1 - SUPPLY) * (k1 / BORE + k2 / ANNULUS) / (k1 + k2)
    series = k1 * k2 / (k1 + k2)
    decay = leakage * series * (1 / BORE - 1 / ANNULUS) ** 2
    closed = speed / decay * (1 - np.exp(-decay * run.time))
    assert abs(closed[-1]) > 1e-5
    assert run.length - 1.1 == pytest.approx(closed, abs=0.02 * abs(closed[-1]))
    shut = play(cylinder(lock_band=1.0), lambda t: 1.1, 3.0, load=pull, damping=1e-2)
    assert np.abs(shut.length - 1.1).max() < 1e-9


@pytest.mark.long
def test_open_valve_makes_up_for_the_leak_but_for_flow_over_gain():
    leakage, pull = 2e-12, 3e4
    run = play(cylinder(leakage=one(leakage)), lambda t: 1.1, 4.0, load=pull, damping=1e-2)
    across = run.pressure[-1, 0] - run.pressure[-1, 1]
    k1, k2 = columns(0.3 - pull / ROD)
    speed = -leakage * across * (k1 / BORE + k2 / ANNULUS) / (k1 + k2)
    assert run.length[-1] - 1.1 == pytest.approx(speed / GAIN, rel=0.05)


@pytest.mark.long
def test_response_does_not_depend_on_the_step():
    """Ten times the step moves a saturated, ringing, leaking cylinder by what a first-order method leaves."""
    lengths = [
        play(cylinder(timestep=dt, leakage=one(1e-12)), lambda t: 1.2, 3.0, mass=2e4, load=2e4, damping=5e-3).length[-1]
        for dt in (5e-4, 5e-3)
    ]
    assert lengths[0] == pytest.approx(lengths[1], abs=2e-4)
