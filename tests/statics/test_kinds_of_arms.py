"""Arms of every kind of module, by another program: member forces and displacements under their own weight and a load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from finite_elements import deflect_with_pynite, forces_with_pynite

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.statics import solve_members
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.stiffness import deflect, node_loads, tool_point

ROOT = Path(__file__).parents[2] / "models"
NAMES = ("tetra4", "stewart", "octahedron_double", "mixed")
FORCES = 1e-8  # of the largest: a stiffness solve loses digits in the displacements first
DISPLACEMENTS = 2e-3  # of the largest: that program's tip is bars 1e4 times as stiff as the members, not rigid
ROUNDING = 1e-9  # of the largest force
GRAVITY = 9.80665


@pytest.fixture(scope="module", params=NAMES)
def arm(request):
    """Elastic model and three seeded poses of an arm on a tilted mount, so that weight bends it every way."""
    mount = hanging_mount(5.0)
    turn = np.radians(50)
    mount[:3, :3] = mount[:3, :3] @ np.array(
        [[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]]
    )
    chain = Chain(load_manipulator(ROOT / request.param / f"{request.param}.toml"), mount)
    model = make_elastic_model(chain, Payload(mass=100.0, radius=0.1), GRAVITY)
    return model, chain.nodes(sample_inputs(chain, 3, seed=61, part=0.9))


@pytest.mark.long
def test_member_forces_agree_with_finite_elements(arm):
    model, poses = arm
    bars = solve_members(model.loads, poses).bar
    for nodes, bar in zip(poses, bars, strict=True):
        found = forces_with_pynite(model.truss, nodes, node_loads(model, nodes[None])[0])
        assert np.abs(bar).max() > 100.0
        assert np.abs(found - bar).max() < FORCES * np.abs(bar).max()


def test_displacements_agree_with_finite_elements(arm):
    model, poses = arm
    nodes, pull = poses[0], np.array([300.0, -200.0, -500.0])
    tool = tool_point(model.loads, nodes)
    found = deflect(model, nodes, tool_wrench=[*pull, 0.0, 0.0, 0.0])
    load = node_loads(model, nodes[None])[0]
    moved = deflect_with_pynite(model.truss, nodes, model.stiffness_at(nodes), load, tool, pull)
    assert np.abs(moved[:-1] - found.nodes).max() < DISPLACEMENTS * np.abs(moved).max()
    assert np.abs(moved[-1] - found.tool[:3]).max() < DISPLACEMENTS * np.abs(moved).max()


def test_stiffness_and_joints_agree(arm):
    model, poses = arm
    bar, joints = deflect(model, poses).bar, solve_members(model.loads, poses).bar
    assert np.abs(bar - joints).max() < ROUNDING * np.abs(joints).max()
