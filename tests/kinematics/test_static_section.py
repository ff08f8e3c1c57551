import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.measured_section import list_members, section_from_nodes
from vgtsim.errors import AssemblyError, TrussError
from vgtsim.kinematics.closure import triangle_frame
from vgtsim.kinematics.modules.static_section import StaticSection, make_section
from vgtsim.kinematics.roll_pitch_yaw import rotation

ROUNDING = 1e-12  # m: rounding of a few operations on metres
SIDES = (0.8, 0.8, 0.8)
scalene = st.tuples(*[st.floats(0.6, 0.9)] * 3)
section = st.builds(
    lambda base, top, length, roll, pitch, twist: make_section(base, length, top=top, tilt=(roll, pitch), twist=twist),
    scalene,
    scalene,
    st.floats(1.0, 3.0),
    *[st.floats(-0.3, 0.3)] * 2,
    st.floats(-0.8, 0.1),
)


def test_prism_has_the_members_of_the_arm_s_static_section():
    prism = make_section(SIDES, 1.7)
    roles = [member.role for member in list_members(prism)]
    assert roles == ["longeron"] * 3 + ["cross_longeron"] * 3 + ["batten"] * 3
    lengths = [member.length for member in list_members(prism)]
    assert np.allclose(lengths, [1.7] * 3 + [np.hypot(1.7, 0.8)] * 3 + [0.8] * 3)
    assert [member.ends for member in list_members(prism)[3:6]] == [(0, 4), (1, 5), (2, 3)]
    assert np.allclose(prism.R, np.eye(3))
    assert np.allclose(prism.P, [0, 0, 1.7])


@given(section)
def test_members_alone_fix_the_measured_nodes(made):
    """The section rebuilt from its nodes, moved elsewhere, is the same section."""
    R, P = rotation([0.4, -0.2, 1.1]), np.array([1.0, 2.0, -3.0])
    again, R_B, P_B = section_from_nodes(made.nodes @ R.T + P)
    assert np.allclose(R_B, R, atol=ROUNDING)
    assert np.allclose(P_B, P, atol=ROUNDING)
    assert np.allclose(again.R, made.R, atol=ROUNDING)
    assert np.allclose(again.P, made.P, atol=ROUNDING)
    assert np.allclose([m.length for m in list_members(again)], [m.length for m in list_members(made)], atol=ROUNDING)


@given(section)
def test_transform_is_the_top_face_s_frame(made):
    R, P = triangle_frame(made.nodes[3:])
    assert np.allclose(R, made.R, atol=ROUNDING)
    assert np.allclose(P, made.P, atol=ROUNDING)


def test_tapered_and_tilted_ends_are_what_was_asked():
    tapered = make_section(SIDES, 2.0, top=(0.6, 0.6, 0.6), tilt=(0.2, -0.1), twist=-0.3)
    assert [round(m.length, 12) for m in list_members(tapered)[6:]] == [0.6] * 3
    assert tapered.R[:, 2] == pytest.approx(rotation([0.2, -0.1, 0.0])[:, 2])
    assert tapered.nodes[:3, 2] == pytest.approx(0.0)


def test_measured_transform_is_kept():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation([0.1, 0.05, -0.4]), [0.1, -0.05, 1.5]
    made = StaticSection(SIDES, SIDES, T[:3, :3], T[:3, 3])
    assert np.array_equal(made.transform, T)
    assert np.array_equal(made.R, T[:3, :3])
    with pytest.raises(ValueError, match="read-only"):
        made.P[0] = 1.0
    T[0, 0] += 0.01
    with pytest.raises(AssemblyError, match="not a rotation"):
        StaticSection(SIDES, SIDES, T[:3, :3], T[:3, 3])


def test_section_whose_members_do_not_hold_it_is_refused():
    """A prism twisted by 30 degrees with its diagonals has an infinitesimal motion, whatever its length."""
    for length in (0.5, 1.7):
        with pytest.raises(TrussError, match="mechanism"):
            make_section(SIDES, length, twist=np.pi / 6)
