"""Multibody benchmarks in this project's rows: published places, orders of the schemes, closed loops, kept energy."""

from __future__ import annotations

import minimal_coordinates as minimal
import numpy as np
import pytest

from studies.marching import march
from studies.multibody import PUBLISHED, bricard, four_bars, pendulum

OWN = 5e-8  # m: the second route's own error, by its tolerance of integration
LOOP = 1e-6  # m: how far a loop may open
LEVEL = 0.65  # s: the bars of the longest mechanism are level after 0.72 s for the first time
CASES = {case.name: case for case in PUBLISHED}


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("A01 pendulum", lambda: minimal.pendulum(10)),
        ("A02 four-bar, N = 2", lambda: minimal.four_bars(10, 2)),
        ("A02 four-bar, N = 40", lambda: minimal.four_bars(10, 40)),
        ("A04 Bricard", lambda: minimal.bricard(2)),
    ],
)
def test_published_places_are_those_of_one_coordinate(name, place):
    assert place() == pytest.approx(CASES[name].point, abs=OWN)


@pytest.mark.parametrize(
    ("name", "limit"), [("A01 pendulum", 1e-5), ("A02 four-bar, N = 2", 1e-6), ("A04 Bricard", 1.5e-7)]
)
def test_runge_kutta_ends_at_the_published_place_with_its_loops_closed(name, limit):
    case = CASES[name]
    found = march(case.build(0.002), "rk4", 0.002, case.duration)
    assert found.point == pytest.approx(case.point, abs=limit)
    assert found.gap < LOOP
    assert found.energy < 1e-4


@pytest.mark.long
def test_forty_bars_end_at_the_published_place():
    """They pass ten positions in which all bars lie in one line and every cell could fold another way.

    The rows lose rank there. What energy a passage gives or takes depends on where a step falls, so the error at the end does
    not fall with the step as it does before the first passage. But it is no more than that of one coordinate which has the
    greatest change of the energy from the start.
    """
    case = CASES["A02 four-bar, N = 40"]
    found = march(case.build(0.01), "rk4", 0.01, case.duration)
    assert found.point == pytest.approx(case.point, abs=1.5e-3)
    gained, lost = (minimal.four_bars(case.duration, 40, sign * found.energy) for sign in (1, -1))
    reach = min(np.linalg.norm(place - case.point) for place in (gained, lost))
    assert np.linalg.norm(found.point - case.point) < reach < 2.5e-3


def test_forty_bars_are_of_second_order_until_they_are_level():
    exact = minimal.four_bars(LEVEL, 40)
    assert 0.9 < exact[0] < 1.0
    errors = [np.linalg.norm(march(four_bars(step, 40), "rk4", step, LEVEL).point - exact) for step in (0.01, 0.005)]
    assert 3.4 < errors[0] / errors[1] < 4.6


@pytest.mark.parametrize(
    ("build", "exact"),
    [
        (pendulum, lambda: minimal.pendulum(0.5)),
        (lambda step: four_bars(step, 2), lambda: minimal.four_bars(0.5, 2)),
        (bricard, lambda: minimal.bricard(0.5)),
    ],
    ids=["pendulum", "four-bar", "bricard"],
)
@pytest.mark.parametrize("scheme", ["rk4", "extrapolated"])
def test_halving_the_step_quarters_the_error_or_better(build, exact, scheme):
    place = exact()
    errors = [np.linalg.norm(march(build(step), scheme, step, 0.5).point - place) for step in (0.01, 0.005)]
    assert errors[0] / errors[1] > 3.4


@pytest.mark.parametrize("build", [pendulum, lambda step: four_bars(step, 2), bricard])
def test_steps_of_runs_lose_energy_to_first_order(build):
    """Which is why free swings are not judged by them."""
    coarse, fine = (march(build(step), "discrete", step, 0.5) for step in (0.01, 0.005))
    assert 1.7 < coarse.energy / fine.energy < 2.3
    assert 3.4 < coarse.gap / fine.gap < 4.6


@pytest.mark.parametrize("build", [pendulum, lambda step: four_bars(step, 2), bricard])
def test_extrapolated_steps_keep_loops_and_energy(build):
    coarse, fine = (march(build(step), "extrapolated", step, 0.5) for step in (0.01, 0.005))
    assert max(coarse.gap, fine.gap) < 1e-11
    assert coarse.energy / fine.energy > 3.4
