"""What a cycle works out in kernels of its own, against NumPy's routes to the same figures."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.control.arm_now import ArmNow, find_mobility
from vgtsim.control.targets import Filter
from vgtsim.site import Site


def test_the_most_that_a_twist_asks_of_a_cylinder_is_that_of_the_damped_inverse(reach_scene):
    site, rng = Site(reach_scene), np.random.default_rng(5)
    arm = ArmNow(site.chain, site.chain.state(np.array(site.start)[None]))
    square = arm.jacobian @ arm.jacobian.T
    inverse = np.linalg.inv(square + 1e-6 * np.trace(square) * np.eye(6))
    for twist in rng.normal(size=(20, 6)):
        wanted = np.abs(arm.jacobian.T @ inverse @ twist).max()
        assert arm.ask_most(twist) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("least", [0.5, 2e-3, 5e-4, 2e-5, 5e-6])
def test_the_condition_number_is_that_of_singular_values_on_either_side_of_a_poor_one(least):
    rng = np.random.default_rng(2)
    left, right = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (5, 15))
    task = (left * [1.0, 0.9, 0.8, 0.7, least]) @ right[:5]
    found = find_mobility(task)
    assert found.condition == pytest.approx(np.linalg.cond(task), rel=1e-9)
    assert len(found.lost) == (least < 1e-5)


def test_a_velocity_passes_the_filters_as_written_and_what_is_left_of_a_rest_goes():
    rng = np.random.default_rng(1)
    raw, first, second = rng.normal(size=(3, 4))
    passed = Filter(0.3, raw.copy(), first.copy(), second.copy())
    wanted, share = rng.normal(size=4), 1 - np.exp(-0.02 / 0.3)
    passed.advance(wanted, lambda change: 0.1, 0.02)
    raw = raw + (wanted - raw) * 0.2
    first = first + share * (raw - first)
    assert np.allclose(passed.raw, raw, rtol=1e-14)
    assert np.allclose(passed.first, first, rtol=1e-14)
    assert np.allclose(passed.second, second + share * (first - second), rtol=1e-14)
    for size, left in ((1.9e-5, False), (2.1e-5, True)):
        resting = Filter.start(1e9, np.array([0.0, size]))
        resting.advance(np.zeros(2), lambda change: 1e9, 0.02)
        assert resting.still is not left
