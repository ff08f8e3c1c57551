"""Natural modes: hand calculations and laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vgtsim.description.scene import Payload
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.modes import damping_time, find_modes, mass_matrix
from vgtsim.statics.stiffness import band_matrix, deflect, pattern_of, scatter, tip_compliance, tool_point
from vgtsim.statics.stiffness_matrix import unfold


@pytest.fixture(scope="module")
def model(hanging_arm):
    return make_elastic_model(hanging_arm, Payload(mass=453.6, radius=0.15), 9.80665)


@pytest.fixture(scope="module")
def bent(hanging_arm):
    q = np.array(hanging_arm.straight)
    q[:9:3], q[4] = 0.25, 0.1
    return hanging_arm.nodes(q)


def weightless(model):
    """Without gravity no member carries a force, which would stiffen or soften the arm."""
    return replace(model, loads=replace(model.loads, gravity=np.zeros(3)))


def test_arm_moved_bodily_has_its_mass(model, bent):
    """Moved along an axis as one, everything but what stands on the flange counts: hubs, members' shares, tip."""
    mass = mass_matrix(model, bent)
    size = pattern_of(model.truss).size
    along = np.zeros(size)
    along[2 : size - 3 : 3] = 1.0
    fixed = set(range(3))
    at_flange = [i for i, (a, b) in enumerate(model.truss.ends.tolist()) if {a, b} & fixed]
    whole = model.loads.mass - model.loads.hub_mass[:3].sum() - model.loads.members.mass[at_flange].sum()
    kinetic = along @ mass @ along
    assert whole < kinetic < model.loads.mass - model.loads.hub_mass[:3].sum()
    assert np.linalg.eigvalsh(mass).min() > 0


def test_heavy_payload_hangs_on_the_tip_compliance(hanging_arm, bent):
    """A payload far heavier than the arm: slowest modes are those of a mass on the 3 x 3 compliance of the tool."""
    heavy = make_elastic_model(hanging_arm, Payload(mass=1e6, radius=1e-3), 0.0)
    found = find_modes(heavy, bent, 3).frequency
    stiffness = np.linalg.inv(tip_compliance(heavy, bent)[:3, :3])
    assert tool_point(heavy.loads, bent).shape == (3,)
    hand = np.sqrt(np.linalg.eigvalsh(stiffness) / 1e6) / (2 * np.pi)
    assert found == pytest.approx(hand, rel=5e-3)


def test_rayleigh_quotient_of_the_sag_bounds_the_first_frequency_from_above(model, bent):
    """Any shape gives at least the lowest frequency; the mode itself gives it exactly."""
    modes = find_modes(weightless(model), bent, 2)
    stiff, mass = unfold(band_matrix(model, bent[None]).upper[0]), mass_matrix(model, bent)
    shape = np.linalg.solve(stiff, mass @ np.ones(len(mass)))
    quotient = np.sqrt(shape @ stiff @ shape / (shape @ mass @ shape)) / (2 * np.pi)
    assert modes.frequency[0] < quotient
    assert np.all(np.diff(modes.frequency) >= 0)


def test_pulled_hanging_arm_is_stiffer_and_by_the_pendulum(hanging_arm):
    """Hanging straight with a heavy payload, omega² grows by about g over the length, a pendulum's share."""
    heavy = make_elastic_model(hanging_arm, Payload(mass=5000.0, radius=0.15), 9.80665)
    nodes = hanging_arm.nodes(hanging_arm.straight)
    plain, pulled = (find_modes(item, nodes, 2).frequency for item in (weightless(heavy), heavy))
    gain = (2 * np.pi) ** 2 * (pulled[0] ** 2 - plain[0] ** 2)
    pendulum = 9.80665 / (nodes[0, 2] - tool_point(heavy.loads, nodes)[2])
    assert gain == pytest.approx(1.2 * pendulum, rel=0.1)  # 6/5 for a tip-loaded cantilever in tension


def test_symmetric_arm_has_pairs_of_modes(model, hanging_arm):
    """Threefold symmetry: bending modes of the straight arm come in pairs."""
    frequency = find_modes(model, hanging_arm.nodes(hanging_arm.straight), 4).frequency
    assert frequency[0] == pytest.approx(frequency[1], rel=1e-9)
    assert frequency[2] == pytest.approx(frequency[3], rel=1e-9)


def test_damping_time_is_twice_ratio_over_omega(model, bent):
    omega = 2 * np.pi * find_modes(model, bent, 1).frequency[0]
    assert damping_time(model, bent, 0.03) == pytest.approx(0.06 / omega)


def test_mirrored_arm_gives_mirrored_results(model, hanging_arm, bent):
    """Mirrored in the x-z plane with loads mirrored too; the prisms' diagonals are not symmetric, the laws are."""
    wrench = np.array([10.0, 20.0, 30.0, 1.0, 2.0, 3.0])
    plain = deflect(model, bent, tool_wrench=wrench)
    mirror = np.array([1.0, -1.0, 1.0])
    # a mirror keeps forces like vectors and turns moments like axial vectors
    axial = np.array([-1.0, 1.0, -1.0])
    force = np.concatenate([wrench[:3] * mirror, wrench[3:] * axial])
    turned = _mirrored(model, bent * mirror, force, bent, plain)
    assert turned < 1e-9


def _mirrored(model, nodes, wrench, original, plain):
    """In the mirror the tip's corners run the other way round, so the tool offset changes sign."""
    loads = replace(model.loads, tool_offset=-model.loads.tool_offset)
    other = deflect(replace(model, loads=loads), nodes, tool_wrench=wrench)
    mirror = np.array([1.0, -1.0, 1.0])
    shift = np.abs(other.nodes - plain.nodes * mirror).max() / np.abs(plain.nodes).max()
    return max(shift, np.abs(other.bar - plain.bar).max() / np.abs(plain.bar).max())


def test_lumped_members_add_the_kinetic_energy_of_points_at_the_nodes(hanging_arm, bent):
    """Against v' M v of an arm whose tubes and cylinders are as light as feathers, point by point."""
    payload, rng = Payload(mass=453.6, radius=0.15), np.random.default_rng(5)
    lumped = make_elastic_model(hanging_arm, payload, 9.80665, lumped=True)
    hub = hanging_arm.manipulator.hub_mass
    bare = replace(lumped, loads=replace(lumped.loads, hub_mass=np.full(len(bent), hub)))
    assert np.all(lumped.loads.members.mass == 0)
    added = lumped.loads.hub_mass - hub
    steel = make_elastic_model(hanging_arm, payload, 9.80665).loads.members.mass
    assert added.sum() == pytest.approx(steel.sum(), rel=1e-12)
    for v in rng.normal(size=(5, pattern_of(lumped.truss).size)):
        moved = scatter(lumped.truss, bent[None], v[None])[0]
        energy = v @ (mass_matrix(lumped, bent) - mass_matrix(bare, bent)) @ v
        assert energy == pytest.approx(added @ np.sum(moved**2, axis=-1), rel=1e-10)
