from __future__ import annotations

import numpy as np
import pytest
import trimesh

from vgtsim.description.waste import Mound, Roughness
from vgtsim.geometry import make_bed, make_profile, obstacles
from vgtsim.geometry.surface import along_surface
from vgtsim.kinematics import bend_all
from vgtsim.positioning import Surroundings

LEVEL = 0.5


def uneven(tank, **changes):
    waste = tank.waste.model_copy(update={"level": LEVEL, **changes})
    return tank.model_copy(update={"waste": waste})


@pytest.fixture(scope="module")
def rough(type_ii):
    return uneven(type_ii, roughness=Roughness(seed=3, count=30, height=1.0, foot=2.0))


@pytest.fixture(scope="module")
def bed(rough):
    return make_bed(rough)


@pytest.fixture(scope="module")
def mesh(bed):
    """The same surface for another library."""
    count = len(bed.heights)
    corners = np.concatenate([bed.places, bed.heights[..., None]], axis=-1).reshape(-1, 3)
    first = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    a, b, c, d = first, first + count, first + count + 1, first + 1
    return trimesh.Trimesh(corners, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), process=False)


def test_level_waste_has_no_bed(type_ii):
    assert make_bed(type_ii) is None
    assert obstacles(type_ii).bed is None


def test_distances_are_those_of_a_mesh_library(bed, mesh):
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-9, 9, (40, 2)), rng.uniform(0.0, 3.0, (40, 1))], axis=1)
    found, _ = bed.distance(points)
    _, expected, _ = trimesh.proximity.closest_point_naive(mesh, points)
    assert np.allclose(np.abs(found), expected, atol=1e-9)
    height = np.array([bed.height_at(*point[:2]) for point in points])
    assert np.array_equal(found >= 0, points[:, 2] >= height)
    assert (found < 0).any()


def test_gradients_are_differences(bed):
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.uniform(-9, 9, (100, 2)), rng.uniform(0.0, 3.0, (100, 1))], axis=1)
    slope, step = bed.distance(points)[1], 1e-6
    moved = [bed.distance(points + step * axis)[0] - bed.distance(points - step * axis)[0] for axis in np.eye(3)]
    off = np.abs(np.stack(moved, axis=-1) / (2 * step) - slope).max(axis=1)
    assert np.mean(off < 1e-5) > 0.97  # the others stand where two places are equally near
    assert np.allclose(np.linalg.norm(slope, axis=1), 1)


def test_segments_are_as_near_as_their_points(bed):
    rng = np.random.default_rng(2)
    lead = np.empty(3)
    for _ in range(30):
        a, b = np.array([*rng.uniform(-8, 8, 2), rng.uniform(0.6, 2.0)]), rng.uniform(-0.7, 0.7, 3)
        least, at = along_surface(bed.heights, bed.ground, a, a + b, np.inf, lead)
        dense = bed.distance(a + np.linspace(0, 1, 600)[:, None] * b)[0]
        assert least == pytest.approx(dense.min(), abs=3e-3)
        assert bed.distance(a + at * b)[0] == pytest.approx(least, abs=1e-12)


def test_a_flat_bed_is_a_plane(type_ii):
    flat = make_bed(uneven(type_ii, mounds=(Mound(radius=9.0, azimuth=0.0, height=0.5, foot=1.0),)))
    distance, slope = flat.distance([[-4.0, 1.0, 1.7], [-4.0, 1.0, 0.2]])
    assert np.allclose(distance, [1.2, -0.3])
    assert np.allclose(slope, [0, 0, 1])


def test_the_volume_of_a_mound_is_that_in_closed_form(type_ii):
    height, foot = 0.8, 2.0
    bed = make_bed(uneven(type_ii, mounds=(Mound(radius=4.0, azimuth=1.0, height=height, foot=foot),)))
    volume = np.sum((bed.heights - LEVEL) * bed.areas)
    assert volume == pytest.approx(height * foot**2 * (np.pi / 2 - 2 / np.pi), rel=2e-3)  # 2 pi r cos²(pi r / 2 f)
    radius = make_profile(type_ii.shell).inner_radius
    assert bed.areas.sum() == pytest.approx(np.pi * radius**2, rel=1e-3)


def test_the_arm_is_kept_from_mounds_as_it_is_judged(hanging_arm, rough):
    around = Surroundings(hanging_arm, rough, 0.15, 0.4572)
    rng = np.random.default_rng(5)
    q = bend_all(hanging_arm, rng.uniform(0.2, 0.6, (40, 5)), rng.uniform(-3, 3, (40, 1)))
    distance, places = around.clearance(q)
    wet = [k for k, place in enumerate(places) if place == "waste"]
    assert wet
    rows = around.rows(q[wet], 1.0, slopes=False)
    least = np.full(len(wet), np.inf)
    np.minimum.at(least, rows.config, rows.gap)
    assert np.allclose(
        least, distance[wet], atol=5e-3
    )  # the solver's balls at nodes are as thick as the thickest member there


def test_slopes_of_the_gaps_are_differences(hanging_arm, rough):
    around = Surroundings(hanging_arm, rough, 0.15, 0.4572)
    q = bend_all(hanging_arm, np.radians([25.0, 25, 30, 20, 10]), 0.4)
    rows, step = around.rows(q[None], 2.0), 1e-6
    ahead = around.rows((q + step * np.eye(15)), 2.5, slopes=False)
    count = np.bincount(ahead.config)
    same = around.rows(q[None], 2.5)
    assert np.all(count == len(same.gap))
    moved = (ahead.gap.reshape(15, -1) - same.gap).T / step
    off = np.abs(moved - same.gradient).max(axis=1)
    assert np.mean(off < 1e-3) > 0.95
    assert len(rows.gap)
