"""Springs of members and oil ring as they are described, whatever the step: the integrator's own damping is taken out."""

from __future__ import annotations

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
