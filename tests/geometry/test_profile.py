from itertools import pairwise
from math import cos, hypot, pi, sin
from pathlib import Path

import numpy as np
import pytest
import trimesh

from vgtsim.description import load_tank
from vgtsim.description.tank import Shell
from vgtsim.geometry.profile import make_profile

TANK = load_tank(Path(__file__).parents[2] / "scenes/tanks/type_ii.toml")
PROFILE = make_profile(TANK.shell)

ROUNDING = 1e-10  # m and rad; positions of some ten metres in double precision, through a few operations
US_GALLON = 3.785411784e-3  # m³
NOMINAL = 530_000 * US_GALLON  # capacity of a type II tank, m³
OPERATING_DEPTH = 4.70  # m, tabulated for type II


def find_piece(profile, name):
    return next(piece for piece in profile.pieces if piece.name == name)


def random_shells(count):
    rng = np.random.default_rng(11)
    for _ in range(count):
        radius, knuckle = rng.uniform(5, 13), rng.uniform(0.1, 2)
        dish, haunch = rng.uniform(0, 1.5), rng.uniform(0.1, 1.5)
        wall_top = dish + knuckle + rng.uniform(0.5, 8)
        crown = wall_top + rng.uniform(haunch + 0.3, radius - 0.1)
        yield Shell(
            inner_diameter=2 * radius,
            dish_depth=dish,
            knuckle_radius=knuckle,
            wall_top=wall_top,
            haunch_radius=haunch,
            crown=crown,
            dome_thickness=0.4,
            liner_thickness=0.01,
            soil_cover=2,
        )


@pytest.mark.parametrize("shell", [TANK.shell, *random_shells(30)])
def test_pieces_join_with_a_common_tangent_from_axis_to_axis(shell):
    profile = make_profile(shell)
    for before, after in pairwise(profile.pieces):
        assert hypot(before.end[0] - after.start[0], before.end[1] - after.start[1]) < ROUNDING
        assert abs(before.heading + before.turn - after.heading) < ROUNDING
        assert before.length > 0
    first, last = profile.pieces[0], profile.pieces[-1]
    assert first.start == (0.0, 0.0)
    assert first.heading == 0
    assert abs(last.end[0]) < ROUNDING
    assert abs(last.end[1] - shell.crown) < ROUNDING
    assert abs(last.heading + last.turn - pi) < ROUNDING


@pytest.mark.parametrize("shell", [TANK.shell, *random_shells(30)])
def test_arcs_have_the_dimensions_described(shell):
    profile = make_profile(shell)
    radius = shell.inner_diameter / 2
    assert abs(find_piece(profile, "knuckle").radius - shell.knuckle_radius) < ROUNDING
    assert abs(find_piece(profile, "haunch").radius - shell.haunch_radius) < ROUNDING
    assert abs(find_piece(profile, "dish").end[1] - shell.dish_depth) < ROUNDING
    assert np.allclose(find_piece(profile, "wall").end, (radius, shell.wall_top), atol=ROUNDING, rtol=0)
    dome, haunch = find_piece(profile, "dome"), find_piece(profile, "haunch")
    # a circle that touches another from inside: the centres are the difference of the radii apart
    apart = hypot(dome.centre[0] - haunch.centre[0], dome.centre[1] - haunch.centre[1])
    assert abs(apart - (dome.radius - haunch.radius)) < ROUNDING
    assert abs(dome.centre[0]) < ROUNDING


def test_the_centre_is_equally_far_from_every_point_of_an_arc():
    for piece in PROFILE.pieces:
        if piece.turn:
            points = piece.at(np.linspace(0, piece.length, 7))
            assert np.allclose(np.linalg.norm(points - piece.centre, axis=-1), piece.radius, atol=ROUNDING, rtol=0)


def test_points_keep_the_spacing_and_contain_the_tangent_points():
    points = PROFILE.points(0.3)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 0.3 + ROUNDING
    assert points[0, 0] == points[-1, 0] == 0
    for piece in PROFILE.pieces:
        assert np.linalg.norm(points - piece.start, axis=1).min() < ROUNDING


@pytest.mark.parametrize("shell", [TANK.shell, *random_shells(10)])
def test_radius_and_ceiling_return_the_points_of_the_curve(shell):
    profile = make_profile(shell)
    half = 1e-7  # m; beside a vertical or level tangent a rounding of 1e-15 is squared-rooted
    for piece in profile.pieces:
        r, z = piece.at(np.linspace(0.02, 0.98, 9) * piece.length).T
        if z.max() > z.min():
            assert np.allclose(profile.radius_at(z), r, atol=half, rtol=0)
        if piece.name in ("haunch", "dome"):
            assert np.allclose(profile.ceiling_at(r), z, atol=half, rtol=0)


def test_volume_agrees_with_the_solid_of_revolution():
    sections = 180
    solid = trimesh.creation.revolve(PROFILE.points(0.05), sections=sections)
    # an inscribed polygon of n sides lacks 1 - sin(2 pi / n) / (2 pi / n) of its circle
    polygon = sin(2 * pi / sections) / (2 * pi / sections)
    assert solid.is_watertight
    # chords of 0.05 m along the arcs lack some 1e-5 more
    assert solid.volume == pytest.approx(PROFILE.volume() * polygon, rel=2e-5)


def test_volume_agrees_with_caps_and_cylinder_in_closed_form():
    shell = next(random_shells(1))
    profile = make_profile(shell)
    dish, wall = find_piece(profile, "dish"), find_piece(profile, "wall")
    cap = pi * shell.dish_depth**2 * (3 * dish.radius - shell.dish_depth) / 3
    assert profile.volume(shell.dish_depth) == pytest.approx(cap, rel=1e-9)
    low, high = wall.start[1] + 0.1, wall.end[1] - 0.1
    cylinder = pi * profile.inner_radius**2 * (high - low)
    assert profile.volume(high) - profile.volume(low) == pytest.approx(cylinder, rel=1e-9)
    assert profile.volume(-1.0) == 0


def test_the_nominal_capacity_lies_between_operating_depth_and_liner_top():
    assert 0.9 * NOMINAL < PROFILE.volume(OPERATING_DEPTH) < NOMINAL  # the dish takes 5 % of the flat-floored figure
    assert PROFILE.volume(TANK.shell.wall_top) > NOMINAL


def test_a_flat_floor_is_a_disc():
    profile = make_profile(TANK.shell.model_copy(update={"dish_depth": 0.0}))
    assert find_piece(profile, "dish").turn == 0
    assert find_piece(profile, "dish").at(np.array([0.0, 5.0])).tolist() == [[0.0, 0.0], [5.0, 0.0]]
    knuckle = find_piece(profile, "knuckle")
    assert knuckle.centre == pytest.approx((11.43 - TANK.shell.knuckle_radius, TANK.shell.knuckle_radius))
    assert cos(knuckle.heading) == 1
