from __future__ import annotations

import numpy as np

from vgtsim.kinematics.planar_arm import PlanarArm
from vgtsim.planning.directrix import Leader, make_directrix


def test_points_are_as_far_from_the_path_as_they_were_put_aside(hanging_arm):
    """Points of the curve, moved in its plane along the normal and across the plane, by Pythagoras."""
    curve, azimuth = make_directrix(6.0, [(3.0, 0.3), (2.0, -0.2)]), 0.7
    planar = PlanarArm(hanging_arm, azimuth)
    mount = hanging_arm.mount
    level = mount[:3, :3] @ [np.cos(azimuth), np.sin(azimuth), 0.0]
    leader = Leader(curve, mount[:3, 3] * [1.0, 1.0, 0.0], level, 0.1, 0.1)
    points, heading = curve.at(np.linspace(-2.0, 6.0, 40))
    assert np.abs(leader.measure(planar.place(points))).max() < 1e-9
    normal = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    aside = planar.place(points + 0.03 * normal) + 0.04 * np.cross(level, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(leader.measure(aside), 0.05, atol=1e-9)
