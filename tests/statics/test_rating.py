from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.description.sections import Material, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.statics import make_load_model, make_sections, rate, solve_members, utilise
from vgtsim.statics.rating import (
    ROD_FACTOR,
    MemberSections,
    column_strength,
    describe_sections,
    effective_area,
    pin_shear,
    rod_buckling,
    tension_yield,
)

HAND = 5e-4  # the hand calculations below carry four digits
TABLE = 0.05  # ksi: half the last digit that the AISC table prints
OMEGA = 1.67


@pytest.fixture(scope="module")
def chain():
    arm = load_manipulator(Path(__file__).parents[2] / "models" / "arm15" / "arm15.toml")
    return Chain(arm, hanging_mount(7.32))


@pytest.mark.parametrize(("slenderness", "printed"), [(50, 37.5), (100, 21.7), (200, 5.65)])
def test_critical_stress_is_the_manual_s(slenderness, printed):
    """AISC Manual, available critical stress of columns: phi Fcr for Fy = 50 ksi, E = 29,000 ksi."""
    assert 0.9 * column_strength(1.0, slenderness, 50.0, 29000.0) == pytest.approx(printed, abs=TABLE)


def test_column_of_a_3_in_tube_is_the_hand_calculation():
    """3.0 x 0.375 in, 1.6933 m: A 1995 mm², r 23.81 mm, KL/r 71.11, Fe 390.4 MPa, Fcr 224.7 MPa."""
    outer, inner = 0.0762, 0.05715
    area, radius = np.pi / 4 * (outer**2 - inner**2), np.hypot(outer, inner) / 4
    assert area == pytest.approx(1995e-6, rel=HAND)
    strength = column_strength(area, 1.6933 / radius, 315e6, 200e9)
    assert strength == pytest.approx(448.3e3, rel=HAND)


def test_slender_column_is_the_hand_calculation():
    """KL/r 150, past 4.71 sqrt(E/Fy) = 118.7: Fe = 87.73 MPa, Fcr = 76.94 MPa."""
    assert column_strength(1e-3, 150.0, 315e6, 200e9) == pytest.approx(76.94e3, rel=HAND)


def test_two_bar_frame_buckles_at_the_hand_calculation():
    """Two bars of 2 m at 30 degrees to the ground push against each other under P: each carries P, as 2 sin 30 = 1.

    1.5 x 0.125 in tube: A 348.4 mm², r 12.40 mm, KL/r 161.3, Fe 75.87 MPa, Fcr 66.54 MPa: P = 23.18 kN.
    """
    outer, inner = 0.0381, 0.03175
    area, radius = np.pi / 4 * (outer**2 - inner**2), np.hypot(outer, inner) / 4
    bar = column_strength(area, 2.0 / radius, 315e6, 200e9)
    load = 2 * np.sin(np.pi / 6) * bar
    assert load == pytest.approx(23.18e3, rel=2 * HAND)


def test_column_curve_joins_and_never_rises():
    slenderness = np.linspace(1, 250, 2000)
    strength = column_strength(1.0, slenderness, 315e6, 200e9)
    assert np.all(np.diff(strength) < 0)
    limit = 4.71 * np.sqrt(200e9 / 315e6)
    before, after = column_strength(1.0, np.array([limit - 1e-6, limit + 1e-6]), 315e6, 200e9)
    assert after == pytest.approx(before, rel=1e-3)  # the two branches of E3 meet to the digits printed there
    assert strength[0] == pytest.approx(tension_yield(1.0, 315e6), rel=1e-3)


def test_pipe_column_is_the_published_example():
    """AISC Design Examples E.11: Pipe 10 Std. of 30 ft, Fy 35 ksi, A 11.5 in², r 3.68 in, D/t 31.6; Pn/Omega 147 kip."""
    area, slimness, slenderness = 11.5, 31.6, 360 / 3.68
    assert effective_area(area, slimness, 35.0, 29000.0) == area  # 31.6 is below 0.11 E/Fy = 91.1
    assert column_strength(1.0, slenderness, 35.0, 29000.0) == pytest.approx(21.4, abs=TABLE)
    strength = column_strength(area, slenderness, 35.0, 29000.0)
    assert strength / OMEGA == pytest.approx(147, abs=1)  # the example goes on with its rounded 21.4 ksi
    assert 0.9 * strength == pytest.approx(221, abs=1)


def rate_tube(outer, wall, design_wall=1.0, length=60.0):
    """Nominal strengths of a tube in inches and ksi: E 29,000, Fy 46."""
    tube = Tube(outer_diameter=outer, wall=wall, material="steel")
    steel = Material(density=1.0, youngs_modulus=29000.0, yield_strength=46.0, design_wall=design_wall)
    return rate(describe_sections([(tube, steel)]), np.array([length]), 1.0)


def test_thin_round_wall_loses_what_section_e7_takes():
    """6 x 0.05 in: D/t 120, past 0.11 E/Fy = 69.3: Ae = 0.866 A, Pn = 0.866 times 40.7 kip."""
    assert rate_tube(6.0, 0.05).compression == pytest.approx([35.26], abs=0.05)
    assert effective_area(1.0, 120.0, 46.0, 29000.0) == pytest.approx(0.038 * 29000 / 46 / 120 + 2 / 3)
    whole = effective_area(1.0, np.array([10.0, 69.0, 70.0]), 46.0, 29000.0)
    assert whole.tolist() == [1.0, 1.0, 1.0]  # the formula begins above the whole area, by a hundredth
    slim = effective_area(1.0, np.linspace(1, 280, 500), 46.0, 29000.0)
    assert np.all(np.diff(slim) <= 0)


def test_design_wall_is_0_93_of_the_nominal_one():
    """AISC Manual table 1-13: HSS 10.000 x 0.250 has a design wall of 0.233 in, an area of 7.15 in²; A1085 has all of it."""
    drawn, full = rate_tube(10.0, 0.25, design_wall=0.233 / 0.25), rate_tube(10.0, 0.25)
    assert drawn.tension == pytest.approx([46 * 7.15], abs=46 * 0.005)  # half the last digit printed
    assert full.tension == pytest.approx([46 * np.pi * 9.75 * 0.25])
    usual = Material(density=1.0, youngs_modulus=1.0, yield_strength=1.0).design_wall
    assert usual * 0.25 == pytest.approx(0.233, abs=6e-4)


def test_wall_that_the_specification_does_not_rate_is_refused():
    with pytest.raises(DescriptionError, match="E7"):
        rate_tube(6.0, 0.02)  # D/t 300, past 0.45 E/Fy = 284


def test_rod_buckling_is_the_hand_calculation():
    """2 in rod, 1.3716 m: I 3.269e-7 m4, Pcr 343.0 kN."""
    assert rod_buckling(0.0508, 200e9, 1.3716) == pytest.approx(343.0e3, rel=HAND)


def test_pin_in_double_shear_is_the_hand_calculation():
    """2 in pin: A 2026.8 mm², two planes at 0.6 times 315 MPa: 766.1 kN."""
    assert pin_shear(0.0508, 315e6) == pytest.approx(766.1e3, rel=HAND)


def test_pins_are_rated_where_they_are_given(chain):
    tubes, parts = chain.manipulator.tubes, chain.manipulator.cylinders
    pinned = chain.manipulator.modules[0].longeron_tube
    bare = {name: part.model_copy(update={"pin": None}) for name, part in parts.items()}
    tubes = tubes | {pinned: tubes[pinned].model_copy(update={"pin": 0.02})}
    arm = chain.manipulator.model_copy(update={"tubes": tubes, "cylinders": bare})
    section = make_sections(replace(chain, manipulator=arm))
    given = [member.section == pinned for member in chain.truss.members]
    assert np.isfinite(section.pin).tolist() == given
    forces = solve_members(make_load_model(chain, Payload(mass=400, radius=0.1), 9.81), chain.nodes(chain.straight))
    use = utilise(rate(section, np.ones(len(given)), OMEGA), forces)
    most = np.abs(np.stack([forces.near_axial, forces.bar, forces.far_axial])).max(axis=0)
    assert use.pin[given] == pytest.approx(most[given] * OMEGA / pin_shear(0.02, 315e6))
    assert np.all(use.pin[np.logical_not(given)] == 0)
    assert np.all(use.strength >= use.pin)


def test_oil_holds_its_area_times_pressure(chain):
    """4 in bore, 2 in rod, 3000 psi: 12.566 in² push 37,699 lbf, 9.4248 in² pull 28,274 lbf."""
    some = chain.manipulator.cylinders[chain.manipulator.active[0].cylinder]
    cylinder = some.model_copy(update={"bore": 0.1016, "rod": 0.0508, "pressure": 3000 * 6894.757})
    assert cylinder.push == pytest.approx(37699 * 4.448222, rel=HAND)
    assert cylinder.pull == pytest.approx(28274 * 4.448222, rel=HAND)


def test_every_member_is_rated_by_its_own_section(chain):
    section = make_sections(chain)
    for index, member in enumerate(chain.truss.members):
        if member.role == "actuator":
            cylinder = chain.manipulator.cylinders[member.section]
            assert section.push[index] == cylinder.push
            assert section.area[index] == pytest.approx(np.pi / 4 * cylinder.rod**2)
        else:
            assert np.isinf(section.pull[index])
            tube = chain.manipulator.tubes[member.section]
            thin = tube.model_copy(update={"wall": 0.93 * tube.wall})
            assert (section.area[index], section.gyration_radius[index]) == (thin.area, thin.gyration_radius)
            assert section.slimness[index] == pytest.approx(tube.outer_diameter / (0.93 * tube.wall))
    assert np.flatnonzero(section.actuator).tolist() == chain.truss.actuated.tolist()


def made_up(forces, bar):
    """Forces of two members, with 1 kN of own weight along them."""
    still = np.zeros((2, 3))
    along = {"bar": bar, "near_axial": bar + 1e3, "far_axial": bar}
    return replace(forces, **along, near_transverse=still, near_moment=still, far_moment=still, direction=still)


def test_utilisation_takes_the_worst_along_the_member(chain):
    forces = solve_members(make_load_model(chain, Payload(mass=1, radius=0.1), 9.81), chain.nodes(chain.straight))
    section = MemberSections(
        area=np.full(2, 1e-3),
        gyration_radius=np.full(2, 0.01),
        yield_strength=np.full(2, 315e6),
        youngs_modulus=np.full(2, 200e9),
        push=np.array([np.inf, 200e3]),
        pull=np.array([np.inf, 100e3]),
        actuator=np.array([False, True]),
    )
    ratings = rate(section, np.full((1, 2), 1.5), OMEGA)
    euler = rod_buckling(0.04, 200e9, 1.5)
    pulled = utilise(ratings, made_up(forces, np.array([[50e3, 50e3]])))
    assert pulled.tension == pytest.approx(np.full((1, 2), 51e3 / (315e3 / OMEGA)))
    assert pulled.pressure == pytest.approx(np.array([[0.0, 0.5]]))
    assert np.all(pulled.compression == 0)
    pushed = utilise(ratings, made_up(forces, np.array([[-20e3, -20e3]])))
    assert pushed.compression == pytest.approx(np.full((1, 2), 20e3 / (76.94e3 / OMEGA)), rel=HAND)
    assert pushed.rod == pytest.approx(np.array([[0.0, 20e3 * ROD_FACTOR / euler]]))
    assert pushed.pressure == pytest.approx(np.array([[0.0, 0.1]]))
    assert np.all(pushed.tension == 0)
    assert pushed.strength == pytest.approx(np.maximum(pushed.compression, pushed.rod))


def test_unknown_forces_stay_unknown(chain):
    forces = solve_members(make_load_model(chain, Payload(mass=1, radius=0.1), 9.81), chain.nodes(chain.straight))
    lengths = np.ones(len(chain.truss.members))
    unknown = replace(forces, bar=np.full_like(forces.bar, np.nan))
    use = utilise(rate(make_sections(chain), lengths, OMEGA), unknown)
    assert np.isnan(use.strength).all()
    assert np.isnan(use.pressure).all()
