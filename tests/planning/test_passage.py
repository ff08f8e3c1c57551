from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vgtsim.description.scene import Conveyance
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import bend_all
from vgtsim.kinematics.inertia import member_radii
from vgtsim.planning.passage import check_passage, measure_passage
from vgtsim.site import Site


def test_a_straight_arm_leaves_the_circle_in_its_faces(hanging_arm):
    """Battens touch the circle of radius b / 2 sqrt(3) in a face; they are the nearest members where nothing bends."""
    passage = measure_passage(hanging_arm, hanging_arm.straight[None])
    side = hanging_arm.manipulator.face_side
    radii = member_radii(hanging_arm.manipulator, hanging_arm.truss)
    names = hanging_arm.truss.member_names
    assert passage.bore <= 2 * (side / (2 * np.sqrt(3)) - radii[names.index(passage.member)]) + 1e-9
    assert passage.bore > 0.3
    assert passage.radius == np.inf


def test_a_bend_has_the_radius_of_its_arc(hanging_arm):
    angle = np.radians(30.0)
    q = bend_all(hanging_arm, [0.0, 0.0, angle, 0.0, 0.0], 0.3)
    passage = measure_passage(hanging_arm, np.array([hanging_arm.straight, q]))
    P = hanging_arm.frames(q)[1]
    place = [module.name for module in hanging_arm.manipulator.modules].index(passage.module)
    chord = np.linalg.norm(P[place + 1] - P[place])
    assert passage.module == hanging_arm.layout.names[2]
    assert passage.radius == pytest.approx(chord / (2 * np.sin(angle / 2)), rel=1e-9)


def test_the_bore_is_that_of_points_along_axis_and_members(hanging_arm):
    q = bend_all(hanging_arm, np.radians([20.0, 30, -20, 35, 10]), [0.3, 0.2, 0.4, 0.3, 0.1])
    passage = measure_passage(hanging_arm, q[None])
    R, P = hanging_arm.frames(q)
    part, axis = np.linspace(0, 1, 60)[:, None], []
    for k in range(len(P) - 1):  # a cubic along both normals is the arc to within some millimetres
        span = np.linalg.norm(P[k + 1] - P[k])
        t = part
        axis.append(
            (2 * t**3 - 3 * t**2 + 1) * P[k]
            + (t**3 - 2 * t**2 + t) * span * R[k, :, 2]
            + (3 * t**2 - 2 * t**3) * P[k + 1]
            + (t**3 - t**2) * span * R[k + 1, :, 2]
        )
    nodes, truss = hanging_arm.nodes(q), hanging_arm.truss
    radii, line = member_radii(hanging_arm.manipulator, truss), np.concatenate(axis)
    least = np.inf
    for (a, b), radius in zip(truss.ends, radii, strict=True):
        points = nodes[a] + part * (nodes[b] - nodes[a])
        least = min(least, np.linalg.norm(points[:, None] - line, axis=-1).min() - radius)
    assert passage.bore == pytest.approx(2 * least, abs=0.04)


@pytest.mark.parametrize(
    ("line", "key"),
    [(Conveyance(diameter=0.6), "conveyance.diameter"), (Conveyance(diameter=0.1, bend_radius=5.0), "bend_radius")],
)
def test_a_line_that_does_not_fit_is_refused_with_figures(reach_scene, line, key):
    site = Site(replace(reach_scene, task=reach_scene.task.model_copy(update={"conveyance": line})))
    with pytest.raises(DescriptionError, match=key):
        check_passage(site, site.start[None])


def test_a_hose_of_four_inches_fits(reach_scene):
    hose = Conveyance(diameter=0.13, bend_radius=0.5)
    site = Site(replace(reach_scene, task=reach_scene.task.model_copy(update={"conveyance": hose})))
    check_passage(site, site.start[None])
