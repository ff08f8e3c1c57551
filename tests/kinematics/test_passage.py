from __future__ import annotations

import numpy as np
import pytest

from vgtsim.geometry import segment_distance
from vgtsim.kinematics import bend_all, find_axis, measure_passage, trace_line
from vgtsim.kinematics.inertia import member_radii

BENDS = np.radians([20.0, 30, -20, 35, 10]), [0.3, 0.2, 0.4, 0.3, 0.1]


def measure(chain, q, *, jointed=False):
    radii = member_radii(chain)
    return measure_passage(chain.truss, radii, chain.nodes(np.atleast_2d(q)), jointed=jointed)


def test_faces_are_those_of_the_frames(hanging_arm):
    q = bend_all(hanging_arm, *BENDS)
    R, P = hanging_arm.frames(q)
    axis = find_axis(hanging_arm.truss, hanging_arm.nodes(q[None]))
    assert axis.places[0] == pytest.approx(P, abs=1e-12)
    assert axis.normals[0] == pytest.approx(R[..., 2], abs=1e-12)


def test_a_straight_arm_leaves_the_circle_in_its_faces(hanging_arm):
    """Battens touch the circle of radius b / 2 sqrt(3) in a face; they are the nearest members where nothing bends."""
    free = measure(hanging_arm, hanging_arm.straight)[0]
    member = int(np.argmin(free))
    radius = member_radii(hanging_arm)[member]
    assert 0.3 < free[member] <= 2 * (hanging_arm.manipulator.face_side / (2 * np.sqrt(3)) - radius) + 1e-9
    assert np.isinf(find_axis(hanging_arm.truss, hanging_arm.nodes(hanging_arm.straight[None])).radius).all()


def test_a_bend_has_the_radius_of_its_arc(hanging_arm):
    angle = np.radians(30.0)
    q = bend_all(hanging_arm, [0.0, 0.0, angle, 0.0, 0.0], 0.3)
    axis = find_axis(hanging_arm.truss, hanging_arm.nodes(np.array([hanging_arm.straight, q])))
    place = [module.name for module in hanging_arm.manipulator.modules].index(hanging_arm.layout.names[2])
    P = hanging_arm.frames(q)[1]
    chord = np.linalg.norm(P[place + 1] - P[place])
    assert np.unravel_index(np.argmin(axis.radius), axis.radius.shape) == (1, place)
    assert axis.radius[1, place] == pytest.approx(chord / (2 * np.sin(angle / 2)), rel=1e-9)
    assert axis.angle[1, place] == pytest.approx(angle, abs=1e-12)
    assert axis.length[1, place] == pytest.approx(axis.radius[1, place] * angle, rel=1e-9)


def test_screws_meet_where_the_normals_of_both_faces_do(hanging_arm):
    q = bend_all(hanging_arm, *BENDS)
    axis = find_axis(hanging_arm.truss, hanging_arm.nodes(q[None]))
    joint = axis.make_corners(jointed=True)[0]
    for k in range(joint.shape[0]):
        for place, normal in zip(axis.places[0, k : k + 2], axis.normals[0, k : k + 2], strict=True):
            assert np.cross(joint[k] - place, normal) == pytest.approx(np.zeros(3), abs=1e-9)


@pytest.mark.parametrize("jointed", [False, True])
def test_the_passage_is_the_least_distance_of_all_members_from_the_line(hanging_arm, jointed):
    """No member is skipped that comes near: members far along the arm are held against nothing."""
    q, truss = bend_all(hanging_arm, *BENDS), hanging_arm.truss
    nodes, free = hanging_arm.nodes(q[None]), measure(hanging_arm, q, jointed=jointed)[0]
    axis = find_axis(truss, nodes)
    line = np.stack([axis.places[0, :-1], axis.make_corners(jointed=jointed)[0]], axis=1).reshape(-1, 3)
    line = np.append(line, axis.places[0, -1:], axis=0)
    ends = nodes[0][truss.ends]
    away = segment_distance(ends[:, None, 0], ends[:, None, 1], line[None, :-1], line[None, 1:])[0].min(axis=1)
    radii = member_radii(hanging_arm)
    assert free == pytest.approx(2 * (away - radii), abs=1e-12)


def test_the_middle_of_a_hose_lies_on_its_arc(hanging_arm):
    """A cubic along both normals is the arc to within some millimetres."""
    axis = find_axis(hanging_arm.truss, hanging_arm.nodes(bend_all(hanging_arm, *BENDS)[None]))
    middle, P, n = axis.make_corners(jointed=False)[0], axis.places[0], axis.normals[0]
    span = np.linalg.norm(np.diff(P, axis=0), axis=1)[:, None]
    assert middle == pytest.approx((P[:-1] + P[1:]) / 2 + span * (n[:-1] - n[1:]) / 8, abs=0.01)


@pytest.mark.parametrize("jointed", [False, True])
def test_a_drawn_line_leaves_each_face_at_right_angles(hanging_arm, jointed):
    axis = find_axis(hanging_arm.truss, hanging_arm.nodes(bend_all(hanging_arm, *BENDS)[None]))
    count = 400
    points = trace_line(axis, count, jointed=jointed)[0]
    assert points[::count] == pytest.approx(axis.places[0], abs=1e-12)
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    after, before = steps[::count], steps[count - 1 :: count]
    assert np.sum(after * axis.normals[0, :-1], axis=1) == pytest.approx(1.0, abs=1e-3)
    assert np.sum(before * axis.normals[0, 1:], axis=1) == pytest.approx(1.0, abs=1e-3)
