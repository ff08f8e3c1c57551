"""`scripts/bench_simulation`: its chains are what it says, and its exponents are those of what was measured."""

from __future__ import annotations

import numpy as np
import pytest
from programs import load_program

from vgtsim.planning import check_site


@pytest.fixture
def bench(monkeypatch):
    return load_program(monkeypatch, "bench_simulation")


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_exponents_of_powers_are_found(bench, power):
    times = 3e-3 * np.array(bench.ACTUATORS, float) ** power
    assert bench.fit(times) == pytest.approx((power, power), abs=1e-12)
    times[0] = np.nan  # where a part has no figure
    assert bench.fit(times) == pytest.approx((power, power), abs=1e-12)


def test_fixed_costs_show_in_the_fit_and_less_in_the_last_two(bench):
    whole, last = bench.fit(1.0 + 0.1 * np.array(bench.ACTUATORS, float))
    assert whole < last < 1.0


def test_the_longest_chain_fits_its_tank_and_can_be_planned(bench):
    site = bench.make_site(bench.ACTUATORS[-1], 0.02)
    assert len(site.truss.actuated) == 120
    check_site(site)
