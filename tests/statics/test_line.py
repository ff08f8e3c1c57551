"""The line of conveyance as a load: its weight on the faces, and the couples of a bent hose."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.description.conveyance import Conveyance
from vgtsim.description.scene import Payload
from vgtsim.kinematics import bend_all, find_axis
from vgtsim.statics import hose_forces, make_load_model, solve_members

NONE, STIFFNESS = Payload(mass=0.0, radius=0.1), 2000.0
LINE = Conveyance(diameter=0.13, bore=0.1, mass=4.0, contents=1300.0, bending_stiffness=STIFFNESS)
BENDS = np.radians([20.0, 30, -20, 35, 10]), [0.3, 0.2, 0.4, 0.3, 0.1]


def make(chain, line: Conveyance | None = LINE, gravity=9.80665):
    return make_load_model(chain, NONE, gravity, line=line)


def test_faces_carry_the_whole_line_but_the_half_span_beside_the_mast(hanging_arm):
    whole, none = make(hanging_arm), make(hanging_arm, None)
    P = hanging_arm.frames(hanging_arm.straight)[1]
    span = np.linalg.norm(np.diff(P, axis=0), axis=1)
    assert LINE.density == pytest.approx(4.0 + 1300 * np.pi / 4 * 0.1**2)
    assert whole.mass - none.mass == pytest.approx(LINE.density * (span.sum() - span[0] / 2))
    nodes = hanging_arm.nodes(hanging_arm.straight)
    lift = solve_members(whole, nodes).reaction[2] - solve_members(none, nodes).reaction[2]
    assert lift == pytest.approx(9.80665 * (whole.mass - none.mass), rel=1e-9)


def test_a_hose_pulls_at_two_faces_with_its_stiffness_over_its_radius(hanging_arm):
    """Forces on the nodes of both faces beside the only bend make up M = EI / R, and nothing else is loaded."""
    q = bend_all(hanging_arm, [0.0, 0.0, 0.5, 0.0, 0.0], 0.3)
    nodes, faces = hanging_arm.nodes(q), hanging_arm.truss.faces
    force = hose_forces(make(hanging_arm), nodes)
    axis = find_axis(hanging_arm.truss, nodes[None])
    place = int(np.argmax(axis.angle[0]))
    wanted = STIFFNESS / axis.radius[0, place]
    moments = [np.cross(nodes[face], force[face]).sum(axis=0) for face in faces]
    assert force[faces].sum(axis=1) == pytest.approx(np.zeros((len(faces), 3)), abs=1e-9)
    assert np.linalg.norm(moments, axis=1)[[place, place + 1]] == pytest.approx([wanted] * 2, rel=1e-9)
    others = np.delete(np.arange(len(faces)), [place, place + 1])
    assert np.array(moments)[others] == pytest.approx(np.zeros((len(others), 3)), abs=1e-6)
    normal = axis.normals[0, place + 1]
    turned = normal + 1e-6 * np.cross(moments[place + 1] / wanted, normal)
    assert turned @ axis.normals[0, place] > normal @ axis.normals[0, place]  # a hose straightens


def test_forces_of_a_hose_are_the_slope_of_its_energy(hanging_arm):
    """Power of the couples along a turn of the faces is that of the energy EI angle²/2 length, at arcs of a length."""
    q, step = bend_all(hanging_arm, *BENDS), 1e-6
    way = np.random.default_rng(5).normal(size=q.shape)
    there, here, back = (hanging_arm.nodes(q + side * step * way) for side in (1, 0, -1))
    axes = find_axis(hanging_arm.truss, np.stack([there, here, back]))
    change = (axes.angle[0] - axes.angle[2]) / (2 * step)
    wanted = -(STIFFNESS * axes.angle[1] / axes.length[1] * change).sum()
    force = hose_forces(make(hanging_arm), here)
    assert (force * (there - back)).sum() / (2 * step) == pytest.approx(wanted, rel=1e-6)


def test_a_batch_of_poses_is_each_of_them(hanging_arm):
    nodes = hanging_arm.nodes(np.array([hanging_arm.straight, bend_all(hanging_arm, *BENDS)]))
    both = hose_forces(make(hanging_arm), nodes)
    assert both[1] == pytest.approx(hose_forces(make(hanging_arm), nodes[1]), abs=1e-9)
    assert both[0] == pytest.approx(np.zeros(nodes[0].shape), abs=1e-5)
