"""The stiffness solve against the method of joints, finite elements, hand calculations and its own laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from finite_elements import deflect_with_pynite

from vgtsim.description.scene import Payload
from vgtsim.errors import TrussError
from vgtsim.mjcf import reach_pose
from vgtsim.statics import solve_members
from vgtsim.statics.elasticity import TRAPPED, make_elastic_model
from vgtsim.statics.stiffness import deflect, node_loads, settle, tip_compliance, tool_point

ROUNDING = 1e-9  # of the largest: the stiffness matrix has a condition number of 1e6
FINITE_ELEMENTS = 2e-3  # of the largest: that program's tip is bars 1e4 times as stiff as the members, not rigid
SECOND_ORDER = 5e-3  # of the sag: 0.2 m on 14 m


@pytest.fixture(scope="module")
def model(hanging_arm):
    return make_elastic_model(hanging_arm, Payload(mass=453.6, radius=0.15), 9.80665)


@pytest.fixture(scope="module")
def poses(hanging_arm):
    """Straight, bent to the horizontal, and five at random: nodes, shape (7, N, 3)."""
    rng = np.random.default_rng(31)
    q = np.repeat(hanging_arm.straight[None], 7, axis=0)
    q[1, :9:3] = np.sin(np.pi / 12)
    q[2:] += np.tile([0.2, 0.2, 0.02], 5) * rng.uniform(-1, 1, q[2:].shape)
    return hanging_arm.nodes(q)


def test_forces_are_the_method_of_joints(model, poses):
    """Two routes: by displacements, and by equilibrium alone."""
    bar, joints = deflect(model, poses).bar, solve_members(model.loads, poses).bar
    assert np.abs(bar - joints).max() < ROUNDING * np.abs(joints).max()


@pytest.mark.long
@pytest.mark.parametrize("index", [0, 1, 4])
@pytest.mark.parametrize("payload", [0.0, 453.6])
def test_displacements_agree_with_finite_elements(hanging_arm, poses, index, payload):
    light = make_elastic_model(hanging_arm, Payload(mass=payload, radius=0.15), 9.80665)
    empty = make_elastic_model(hanging_arm, Payload(mass=0.0, radius=0.15), 9.80665)
    nodes = poses[index]
    pull = np.array([0.0, 0.0, -payload * 9.80665])
    tool = tool_point(light.loads, nodes)
    moved = deflect_with_pynite(light.truss, nodes, light.stiffness_at(nodes), node_loads(empty, nodes), tool, pull)
    found = deflect(light, nodes)
    assert np.abs(moved[:-1] - found.nodes).max() < FINITE_ELEMENTS * np.abs(moved).max()
    assert np.abs(moved[-1] - found.tool[:3]).max() < FINITE_ELEMENTS * np.abs(moved).max()


@pytest.mark.parametrize(("payload", "sag"), [(453.6, 0.246), (0.0, 0.095)])
def test_sag_that_the_readme_tells_is_that_of_the_tool(hanging_arm, poses, payload, sag):
    """At the tool, not at the face's centroid, which sags a centimetre less."""
    loaded = make_elastic_model(hanging_arm, Payload(mass=payload, radius=0.15), 9.80665)
    rest = hanging_arm.nodes(reach_pose(hanging_arm))
    settled = settle(loaded, rest)
    before, after = (tool_point(loaded.loads, nodes) for nodes in (rest, settled))
    face = (settled - rest)[hanging_arm.truss.tip].mean(axis=0)
    assert np.linalg.norm(after - before) == pytest.approx(sag, abs=5e-4)
    assert np.linalg.norm(after - before) > np.linalg.norm(face) + 2e-3


def test_sag_of_the_readme_is_that_of_virtual_work(hanging_arm):
    """Forces by equilibrium alone, each over its k as EA / L and the oil give it by hand, against what a newton does there.

    For the great sag the unit load acts at the shape midway, where the change of a squared length is exactly the work of
    the chord; what a bar stretches is then (L1² - L0²) / 2 over its midway length.
    """
    arm, weights = hanging_arm.manipulator, [Payload(mass=mass, radius=0.15) for mass in (453.6, 453.6 + 1 / 9.80665)]
    loaded, heavier = (make_elastic_model(hanging_arm, weight, 9.80665) for weight in weights)
    rest = hanging_arm.nodes(reach_pose(hanging_arm))
    settled = settle(loaded, rest)
    ends = hanging_arm.truss.ends
    first, middle, last = (
        np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=1) for nodes in (rest, (rest + settled) / 2, settled)
    )
    unit = (
        solve_members(heavier.loads, (rest + settled) / 2).bar - solve_members(loaded.loads, (rest + settled) / 2).bar
    )
    stiffness = _stiffness_by_hand(arm, hanging_arm.truss, first)
    length = first + solve_members(loaded.loads, settled).bar / stiffness
    sag = np.sum(unit * (length**2 - first**2) / 2 / middle)
    before, after = (tool_point(loaded.loads, nodes) for nodes in (rest, settled))
    assert before[2] - after[2] == pytest.approx(sag, rel=1e-5)
    assert last == pytest.approx(length, abs=1e-9)


def _stiffness_by_hand(arm, truss, lengths):
    """EA / L of tubes; of a cylinder two oil columns beside the piston, in series with the rod; the tip's plate is rigid."""
    found = np.zeros(len(lengths))
    for i, member in enumerate(truss.members):
        if i in truss.actuated:
            part = arm.cylinders[member.section]
            bore, annulus = np.pi / 4 * part.bore**2, np.pi / 4 * (part.bore**2 - part.rod**2)
            out = lengths[i] - part.retracted
            oil = 1.4e9 * (bore / (out + TRAPPED) + annulus / (part.stroke - out + TRAPPED))
            found[i] = 1 / (1 / oil + part.rod_length / (200e9 * np.pi / 4 * part.rod**2))
        else:
            tube = arm.tubes[member.section]
            area = np.pi * (tube.outer_diameter - tube.wall) * tube.wall
            found[i] = 200e9 * area / lengths[i]
    return found


def test_compliance_is_symmetric_and_positive(model, poses):
    """Maxwell and Betti."""
    compliance = tip_compliance(model, poses)
    assert np.allclose(compliance, np.swapaxes(compliance, -1, -2), rtol=0, atol=1e-12 * np.abs(compliance).max())
    assert np.linalg.eigvalsh(compliance).min() > 0


def test_compliance_gives_the_response_to_a_wrench(model, poses):
    wrench = np.array([300.0, -200.0, 500.0, 40.0, 60.0, -20.0])
    tool = deflect(model, poses, tool_wrench=wrench, weight=False).tool
    expected = tip_compliance(model, poses) @ wrench
    assert np.abs(tool - expected).max() < ROUNDING * np.abs(expected).max()


def test_work_done_is_energy_stored(model, poses):
    """Clapeyron: half the loads times the displacements is the springs' energy."""
    response = deflect(model, poses)
    work = np.sum(node_loads(model, poses) * response.nodes, axis=(1, 2)) / 2
    stored = np.sum(response.bar**2 / model.stiffness_at(poses), axis=1) / 2
    assert work == pytest.approx(stored, rel=ROUNDING)


def test_hanging_module_stretches_by_the_hand_calculation(hanging_arm, model):
    """Straight and pulled at the tool by P, unit load method: P times the sum of n² / k."""
    pull, nodes = 1000.0, hanging_arm.nodes(hanging_arm.straight)
    unit = (
        solve_members(model.loads, nodes, nodal_forces=_share(model.truss, nodes, -1.0)).bar
        - solve_members(model.loads, nodes).bar
    )
    stretch = pull * np.sum(unit**2 / model.stiffness_at(nodes))
    assert deflect(model, nodes, tool_wrench=[0, 0, -pull, 0, 0, 0], weight=False).tool[2] == pytest.approx(
        -stretch, rel=1e-6
    )


def _share(truss, nodes, force):
    loads = np.zeros(nodes.shape)
    loads[truss.tip, 2] = force / 3
    return loads


def test_cylinder_is_the_hand_calculation(hanging_arm, model):
    """At half stroke: two oil columns beside the piston, in series with the rod."""
    part = hanging_arm.manipulator.cylinders[hanging_arm.manipulator.active[0].cylinder]
    bore, annulus = np.pi / 4 * part.bore**2, np.pi / 4 * (part.bore**2 - part.rod**2)
    column = 0.5 * 23 * 0.0254 + TRAPPED
    oil = 1.4e9 * (bore + annulus) / column
    rod = 200e9 * np.pi / 4 * part.rod**2 / part.rod_length
    first = model.truss.actuated[0]
    lengths = np.full(15, part.retracted + part.stroke / 2)
    assert model.stiffness(lengths)[first] == pytest.approx(1 / (1 / oil + 1 / rod), rel=1e-9)


def test_settled_arm_is_in_equilibrium_with_its_elongations(model, poses):
    """Hooke's law at the deformed pose, member forces from the method of joints alone."""
    settled = settle(model, poses)
    ends = model.truss.ends
    length = [np.linalg.norm(n[:, ends[:, 1]] - n[:, ends[:, 0]], axis=-1) for n in (settled, poses)]
    springs = model.stiffness_at(poses) * (length[0] - length[1])
    joints = solve_members(model.loads, settled).bar
    assert np.abs(springs - joints).max() < 1e-6 * np.abs(joints).max()


def test_linear_sag_is_the_settled_sag_to_second_order(model, poses):
    linear, settled = deflect(model, poses).nodes, settle(model, poses) - poses
    sag = np.linalg.norm(linear, axis=-1).max(axis=1)
    assert np.all(np.linalg.norm(linear - settled, axis=-1).max(axis=1) < np.maximum(SECOND_ORDER * sag, 0.05 * sag))


def test_batch_is_the_single_solve(model, poses):
    one, many = deflect(model, poses[3]), deflect(model, poses.reshape(7, 1, *poses.shape[1:]))
    assert one.bar == pytest.approx(many.bar[3, 0], abs=ROUNDING * np.abs(one.bar).max())
    assert one.nodes == pytest.approx(many.nodes[3, 0], abs=ROUNDING * np.abs(one.nodes).max())


def test_mechanism_is_named(model, hanging_arm):
    nodes = hanging_arm.nodes(hanging_arm.straight)
    flat = [model.truss.nodes.index(f"m1/mid/{i}") for i in (1, 2, 3)]
    nodes[flat, 2] = nodes[0, 2]
    with pytest.raises(TrussError, match="mechanism"):
        deflect(model, nodes)


@pytest.mark.parametrize("spoilt", ["tube", "modulus"])
def test_member_without_stiffness_is_named(hanging_arm, spoilt):
    arm = hanging_arm.manipulator
    if spoilt == "tube":
        name = arm.modules[0].longeron_tube
        tube = arm.tubes[name].model_copy(update={"wall": 0.0})
        arm = arm.model_copy(update={"tubes": arm.tubes | {name: tube}})
    else:
        wrong = {name: item.model_copy(update={"youngs_modulus": -2e11}) for name, item in arm.materials.items()}
        arm = arm.model_copy(update={"materials": wrong})
    with pytest.raises(TrussError, match=r"axial stiffness of -?[0-9.e+]+ N/m"):
        make_elastic_model(replace(hanging_arm, manipulator=arm), Payload(mass=1.0, radius=0.1), 9.81)
