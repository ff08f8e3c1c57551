"""Waste that is cut: volume is neither lost nor made, and nothing goes that the tool does not reach."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from digging import TOOL, over_waste

from vgtsim.description import Patch
from vgtsim.geometry import enclosure_distance, make_bed, make_diggings, make_profile
from vgtsim.mjcf import build_model, lower_waste, names
from vgtsim.site import Site

ROUNDING = 1e-12  # m³: of some hundred heights of a metre
SINGLE = 1e-6  # m: MuJoCo has heights in single precision


@pytest.fixture(scope="module")
def tank(type_ii):
    waste = type_ii.waste.model_copy(update={"level": 0.6, "grid": 0.1, "strength": 1e6})
    return type_ii.model_copy(update={"waste": waste})


@pytest.fixture(scope="module")
def ground(tank):
    patch = Patch(name="here", corner=(-5.0, 1.0), along=(0.6, 0.2), across=(-0.1, 0.5))
    return make_diggings(make_bed(tank), make_profile(tank.shell), TOOL, TOOL.rate_in(tank.waste), [patch])


def integrate(ground, heights):
    """Volume under the triangles of a window of a bed down to z = 0, triangle by triangle."""
    corners = np.concatenate([ground.places, heights[:, None]], axis=-1).reshape(*ground.shape, 3)
    a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    total = 0.0
    for p, q, r in ((a, b, c), (a, c, d)):
        area = np.cross((q - p)[..., :2], (r - p)[..., :2]) / 2
        total += np.sum(area * (p + q + r)[..., 2] / 3)
    return total


@pytest.mark.parametrize("seed", range(20))
def test_volume_is_neither_lost_nor_made(ground, seed):
    low, high = [-5.0, 1.1, 0.6, 0.0], [-4.5, 1.6, 1.3, 0.05]  # over the patch
    digs = np.random.default_rng(seed).uniform(low, high, (8, 4))
    heights, taken = ground.start.copy(), 0.0
    for x, y, z, volume in digs:
        before = heights.copy()
        gone = ground.dig(heights, [x, y, z], volume)
        assert gone <= volume + ROUNDING
        assert np.all(heights <= before)
        fell = before != heights
        assert np.all(heights[fell] >= max(z - TOOL.reach, 0) - 1e-12)
        assert np.all(np.hypot(*(ground.places[fell] - [x, y]).T) < (TOOL.width + ground.bed.spacing) / 2)
        taken += gone
    assert np.all(heights >= ground.floor - 1e-12)
    assert taken == pytest.approx(float(ground.removed(heights)), abs=ROUNDING)
    assert taken == pytest.approx(integrate(ground, ground.start) - integrate(ground, heights), abs=1e-9)


def test_layer_is_as_thick_as_the_volume_asks_for(ground):
    heights = ground.start.copy()
    gone = ground.dig(heights, [-4.8, 1.3, 0.9], 1e-3)
    assert gone == pytest.approx(1e-3, rel=1e-12)
    under = ground.cover([-4.8, 1.3]) == 1
    layer = (ground.start - heights)[under]
    assert layer == pytest.approx(layer[0], abs=1e-15)
    assert layer[0] == pytest.approx(1e-3 / (np.pi * TOOL.width**2 / 4), rel=0.05)  # of a round spot on a grid


def test_tool_cuts_down_to_its_reach_and_no_deeper(ground):
    heights = ground.start.copy()
    gone = ground.dig(heights, [-4.8, 1.3, 0.95], 1.0)
    under = ground.cover([-4.8, 1.3]) > 0
    assert heights[under] == pytest.approx(0.5, abs=1e-15)
    assert gone == pytest.approx(0.1 * ground.areas[under].sum(), rel=1e-12)
    assert ground.dig(heights, [-4.8, 1.3, 0.95], 1.0) == 0


def test_nothing_is_cut_out_of_the_floor(ground):
    heights = ground.start.copy()
    ground.dig(heights, [-4.8, 1.3, 0.0], 10.0)
    under = ground.cover([-4.8, 1.3]) > 0
    assert heights[under] == pytest.approx(ground.floor[under])


def test_floor_is_on_the_tank(tank):
    profile = make_profile(tank.shell)
    r = np.linspace(0, profile.inner_radius, 50)
    points = np.stack([r, 0 * r, profile.floor_at(r)], axis=-1)
    assert np.abs(enclosure_distance(tank, profile, points)[0]).max() < 1e-9


def test_level_waste_on_a_grid_is_as_far_as_the_level(tank):
    bed = make_bed(tank)
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-8, 8, (50, 2)), rng.uniform(0, 5, (50, 1))], axis=1)
    assert bed.distance(points)[0] == pytest.approx(points[:, 2] - 0.6, abs=1e-12)


def test_mujoco_feels_the_waste_where_it_is_left(reach_scene):
    site = Site(over_waste(reach_scene))
    ground, model = site.diggings, build_model(site)
    heights = ground.start.copy()
    x, y = ground.places.mean(axis=0)
    ground.dig(heights, [x, y, heights[0] + 0.3], 5e-3)
    lower_waste(model, ground, heights)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bed, geom, seen = ground.cut_bed(heights), model.geom(names.WASTE).id, []
    rng = np.random.default_rng(2)
    for point in np.concatenate([rng.uniform(-0.3, 0.3, (20, 2)) + [x, y], rng.uniform(-6, 6, (20, 2))]):
        start = np.array([*point, heights.max() + 1.0])
        away = mujoco.mj_rayHfield(model, data, geom, start, np.array([0, 0, -1.0]), np.zeros(3))
        seen.append(start[2] - away)
        assert (
            seen[-1] == pytest.approx(bed.height_at(*point), abs=SINGLE) or abs(seen[-1] - bed.height_at(*point)) < 2e-3
        )  # across the other diagonal of a cell
    assert min(seen) < ground.start[0] - 1e-3
