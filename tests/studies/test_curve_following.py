from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.curve_following import follow_curve, spline
from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.positioning import make_box
from vgtsim.positioning.shape import fit

MODELS = Path(__file__).parents[2] / "models"
ROUNDING = 1e-12


def make_chain(name):
    return Chain(load_manipulator(MODELS / name / f"{name}.toml"), hanging_mount(7.3))


@pytest.fixture(scope="module")
def box(hanging_arm):
    return make_box(hanging_arm, 0.005)


def test_spline_goes_through_its_way_points():
    way = np.array([[0, 0, 0], [1, 0, 2], [2, 2, 3], [2, 4, 3.0]])
    curve = spline(way, [0, 0, 4], [0, 3, 0])
    u = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    np.testing.assert_allclose(curve.point(u / u[-1]), way, atol=ROUNDING)
    np.testing.assert_allclose(curve.tangent(np.array([0.0, 1.0])), [[0, 0, 4], [0, 3, 0]], atol=ROUNDING)
    with pytest.raises(ValueError, match="coincide"):
        spline(way[[0, 1, 1, 2]], [0, 0, 1], [0, 0, 1])


def test_arm_follows_a_spline(hanging_arm, box):
    base = hanging_arm.mount[:3, 3]
    way = base + np.array([[0, 0, 0], [0.6, 0.2, -4.0], [3.0, 0.5, -8.2], [6.8, 0.0, -10.5]])
    found = follow_curve(box, spline(way, [0, 0, -14], [12, 0, -6]), [12, 0, -6])
    assert found.met[0]


def test_an_octahedral_arm_follows_a_spline_with_its_twist():
    arm30 = make_chain("arm30")
    box, base = make_box(arm30, 0.005), arm30.mount[:3, 3]
    way = base + np.array([[0, 0, 0], [0.3, 0.1, -3.9], [1.7, 0.3, -7.6], [4.6, 0.4, -9.9]])
    curve = spline(way, [0, 0, -11.5], [9, 0, -7.0])
    for twist in (0.0, 0.3):
        found = follow_curve(box, curve, [9, 0, -7.0], twist=twist)
        assert found.met[0]
        assert np.min(box.spare(arm30.lengths(found.q[0]))) > 0
    turn = [arm30.frames(fit(arm30, curve, twist))[0][-1] for twist in (0.0, 0.3)]
    assert np.arccos((np.trace(turn[0].T @ turn[1]) - 1) / 2) == pytest.approx(0.3)
