import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.double_octahedron import face_nodes
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import triangle_frame, triangle_nodes

ROUNDING = 1e-14  # m: a few units in the last place of a metre

sides = st.tuples(*[st.floats(0.5, 0.9)] * 3)


@given(sides)
def test_corners_have_the_given_sides_and_their_own_frame(s):
    nodes = triangle_nodes(s)
    assert np.allclose(np.linalg.norm(nodes[[1, 2, 0]] - nodes, axis=-1), s, atol=ROUNDING, rtol=0)
    R, P = triangle_frame(nodes)
    assert np.allclose(R, np.eye(3), atol=ROUNDING)
    assert np.allclose(P, 0, atol=ROUNDING)


def test_equilateral_triangle_is_the_symmetric_module_s_face():
    assert np.allclose(triangle_nodes((0.8, 0.8, 0.8)), face_nodes(0.8), atol=ROUNDING)


@pytest.mark.parametrize("s", [(1.0, 0.4, 0.5), (1.0, 0.5, 0.5), (-0.1, 0.5, 0.5), (np.nan, 1.0, 1.0)])
def test_sides_that_do_not_close_are_refused(s):
    with pytest.raises(AssemblyError, match="face triangle"):
        triangle_nodes(s)


def test_residual_is_the_excess_of_the_longest_side():
    with pytest.raises(AssemblyError) as caught:
        triangle_nodes([(0.8, 0.8, 0.8), (1.0, 0.4, 0.5)])
    assert caught.value.residual == pytest.approx(0.1)
