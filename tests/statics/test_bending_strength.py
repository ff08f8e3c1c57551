"""Bending strength and interaction by hand, after the clauses of AISC 360-22."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.statics import make_load_model, solve_members
from vgtsim.statics.rating import make_sections, rate, rod_bending_strength, tube_bending_strength
from vgtsim.statics.utilisation import MODES, amplify, greatest_moments, interact, utilise

HAND = 1e-4  # five digits
ROOT = Path(__file__).parents[2] / "models"
OMEGA = 1.67


def test_a_two_inch_rod_by_hand():
    """S = pi (50.8 mm)³ / 32 = 12 870.7 mm³; Z = (50.8)³ / 6 = 21 849.4 mm³ = 1.698 S, so 1.6 Fy S governs."""
    assert rod_bending_strength(0.0508, 315e6) == pytest.approx(1.6 * 315e6 * 12870.7e-9, rel=HAND)


def test_a_barrel_by_hand():
    """Z = (114.3³ - 101.6³) / 6 mm³ = (1 493 271 - 1 048 772) / 6 = 74 083 mm³."""
    assert tube_bending_strength(0.1143, 0.1016, 315e6) == pytest.approx(315e6 * 74083e-9, rel=HAND)


def test_plastic_modulus_is_the_first_moment_of_the_halves():
    y = (np.arange(200000) + 0.5) / 200000 * 0.05715
    outer = 2 * np.sqrt(0.05715**2 - y**2)
    inner = 2 * np.sqrt(np.maximum(0.0508**2 - y**2, 0.0))
    Z = 2 * np.sum(y * (outer - inner)) * 0.05715 / 200000
    assert tube_bending_strength(0.1143, 0.1016, 1.0) == pytest.approx(Z, rel=1e-5)


@pytest.mark.parametrize(
    ("axial", "bending", "used"),
    [(0.5, 0.45, 0.9), (0.2, 0.9, 1.0), (0.1, 0.6, 0.65), (0.0, 0.7, 0.7), (1.0, 0.0, 1.0)],
)
def test_interaction_by_hand(axial, bending, used):
    """H1-1a from an axial part of 0.2: 0.5 + 8/9 0.45 = 0.9; H1-1b below: 0.05 + 0.6 = 0.65. They meet at 0.2."""
    assert interact(axial, bending) == pytest.approx(used)


def test_compression_amplifies_by_hand():
    """1 / (1 - 1.6 100 kN / 800 kN) = 1.25; beyond Euler's load over 1.6 there is no equilibrium."""
    assert amplify(100e3, 800e3) == pytest.approx(1.25)
    assert amplify(0.0, 800e3) == 1.0
    assert np.isinf(amplify(500e3, 800e3))


def test_moment_runs_straight_between_the_pins():
    """100 at one end, 40 bent the same way at the other (opposite moments on the blocks); mouth at three quarters: 55."""
    near, far = np.array([[0.0, 0.0, 100.0]]), np.array([[0.0, 0.0, -40.0]])
    barrel, rod = greatest_moments(near, far, np.array([0.75]))
    assert (barrel[0], rod[0]) == pytest.approx((100.0, 55.0))
    barrel, rod = greatest_moments(near, -far, np.array([0.75]))  # both the same sense: double curvature
    assert (barrel[0], rod[0]) == pytest.approx((100.0, 40.0))


@pytest.fixture(scope="module")
def offset():
    chain = Chain(load_manipulator(ROOT / "octahedron_offset/octahedron_offset.toml"), hanging_mount(4.0))
    return chain, chain.nodes(sample_inputs(chain, 5, seed=44))


def test_an_offset_actuator_is_rated_by_the_clauses(offset):
    """One actuator, worked through with the formulas written out anew."""
    chain, nodes = offset
    forces = solve_members(make_load_model(chain, Payload(mass=453.6, radius=0.1), 9.81), nodes)
    ends = chain.truss.ends
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    use = utilise(rate(make_sections(chain), length, OMEGA), forces)
    part = chain.manipulator.cylinders["c400"]
    pinned = chain.truss.ring_actuators[0]
    for instant in range(5):
        for index in pinned:
            L, fy, e = length[instant, index], 315e6, 200e9
            area, inertia = np.pi / 4 * part.rod**2, np.pi / 64 * part.rod**4
            along = np.array([getattr(forces, name)[instant, index] for name in ("near_axial", "bar", "far_axial")])
            pull, push = max(along.max(), 0.0), max(-along.min(), 0.0)
            euler = np.pi**2 * e * inertia / L**2
            stress = euler / area
            column = area * (0.658 ** (fy / stress) * fy if fy / stress <= 2.25 else 0.877 * stress)
            axial = max(pull / (fy * area / OMEGA), push / (column / OMEGA))
            near, far = forces.near_moment[instant, index], -forces.far_moment[instant, index]
            mouth = near + (far - near) * (part.retracted - part.eye) / L
            rod = max(np.linalg.norm(mouth), np.linalg.norm(far)) / (1.6 * fy * np.pi * part.rod**3 / 32 / OMEGA)
            z = (part.barrel_diameter**3 - part.bore**3) / 6
            barrel = max(np.linalg.norm(mouth), np.linalg.norm(near)) / (fy * z / OMEGA)
            bending = max(rod, barrel) / (1 - 1.6 * push / euler)
            expected = axial + 8 / 9 * bending if axial >= 0.2 else axial / 2 + bending
            assert use.bent[instant, index] == pytest.approx(expected, rel=1e-9)
            assert use.bent[instant, index] > 1.05 * axial / 2
    straight = np.setdiff1d(np.arange(len(ends)), pinned)
    assert not use.bent[:, straight].any()
    assert use.by_mode.shape == (len(MODES), *length.shape)


def test_more_bending_is_used_more(offset):
    chain, nodes = offset
    forces = solve_members(make_load_model(chain, Payload(mass=453.6, radius=0.1), 9.81), nodes)
    ends = chain.truss.ends
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    ratings = rate(make_sections(chain), length, OMEGA)
    twice = replace(forces, near_moment=2 * forces.near_moment, far_moment=2 * forces.far_moment)
    pinned = chain.truss.ring_actuators[0]
    assert np.all(utilise(ratings, twice).bent[:, pinned] > utilise(ratings, forces).bent[:, pinned])
