"""Trusses of the sizing literature: forces against an independent program, least weights against those of the literature."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from Pynite import FEModel3D

from studies.sizing_problems import (
    LIGHTEST_OF_SECTIONS,
    MODULUS,
    SECTIONS,
    bound_weight,
    find_least_weight,
    make_problem,
    seventy_two_bar,
    size_from_catalogue,
    ten_bar,
    twenty_five_bar,
)

AGREE = 1e-9  # of the largest force
PROBLEMS = [ten_bar, twenty_five_bar, seventy_two_bar]


def forces_by_pynite(problem, areas, load):
    """Bar forces, tension positive, kip."""
    frame = FEModel3D()
    frame.add_material("aluminium", MODULUS, MODULUS / 2.6, 0.3, 1.0)
    for index, (place, force) in enumerate(zip(problem.nodes, load, strict=True)):
        name = f"n{index}"
        frame.add_node(name, *map(float, place))
        frame.def_support(name, *map(bool, ~problem.frame.free[index]), True, True, True)
        for axis, value in zip(("FX", "FY", "FZ"), force, strict=True):
            frame.add_node_load(name, axis, float(value))
    for index, (first, second) in enumerate(problem.frame.ends):
        frame.add_section(f"s{index}", float(areas[problem.group[index]]), 1e-6, 1e-6, 1e-6)
        frame.add_member(f"m{index}", f"n{first}", f"n{second}", "aluminium", f"s{index}")
        frame.def_releases(f"m{index}", Ryi=True, Rzi=True, Ryj=True, Rzj=True)
    frame.analyze_linear(check_stability=False)
    return np.array([-frame.members[f"m{i}"].axial(0.0, "Combo 1") for i in range(len(problem.frame.ends))])


@pytest.mark.parametrize("make", PROBLEMS)
def test_forces_are_those_of_an_independent_program(make):
    problem = make()
    areas = np.random.default_rng(11).uniform(0.5, 5.0, len(problem.weights))
    _, bar = problem.solve(areas)
    for mine, load in zip(bar, problem.loads, strict=True):
        assert np.abs(mine - forces_by_pynite(problem, areas, load)).max() < AGREE * np.abs(mine).max()


@pytest.mark.parametrize(
    ("problem", "start", "printed", "half"),
    [
        (ten_bar(), 10.0, 5060.85, 0.005),
        (ten_bar(np.inf), 10.0, 1593.18, 0.005),
        (twenty_five_bar(), 1.0, 545.2, 0.05),
        pytest.param(seventy_two_bar(), 1.0, 379.6, 0.05, marks=pytest.mark.long),
    ],
    ids=["ten bars", "ten bars by stress", "25 bars", "72 bars"],
)
def test_least_weight_is_that_of_the_literature(problem, start, printed, half):
    weight, areas = find_least_weight(problem, start)
    assert weight == pytest.approx(printed, abs=half)
    assert problem.use(areas).max() <= 1 + 1e-9
    assert areas.min() >= problem.least - 1e-12


def test_lightest_design_of_sections_in_the_literature_stands_and_weighs_as_printed():
    problem = ten_bar()
    assert problem.weights @ LIGHTEST_OF_SECTIONS == pytest.approx(5490.74, abs=0.005)
    assert problem.use(LIGHTEST_OF_SECTIONS).max() <= 1.0
    assert problem.use(LIGHTEST_OF_SECTIONS * 0.999).max() > 1.0


@cache
def bounds():
    problem = ten_bar(np.inf)
    return bound_weight(problem), bound_weight(problem, SECTIONS)


def test_sizes_from_the_catalogue_stand_and_no_design_is_below_the_bound():
    problem = ten_bar(np.inf)
    weight, areas = size_from_catalogue(problem, SECTIONS)
    continuous, catalogue = bounds()
    assert problem.use(areas).max() <= 1.0
    assert continuous < catalogue <= weight
    assert continuous < find_least_weight(problem, 10.0)[0]
    assert weight < 1.1 * catalogue


def test_bound_is_reached_where_forces_follow_from_equilibrium_alone():
    """Two bars at right angles under one load: each must carry its force, which the bound finds as well."""
    load = np.zeros((1, 3, 3))
    load[0, 2] = (0, 0, -30)
    problem = make_problem(
        [(0, 0, 0), (200, 0, 0), (100, 0, 100)],
        [(1, 3), (2, 3)],
        {"1": "xyz", "2": "xyz", "3": "y"},
        loads=load,
        group=np.arange(2),
        pull=np.full(2, 20.0),
        push=np.full(2, 10.0),
        limited=np.zeros((3, 3), bool),
        most=np.inf,
        least=0.01,
    )
    force = 30 / np.sqrt(2)
    assert bound_weight(problem) == pytest.approx(problem.weights.sum() * force / 10)
    sizes = np.array([0.5, 1.0, 2.0, 2.5, 4.0])
    assert bound_weight(problem, sizes) == pytest.approx(problem.weights.sum() * 2.5)
    assert size_from_catalogue(problem, sizes)[0] == pytest.approx(problem.weights.sum() * 2.5)
