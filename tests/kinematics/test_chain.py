"""Chains: shape of the arm, Jacobians, symmetry, and the conventional forward problem."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.errors import AssemblyError

EXACT = 1e-11  # m: rounding over a chain of ten modules
DIFFERENCE = 1e-7  # central differences with a step of 1e-6


@pytest.fixture(scope="module")
def inputs(hanging_arm):
    rng = np.random.default_rng(7)
    spread = [0.22, 0.22, 0.02]
    return hanging_arm.straight + rng.uniform(-1, 1, (4, 15)) * np.tile(spread, 5)


def test_straight_arm_is_45_feet_from_pivot_to_tool(hanging_arm):
    position, direction = hanging_arm.tool(hanging_arm.straight)
    assert hanging_arm.mount[2, 3] - position[2] == pytest.approx(45 * 0.3048, abs=1e-3)
    assert np.allclose(direction, [0, 0, -1])


def test_every_passive_member_keeps_its_length(hanging_arm, inputs):
    truss = hanging_arm.truss
    nodes = hanging_arm.nodes(inputs)
    length = np.linalg.norm(nodes[:, truss.ends[:, 1]] - nodes[:, truss.ends[:, 0]], axis=-1)
    passive = np.setdiff1d(np.arange(len(truss.members)), truss.actuated)
    assert np.ptp(length[:, passive], axis=0).max() < EXACT
    assert np.allclose(length[:, truss.actuated], hanging_arm.lengths(inputs), atol=EXACT)


def test_truss_is_isostatic(hanging_arm):
    """Members and plate edges against equations of the free nodes; 48 nodes, three of them fixed."""
    truss = hanging_arm.truss
    assert len(truss.nodes) == 48
    assert len(truss.members) + len(truss.tip_edges) == 3 * (len(truss.nodes) - 3)


def test_names_follow_the_dissertation(hanging_arm):
    truss = hanging_arm.truss
    by_name = {member.name: member for member in truss.members}
    ends = [truss.nodes[node] for node in by_name["m1/longeron/7"].ends]
    assert ends == ["m1/mid/2", "m1/top/1"]
    assert [truss.nodes[node] for node in by_name["m2/actuator/3"].ends] == ["m2/mid/3", "m2/mid/1"]
    assert len(by_name) == len(truss.members)


def test_shared_battens_stand_once(hanging_arm):
    pairs = [tuple(sorted(member.ends)) for member in hanging_arm.truss.members]
    assert len(set(pairs)) == len(pairs)


def test_conventional_forward_undoes_lengths(hanging_arm, inputs):
    assert np.allclose(hanging_arm.inputs_from_lengths(hanging_arm.lengths(inputs)), inputs, atol=EXACT)


def test_jacobians_agree_with_differences(hanging_arm, inputs):
    q, h = inputs[0], 1e-6
    J = hanging_arm.jacobian(q)
    nodes, dn = hanging_arm.node_jacobian(q)
    assert np.allclose(nodes, hanging_arm.nodes(q), atol=EXACT)
    for j, e in enumerate(np.eye(15) * h):
        (p1, d1), (p0, d0) = hanging_arm.tool(q + e), hanging_arm.tool(q - e)
        assert np.allclose((p1 - p0) / (2 * h), J[:3, j], atol=DIFFERENCE)
        assert np.allclose((d1 - d0) / (2 * h), np.cross(J[3:, j], hanging_arm.tool(q)[1]), atol=DIFFERENCE)
        difference = (hanging_arm.nodes(q + e) - hanging_arm.nodes(q - e)) / (2 * h)
        assert np.allclose(difference, dn[..., j], atol=DIFFERENCE)


def test_turning_every_bend_turns_the_whole_arm(hanging_arm, inputs):
    """A module's transform depends on its mid-plane alone, so the arm is symmetric about its base axis."""
    q, psi = inputs[1], 0.7
    c, s = np.cos(psi), np.sin(psi)
    turned = q.reshape(5, 3).copy()
    turned[:, :2] = turned[:, :2] @ np.array([[c, s], [-s, c]])
    R = hanging_arm.mount[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ hanging_arm.mount[:3, :3].T
    pivot = hanging_arm.mount[:3, 3]
    position, direction = hanging_arm.tool(q)
    expected = R @ (position - pivot) + pivot
    got = hanging_arm.tool(turned.ravel())
    assert np.allclose(got[0], expected, atol=EXACT)
    assert np.allclose(got[1], R @ direction, atol=EXACT)


def test_batch_agrees_with_single_configurations(hanging_arm, inputs):
    assert np.allclose(hanging_arm.nodes(inputs), [hanging_arm.nodes(q) for q in inputs], atol=EXACT)
    assert np.allclose(hanging_arm.jacobian(inputs), [hanging_arm.jacobian(q) for q in inputs], atol=EXACT)


def test_impossible_lengths_name_the_module(hanging_arm):
    lengths = hanging_arm.lengths(hanging_arm.straight)
    lengths[6:9] = [0.5, 0.5, 1.2]
    with pytest.raises(AssemblyError, match="m3"):
        hanging_arm.inputs_from_lengths(lengths)


def test_a_bend_too_far_names_the_module(hanging_arm):
    q = hanging_arm.straight.copy()
    q[11] = 0.8
    with pytest.raises(AssemblyError, match="m4"):
        hanging_arm.nodes(q)
