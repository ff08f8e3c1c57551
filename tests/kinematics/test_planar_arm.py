"""The arm in a plane against the whole arm's frames, nodes and differences."""

from __future__ import annotations

import numpy as np
import pytest

import vgtsim
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.planar_arm import PlanarArm, axis_of

STEP = 1e-6


@pytest.fixture(scope="module", params=["arm9", "arm15", "arm30"])
def planar(request):
    return PlanarArm(vgtsim.load_arm(request.param, 7.0), -1.1)


@pytest.fixture(scope="module")
def shape(planar):
    rng = np.random.default_rng(3)
    size = (5, len(planar.stowed))
    return rng.uniform(-0.2, 0.3, size), planar.stowed - rng.uniform(0.0, 0.1, size)


def test_line_goes_through_the_faces_of_the_arm(planar, shape):
    points, _ = planar.line(*shape, np.full(5, 7.0))
    q = planar.inputs(*shape)
    axis = axis_of(planar.chain, planar.chain.nodes(q))
    np.testing.assert_allclose(planar.place(points[:, 1:-1]), axis[:, :-1], atol=1e-12)
    np.testing.assert_allclose(planar.place(points[:, -1]), planar.chain.tool(q)[0], atol=1e-12)


def test_axis_is_that_of_the_frames(planar, shape):
    q = planar.inputs(*shape)
    np.testing.assert_allclose(axis_of(planar.chain, planar.chain.nodes(q)), planar.chain.frames(q)[1], atol=1e-12)


def test_slopes_are_those_of_differences(planar, shape):
    bend, reach = shape
    top, count = np.full(5, 7.0), len(planar.stowed)
    J, S = planar.line(bend, reach, top, slopes=True)[1], planar.input_slopes(bend, reach)
    for k in range(2 * count):
        by_bend, by_reach = np.split(STEP * np.eye(2 * count)[k], 2)
        ahead, behind = (bend + by_bend, reach + by_reach), (bend - by_bend, reach - by_reach)
        points = (planar.line(*ahead, top)[0] - planar.line(*behind, top)[0]) / (2 * STEP)
        np.testing.assert_allclose(J[..., k], points, atol=1e-8)
        np.testing.assert_allclose(S[..., k], (planar.inputs(*ahead) - planar.inputs(*behind)) / (2 * STEP), atol=1e-8)


def test_stowed_arm_is_that_of_the_chain(planar):
    chain = planar.chain
    q = planar.inputs(np.zeros((1, len(planar.stowed))), planar.stowed[None])[0]
    np.testing.assert_allclose(chain.nodes(q), chain.nodes(chain.stowed), atol=1e-12)
    assert chain.tool(chain.stowed)[0][2] == pytest.approx(7.0 - planar.stowed_length, abs=1e-12)


def test_arm_with_hinges_is_refused():
    with pytest.raises(DescriptionError, match="tetra4, which does not"):
        PlanarArm(vgtsim.load_arm("tetra4"), 0.0)
