"""One cylinder that lifts one mass in MuJoCo, with the drive that moves whole arms, against closed forms."""

from __future__ import annotations

from typing import cast

import mujoco
import numpy as np
import pytest

from vgtsim.plant.drives import HydraulicDrive
from vgtsim.plant.hydraulics import Hydraulics
from vgtsim.plant.oil import Cylinders, fill, find_state
from vgtsim.plant.springs import Springs
from vgtsim.statics.elasticity import TRAPPED, ElasticModel

MASS, BETA, GAIN, G = 1e5, 1.2e-2, 4.0, 9.80665
BORE, ANNULUS, SUPPLY, MODULUS, ROD = 8e-2, 6e-2, 20e6, 1.4e9, 5e9
START = 1.1
SMALL = 2e-2  # of a response: pressures change by a hundredth of the bulk modulus, columns by a thousandth


def one(value):
    return np.array([float(value)])


def stiffness():
    piston = START - 0.8
    column = MODULUS * (BORE / (piston + TRAPPED) + ANNULUS / (0.6 - piston + TRAPPED))
    return 1 / (1 / column + 1 / ROD)


def lift(command, seconds, timestep, gravity=G, leakage=0.0, lock_band=0.0):
    """Length at every step, and the pressures of the last, of a cylinder that carries the mass hanging from it."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = timestep, [0, 0, -gravity]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    body = spec.worldbody.add_body(mass=MASS, inertia=[1, 1, 1], explicitinertial=True)
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, -1])
    model = spec.compile()
    data = mujoco.MjData(model)
    parts = Cylinders(np.array([[BORE], [ANNULUS]]), *(one(x) for x in (MODULUS, ROD, 0.8, 0.6, SUPPLY, 0.05, leakage)))
    hydraulics = Hydraulics(parts, GAIN, lock_band, timestep)
    springs = Springs(
        model=model,
        elastic=cast(ElasticModel, None),
        joints=np.array([0]),
        position=model.jnt_qposadr,
        slide=model.jnt_dofadr,
        excess=BETA - timestep,
        period=1.0,
    )
    data.qpos[0] = START
    oil = fill(parts, one(START), one(MASS * gravity))
    drive = HydraulicDrive(data, springs, hydraulics, oil, find_state(parts, oil, one(START)))
    lengths = []
    for count in range(round(seconds / timestep)):
        drive.command(one(command((count + 1) * timestep)))
        mujoco.mj_step(model, data)
        lengths.append(data.qpos[0])
    return (np.arange(len(lengths)) + 1) * timestep, np.array(lengths), drive.pressure[0]


@pytest.mark.long
@pytest.mark.parametrize("timestep", [5e-4, 5e-3])
def test_step_response_is_that_of_valve_oil_spring_and_mass(timestep):
    """K w² (1 + beta s) / (s³ + beta w² s² + w² (1 + K beta) s + K w²); the step size may add a step's lag."""
    from scipy.signal import lti, step  # costs a third of a second, which every collection of tests would pay

    w = np.sqrt(stiffness() / MASS)
    system = lti([w**2 * GAIN * BETA, w**2 * GAIN], [1.0, w**2 * BETA, w**2 * (1 + GAIN * BETA), w**2 * GAIN])
    time, length, _ = lift(lambda t: START + 5e-4, 1.5, timestep)
    _, closed = step(system, T=np.concatenate([[0.0], time]))
    late = 2 * timestep * np.abs(np.diff(closed) / timestep).max()
    assert np.abs((length - START) / 5e-4 - closed[1:]).max() < SMALL + late


def test_ramp_is_followed_and_ends_where_it_should():
    time, length, _ = lift(lambda t: START + 0.02 * min(t, 2.0), 6.0, 5e-3)
    moving = (time > 1.0) & (time < 1.9)
    assert length[moving] == pytest.approx(START + 0.02 * time[moving], abs=2e-4)
    assert length[-1] == pytest.approx(START + 0.04, abs=1e-6)


def test_pressures_carry_the_weight():
    """p2 A2 - p1 A1 = m g, whatever MuJoCo made of the spring it was told of."""
    _, _, pressure = lift(lambda t: START, 1.0, 5e-3)
    assert pressure[1] * ANNULUS - pressure[0] * BORE == pytest.approx(MASS * G, rel=1e-9)


@pytest.mark.long
def test_shut_valves_hold_the_mass_where_it_is_and_a_leaking_seal_lets_it_sink_as_its_closed_form_says():
    load, leakage = MASS * G, 2e-12
    time, length, _ = lift(lambda t: START, 4.0, 5e-3, lock_band=1.0)
    assert np.abs(length - START).max() < 1e-9
    _, length, _ = lift(lambda t: START, 4.0, 5e-3, lock_band=1.0, leakage=leakage)
    piston = START - 0.8 - load / ROD
    k1, k2 = MODULUS * BORE / (piston + TRAPPED), MODULUS * ANNULUS / (0.6 - piston + TRAPPED)
    p1 = (SUPPLY * ANNULUS - load) / (BORE + ANNULUS)
    speed = -leakage * (2 * p1 - SUPPLY) * (k1 / BORE + k2 / ANNULUS) / (k1 + k2)
    decay = leakage * k1 * k2 / (k1 + k2) * (1 / BORE - 1 / ANNULUS) ** 2
    closed = speed / decay * (1 - np.exp(-decay * time))
    assert abs(closed[-1]) > 1e-4
    assert length - START == pytest.approx(closed, abs=0.02 * abs(closed[-1]))
