"""The symmetric double octahedron: laws, derivatives, and node geometry as the second route."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies import double_octahedron as octa
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import circle_nodes
from vgtsim.kinematics.modules.mid_plane import normal

EXACT = 1e-12  # m and 1: rounding of a few dozen operations on numbers of order one
DIFFERENCE = 1e-7  # central differences with a step of 1e-6
SIDE = 0.79
GEOMETRIES = (octa.MirrorModule(SIDE, SIDE), octa.MirrorModule(SIDE, 0.9, 0.06))

tilts = st.floats(-0.25, 0.25)
midplanes = st.tuples(tilts, tilts, st.floats(0.45, 0.55)).map(np.array)
geometries = st.sampled_from(GEOMETRIES)


def assemble(geometry, g):
    """All nodes of the module: base, mid, primed mid and top, each (3, 3)."""
    base = octa.face_nodes(geometry.face_side)
    mid = octa.inner(geometry, g)[0][:3]
    R, P = octa.transform(geometry, g)
    return base, mid, mid + geometry.joint_offset * normal(g), base @ R.T + P


@given(geometries, midplanes)
def test_transform_is_a_rigid_motion(geometry, g):
    R, _ = octa.transform(geometry, g)
    assert np.allclose(R @ R.T, np.eye(3), atol=EXACT)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=EXACT)


@given(geometries, midplanes)
def test_every_longeron_keeps_its_length(geometry, g):
    base, mid, primed, top = assemble(geometry, g)
    lower = [(0, 0), (1, 1), (2, 2), (2, 0), (0, 1), (1, 2)]
    for face, middle in lower:
        assert np.linalg.norm(mid[middle] - base[face]) == pytest.approx(geometry.longeron, abs=EXACT)
        assert np.linalg.norm(primed[middle] - top[face]) == pytest.approx(geometry.longeron, abs=EXACT)


@given(geometries, midplanes)
def test_top_is_the_base_projected_through_the_midplane(geometry, g):
    """Equations 3.52 to 3.54, from the mid nodes rather than from the closed form."""
    base, mid, _, top = assemble(geometry, g)
    U = np.cross(mid[1] - mid[0], mid[2] - mid[0])
    U /= np.linalg.norm(U)
    d = (mid[0] - base) @ U
    assert np.allclose(top, base + (2 * d + geometry.joint_offset)[:, None] * U, atol=EXACT)


@given(geometries, midplanes)
def test_frame_T_sits_on_the_top_triangle(geometry, g):
    """Equations 3.47 to 3.50."""
    *_, top = assemble(geometry, g)
    R, P = octa.transform(geometry, g)
    x = (top[0] - top[2]) / np.linalg.norm(top[0] - top[2])
    z = np.cross(top[0] - top[2], top[1] - top[2])
    assert np.allclose(R[:, 0], x, atol=EXACT)
    assert np.allclose(R[:, 2], z / np.linalg.norm(z), atol=EXACT)
    assert np.allclose(P, top.mean(axis=0), atol=EXACT)


@given(geometries, midplanes)
def test_conventional_forward_undoes_lengths(geometry, g):
    assert np.allclose(octa.midplane_from_lengths(geometry, octa.lengths(geometry, g)), g, atol=1e-11)


@given(geometries, midplanes)
def test_canonical_forward_undoes_angles(geometry, g):
    assert np.allclose(octa.midplane_from_angles(geometry, octa.angles(geometry, g)), g, atol=EXACT)


@given(geometries, midplanes)
def test_inverse_position_undoes_forward(geometry, g):
    _, P = octa.transform(geometry, g)
    assert np.allclose(octa.inverse_position(geometry, P), g, atol=EXACT)


@given(geometries, midplanes)
def test_inverse_gimbal_undoes_forward(geometry, g):
    R, P = octa.transform(geometry, g)
    assert np.allclose(octa.inverse_gimbal(geometry, R[:, 2], np.linalg.norm(P)), g, atol=EXACT)


@given(geometries, midplanes)
def test_module_is_an_extensible_gimbal(geometry, g):
    """Origin of T lies along the bisector of the two face normals (figure 3.13): no roll, one extension."""
    R, P = octa.transform(geometry, g)
    bisector = R[:, 2] + [0, 0, 1]
    assert np.allclose(np.cross(P, bisector), 0, atol=EXACT)


@given(geometries, midplanes)
def test_derivatives_agree_with_differences(geometry, g):
    h = 1e-6
    angular, linear = octa.twist(geometry, g)
    R, _ = octa.transform(geometry, g)
    _, dl = octa.length_jacobian(geometry, g)
    dn = octa.inner(geometry, g)[1]
    for j, e in enumerate(np.eye(3) * h):
        (R1, P1), (R0, P0) = octa.transform(geometry, g + e), octa.transform(geometry, g - e)
        W = (R1 - R0) / (2 * h) @ R.T
        assert np.allclose([W[2, 1], W[0, 2], W[1, 0]], angular[:, j], atol=DIFFERENCE)
        assert np.allclose((P1 - P0) / (2 * h), linear[:, j], atol=DIFFERENCE)
        difference = (octa.lengths(geometry, g + e) - octa.lengths(geometry, g - e)) / (2 * h)
        assert np.allclose(difference, dl[:, j], atol=DIFFERENCE)
        n1, n0 = (octa.inner(geometry, g + s * e)[0] for s in (1, -1))
        assert np.allclose((n1 - n0) / (2 * h), dn[..., j], atol=DIFFERENCE)


@given(geometries, midplanes)
def test_mid_nodes_are_those_of_the_angles(geometry, g):
    """By trigonometry, which the engine does without."""
    (found,) = circle_nodes(geometry.geometry.circles, octa.angles(geometry, g))
    assert np.allclose(octa.inner(geometry, g)[0][:3], found, atol=EXACT)


def test_batches_agree_with_single_solutions():
    geometry, rng = GEOMETRIES[1], np.random.default_rng(1)
    g = np.column_stack([rng.uniform(-0.2, 0.2, (50, 2)), rng.uniform(0.45, 0.55, 50)])
    lengths = octa.lengths(geometry, g)
    assert np.allclose(lengths, [octa.lengths(geometry, row) for row in g], atol=EXACT)
    assert np.allclose(octa.midplane_from_lengths(geometry, lengths), g, atol=1e-11)


def test_stowed_module_is_1_633_sides_long():
    """Battens and longerons of one side: two regular octahedra, 2 sqrt(2/3) sides."""
    g = octa.midplane_from_lengths(octa.MirrorModule(1.0, 1.0), np.ones(3))
    assert 2 * g[2] == pytest.approx(2 * np.sqrt(2 / 3), abs=EXACT)


def test_lengths_that_do_not_close_are_refused_with_the_residual():
    with pytest.raises(AssemblyError) as caught:
        octa.midplane_from_lengths(GEOMETRIES[0], [0.5, 0.5, 1.2])
    assert caught.value.residual > 1e-3


def test_a_midplane_beyond_the_longerons_is_refused():
    with pytest.raises(AssemblyError, match="too far"):
        octa.angles(GEOMETRIES[0], [0.0, 0.0, 0.75])


def test_a_face_turned_right_round_is_refused():
    with pytest.raises(AssemblyError, match="turned back"):
        octa.inverse_gimbal(GEOMETRIES[0], [0.0, 0.0, -1.0], 1.0)
