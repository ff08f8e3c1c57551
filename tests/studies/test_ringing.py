"""Springs of members and oil ring as they are described, whatever the step: the integrator's own damping is taken out."""

from __future__ import annotations

import numpy as np
import pytest

import vgtsim
from studies.ringing import change_options, ring

DAMPING, STEP = 0.02, 0.004


@pytest.mark.long
def test_elastic_arm_rings_with_the_damping_and_the_frequency_it_is_given():
    """A first-order step would add pi f dt, 0.019, to the ratio."""
    site = change_options(vgtsim.load("hydraulic_drives"), members="elastic", drive="rigid", damping_ratio=DAMPING)
    found = ring(site, STEP)
    assert found.misfit < 1e-3
    assert found.damping == pytest.approx(DAMPING, rel=0.01)
    assert found.frequency == pytest.approx(found.expected, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("step", [0.004, 0.008])
def test_servos_ring_with_the_damping_that_the_scene_gives(step):
    """A damper of stiffness times step more would add 0.023 to the ratio at 4 ms and 0.046 at 8 ms."""
    site = change_options(vgtsim.load("hydraulic_drives"), members="rigid", drive="servo")
    simulation = site.task.simulation
    found = ring(site, step)
    given = simulation.servo_damping / simulation.servo_stiffness * np.pi * found.expected
    assert found.damping == pytest.approx(given, rel=0.02)
    assert found.frequency == pytest.approx(found.expected, rel=3e-3)
