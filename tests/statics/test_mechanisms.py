"""A mechanism is refused wherever stiffness or forces are asked for: by name, with the figure, exact or but for rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.frameworks import deflect_framework, make_framework
from vgtsim.description.catalogue import load_catalogue
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.errors import NearSingularWarning, TrussError
from vgtsim.statics import solve_members
from vgtsim.statics.capacity import find_allowance
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.modes import find_modes
from vgtsim.statics.sizing import Demand, size_arm
from vgtsim.statics.stiffness import band_matrix, deflect, pattern_of, settle, tip_compliance
from vgtsim.statics.stiffness_matrix import is_sound, softest, unfold

PAYLOAD = Payload(mass=453.6, radius=0.15)


def weightless(model):
    return replace(model, loads=replace(model.loads, gravity=np.zeros(3)))


LOST = "m3/longeron/2"
ELASTIC = {
    "deflect": deflect,
    "compliance": tip_compliance,
    "settle": settle,
    "modes": find_modes,
    "plain modes": lambda model, nodes: find_modes(weightless(model), nodes),
}


@pytest.fixture(scope="module")
def model(hanging_arm):
    return make_elastic_model(hanging_arm, PAYLOAD, 9.80665)


@pytest.fixture(scope="module")
def bent(hanging_arm):
    q = np.array(hanging_arm.straight)
    q[[0, 3, 6]], q[4] = 0.25, 0.1
    return hanging_arm.nodes(q)


def flattened(chain, lift):
    """The straight arm with the mid-plane of its first module in the plane of the mast flange, or lifted from it."""
    nodes = chain.nodes(chain.straight)
    nodes[[chain.truss.nodes.index(f"m1/mid/{i}") for i in (1, 2, 3)], 2] = nodes[0, 2] - lift
    return nodes


@pytest.mark.parametrize("what", ELASTIC)
def test_member_without_stiffness_is_named_with_the_figure(model, bent, what):
    spring = model.spring.copy()
    spring[model.truss.member_names.index(LOST)] = 0.0
    with pytest.raises(TrussError, match=rf"mechanism.*{LOST} 0 N/m; smallest scaled eigenvalue .*1e-13") as caught:
        ELASTIC[what](replace(model, spring=spring), bent)
    assert caught.value.members == (LOST,)


def test_two_members_without_stiffness_are_both_named(model, bent):
    """Each is a mechanism of its own; which mix of the two comes out of an eigenvalue solver is chance."""
    spring, lost = model.spring.copy(), (LOST, "m1/longeron/1")
    spring[[model.truss.member_names.index(name) for name in lost]] = 0.0
    with pytest.raises(TrussError) as caught:
        deflect(replace(model, spring=spring), bent)
    assert set(caught.value.members) == set(lost)


@pytest.mark.parametrize("lift", [0.0, 1e-17, 1e-12])
@pytest.mark.parametrize("what", ELASTIC)
def test_flat_module_is_named_with_the_figure(hanging_arm, model, what, lift):
    with pytest.raises(TrussError, match=r"mechanism.* singular value .*scaled eigenvalue") as caught:
        ELASTIC[what](model, flattened(hanging_arm, lift))
    assert any(name.startswith("m1/") for name in caught.value.members)


@pytest.mark.parametrize("lift", [0.0, 1e-17, 1e-12])
def test_flat_module_is_refused_by_forces_capacity_and_size(hanging_arm, model, bent, lift):
    nodes = np.stack([bent, flattened(hanging_arm, lift)])
    demand = Demand(nodes, None, PAYLOAD, (LoadCase(name="run"),), 9.80665, 1.67)
    for attempt in (
        lambda: solve_members(model.loads, nodes),
        lambda: find_allowance(hanging_arm, nodes, 9.80665, 1.67, 0.15),
        lambda: size_arm(hanging_arm, load_catalogue(), demand),
    ):
        with pytest.raises(TrussError, match=r"instant 1: .*mechanism.*smallest sine between bars .*1e-09") as caught:
            attempt()
        assert any(name.startswith("m1/") for name in caught.value.members)


@pytest.mark.parametrize("what", ["deflect", "settle"])
def test_pose_of_a_batch_is_named(hanging_arm, model, bent, what):
    nodes = np.repeat(bent[None], 300, axis=0)
    nodes[270] = flattened(hanging_arm, 0.0)
    with pytest.raises(TrussError, match=r"^pose 270: "):
        ELASTIC[what](model, nodes)


def test_a_factor_tells_as_the_eigenvalue_does_whether_a_matrix_is_above_a_bound(model, bent):
    pattern = pattern_of(model.truss)
    matrix = unfold(band_matrix(model, bent[None]).upper[0])
    least, _ = softest(matrix, pattern, 0.0)
    assert least > 1e-6
    for bound in (0.0, 1e-11, 0.999 * least):
        assert is_sound(matrix, pattern, bound)
    assert not is_sound(matrix, pattern, 1.001 * least)
    matrix[3, 7] = matrix[7, 3] = np.nan
    assert not is_sound(matrix, pattern, 0.0)


def test_nodes_that_are_no_numbers_are_refused(model, bent):
    nodes = bent.copy()
    nodes[7] = np.nan
    for attempt in (
        lambda: solve_members(model.loads, nodes),
        lambda: deflect(model, nodes),
        lambda: find_modes(model, nodes),
    ):
        with pytest.raises(TrussError, match="bars without a direction"):
            attempt()


def test_motion_without_mass_is_named(model, bent):
    part = model.loads.members
    loads = replace(
        model.loads,
        hub_mass=np.zeros_like(model.loads.hub_mass),
        members=replace(part, mass=0 * part.mass, centroidal=0 * part.centroidal),
    )
    with pytest.raises(
        TrussError, match=r"no mass moves with m1/.*: smallest scaled eigenvalue of the mass 0"
    ) as caught:
        find_modes(replace(model, loads=loads), bent)
    assert caught.value.members


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_verdict_hangs_neither_on_units_nor_on_axes(angle):
    """Two bars in line are a mechanism across their line, also where the line is along an axis and nothing resists at all."""
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    frame = make_framework("ABC", [("A", "C"), ("B", "C")], {"A": "xyz", "B": "xyz", "C": "y"})
    for raised in (0.0, 1e-17, 1e-12):
        nodes = np.array([[-1, 0, 0], [1, 0, 0], [0, 0, raised]]) @ turn.T
        for size in (1e-6, 1.0, 1e9):
            with pytest.raises(TrussError, match="1 mechanism"):
                deflect_framework(frame, nodes, np.full(2, size), np.zeros((3, 3)))
    nodes = np.array([[-1, 0, 0], [1, 0, 0], [0, 0, 1e-6]]) @ turn.T
    with pytest.warns(NearSingularWarning, match=r"near singular, smallest scaled eigenvalue 1(.1)?e-12"):
        deflect_framework(frame, nodes, np.ones(2), np.zeros((3, 3)))
