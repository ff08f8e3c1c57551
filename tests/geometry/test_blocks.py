"""Distances from convex solids, against MuJoCo's, trimesh's and differences."""

from itertools import product

import mujoco
import numpy as np
import pytest
import trimesh

from vgtsim.geometry.blocks import make_blocks, to_block
from vgtsim.geometry.clearance import Obstacles

MUJOCO = 2e-6  # m: what MuJoCo's search leaves of a distance
TRIMESH = 1e-8  # m: of a point's distance in double precision
SLOPE = 1e-6  # central differences with steps of 1e-6 m
STEP = 1e-6
RADIUS = 0.03


def a_hull(kind, seed=0):
    rng = np.random.default_rng(seed)
    if kind == "box":
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
        return np.array(list(product((-0.4, 0.4), (-0.25, 0.25), (-0.6, 0.6)))) @ turn.T
    return rng.normal(size=(14, 3)) * [0.4, 0.3, 0.5]


def some_segments(count, spread, seed=1):
    rng = np.random.default_rng(seed)
    middle, half = rng.normal(size=(count, 3)) * spread, rng.normal(size=(count, 3)) * 0.4
    return middle - half, middle + half


def distances(points, first, last, limit=np.inf):
    solid, slopes = make_blocks([(0, points)]), np.empty((len(first), 3))
    found = [to_block(solid, 0, a, b, limit, slope) for a, b, slope in zip(first, last, slopes, strict=True)]
    return np.array([item[0] for item in found]), np.array([item[1] for item in found]), slopes


def mujoco_distances(points, first, last):
    """Of capsules about the segments, as MuJoCo finds them for a convex mesh."""
    spec = mujoco.MjSpec()
    spec.add_mesh(name="hull", uservert=points.ravel())
    spec.worldbody.add_geom(name="hull", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull")
    for k, (a, b) in enumerate(zip(first, last, strict=True)):
        body = spec.worldbody.add_body(name=f"{k}")
        body.add_geom(
            name=f"{k}", type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*a, *b], size=[RADIUS, 0, 0], contype=0, mass=1
        )
    model = spec.compile()
    data, pair = mujoco.MjData(model), np.empty(6)
    mujoco.mj_kinematics(model, data)
    hull = model.geom("hull").id
    return np.array(
        [mujoco.mj_geomDistance(model, data, hull, model.geom(f"{k}").id, 10.0, pair) for k in range(len(first))]
    )


@pytest.mark.parametrize("kind", ["box", "hull"])
def test_a_capsule_is_as_far_from_a_solid_as_mujoco_says(kind):
    points = a_hull(kind)
    first, last = some_segments(200, 0.6)
    ours, theirs = distances(points, first, last)[0] - RADIUS, mujoco_distances(points, first, last)
    outside = theirs > -RADIUS
    assert outside.sum() > 50
    assert (~outside).sum() > 20
    assert np.abs(ours - theirs)[outside].max() < MUJOCO
    # inside, MuJoCo's depth is that of some way out; ours is the shortest
    assert np.all(ours[~outside] > theirs[~outside] - MUJOCO)
    assert np.median(np.abs(ours - theirs)[~outside]) < MUJOCO


def test_a_point_is_as_far_from_a_solid_as_trimesh_says():
    points = a_hull("hull", 3)
    places = np.random.default_rng(4).normal(size=(200, 3)) * 0.5
    ours = distances(points, places, places)[0]
    hull = trimesh.convex.convex_hull(points)
    beyond = np.einsum("pfi,fi->pf", places[:, None] - hull.triangles[:, 0], hull.face_normals).max(axis=1)
    theirs = np.copysign(trimesh.proximity.closest_point_naive(hull, places)[1], beyond)
    assert (ours < 0).sum() > 20
    assert np.abs(ours - theirs).max() < TRIMESH


def test_a_segment_moved_by_its_depth_along_the_slope_only_touches():
    points = a_hull("hull", 5)
    first, last = some_segments(200, 0.2, 6)
    depth, _, slope = distances(points, first, last)
    inside = depth < -1e-3
    assert inside.sum() > 50
    moved = -depth[inside, None] * slope[inside]
    assert np.abs(distances(points, first[inside] + moved, last[inside] + moved)[0]).max() < TRIMESH


@pytest.mark.parametrize("spread", [0.2, 1.0])
def test_slopes_are_those_of_differences(spread):
    points = a_hull("box", 7)
    first, last = some_segments(60, spread, 8)
    _, part, slope = distances(points, first, last)
    for axis in np.eye(3):
        for end, share in (("first", 1 - part), ("last", part)):
            move = STEP * axis
            ends = [(first + s * move, last) if end == "first" else (first, last + s * move) for s in (1, -1)]
            change = (distances(points, *ends[0])[0] - distances(points, *ends[1])[0]) / (2 * STEP)
            wrong = np.abs(change - share * (slope @ axis))
            assert (wrong > SLOPE).sum() <= 1  # a place where two ways are equal has no slope


def test_a_limit_changes_no_distance_below_it():
    points = a_hull("hull", 9)
    first, last = some_segments(200, 1.0, 10)
    free, held = distances(points, first, last)[0], distances(points, first, last, 0.3)[0]
    assert np.array_equal(free[free < 0.3], held[free < 0.3])
    assert np.all(held[free >= 0.3] >= 0.3)


def test_the_parts_of_one_thing_are_one_place():
    solids = make_blocks([(0, a_hull("box")), (1, a_hull("box") + 4), (0, a_hull("box") + [0, 0, 2])])
    around = Obstacles(("pillar", "one", "other"), np.array([[[9, 9, 0], [9, 9, 5]]]), np.ones(1), 0.0, None, solids)
    far = around.distances(np.array([0.0, 0, 3.5]), np.array([0.0, 0.1, 3.5]))
    alone = distances(a_hull("box") + [0, 0, 2], np.array([[0, 0, 3.5]]), np.array([[0, 0.1, 3.5]]))[0]
    assert far[1] == alone[0]
    assert far.shape == (3,)
