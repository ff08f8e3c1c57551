"""A riser beside the tank's axis: distances, their slopes, and the boxes and wedges about it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vgtsim.description import load_tank
from vgtsim.errors import DescriptionError
from vgtsim.geometry import enclosure_distance, make_profile
from vgtsim.geometry.clearance import find_mouth
from vgtsim.geometry.panels import enclose_tank
from vgtsim.geometry.side_mouth import find_rim
from vgtsim.geometry.solids import make_arm_riser, make_dome

CENTRE = load_tank("type_ii")
PROFILE = make_profile(CENTRE.shell)
CLOUD = 2e-4  # m: points 6 mm apart overrate a distance d by 6 mm² / (8 d), 1e-4 m at 5 cm
ROUNDING = 1e-9
SLOPE = 1e-6
BACK = 0.01  # m: what boxes and wedges may stand back, see `panels`


def beside(radius, azimuth):
    riser = CENTRE.arm_riser.model_copy(update={"radius": radius, "azimuth": azimuth})
    return CENTRE.model_copy(update={"arm_riser": riser})


TANK = beside(6.0, 2.0)
MOUTH = find_mouth(TANK, PROFILE)
BORE, X, Y = MOUTH[0], MOUTH[3], MOUTH[4]


def near_mouth(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform([X - 1.2, Y - 1.2, MOUTH[1] - 0.6], [X + 1.2, Y + 1.2, MOUTH[1] + 1.0], (count, 3))


def wall_points(spacing=6e-3):
    """The dome outside the bore and the bore above the dome, as points."""
    line = np.arange(-1.8, 1.8, spacing)
    x, y = (grid.ravel() for grid in np.meshgrid(X + line, Y + line))
    dome = np.stack([x, y, PROFILE.ceiling_at(np.hypot(x, y))], -1)[np.hypot(x - X, y - Y) >= BORE]
    turn, height = (
        grid.ravel() for grid in np.meshgrid(np.arange(0, 2 * np.pi, spacing / BORE), np.arange(7.0, 10.5, spacing))
    )
    bore = np.stack([X + BORE * np.cos(turn), Y + BORE * np.sin(turn), height], -1)
    bore = bore[height >= PROFILE.ceiling_at(np.hypot(bore[:, 0], bore[:, 1]))]
    turn = np.linspace(0, 2 * np.pi, 2000)
    x, y = X + BORE * np.cos(turn), Y + BORE * np.sin(turn)
    return np.concatenate([dome, bore, np.stack([x, y, PROFILE.ceiling_at(np.hypot(x, y))], -1)])


def test_the_distance_is_that_of_the_nearest_of_many_points():
    points, wall = near_mouth(500, 1), wall_points()
    distance, _ = enclosure_distance(TANK, PROFILE, points)
    brute = cKDTree(wall).query(points)[0]
    ceiling = PROFILE.ceiling_at(np.hypot(points[:, 0], points[:, 1]))
    bored = np.hypot(points[:, 0] - X, points[:, 1] - Y) < BORE
    assert np.array_equal(distance > 0, (points[:, 2] < ceiling) | bored)
    # outside, the distance is exact where neither tank nor bore is near: elsewhere it is that of one of them
    sure = (distance > 0.05) & (brute < 0.7)
    assert sure.sum() > 100
    assert np.abs(distance[sure] - brute[sure]).max() < CLOUD


def test_slopes_are_those_of_differences():
    points = near_mouth(300, 2)
    _, inward = enclosure_distance(TANK, PROFILE, points)
    steps = 1e-6 * np.eye(3)
    change = np.stack(
        [
            enclosure_distance(TANK, PROFILE, points + s)[0] - enclosure_distance(TANK, PROFILE, points - s)[0]
            for s in steps
        ],
        -1,
    )
    wrong = np.abs(change / 2e-6 - inward).max(axis=1)
    assert (wrong > SLOPE).sum() <= 3  # where two places are equally near there is no slope
    assert np.abs(np.linalg.norm(inward, axis=1) - 1).max() < ROUNDING


def test_the_nearest_point_of_the_rim_is_that_of_many():
    turn = np.linspace(0, 2 * np.pi, 40001)
    x, y = X + BORE * np.cos(turn), Y + BORE * np.sin(turn)
    rim = np.stack([x, y, PROFILE.ceiling_at(np.hypot(x, y))], -1)
    foot = np.empty(3)
    for point in near_mouth(60, 3):
        assert find_rim(MOUTH, *point, foot) == pytest.approx(np.linalg.norm(rim - point, axis=1).min(), abs=1e-7)


def test_a_riser_that_comes_to_the_axis_is_one_on_it():
    points = np.random.default_rng(4).uniform([-1, -1, 8], [1, 1, 11], (400, 3))
    on, off = (enclosure_distance(beside(radius, 0.5), PROFILE, points)[0] for radius in (0.0, 1e-7))
    assert np.abs(on - off).max() < 1e-6


def test_turning_the_riser_turns_the_distances():
    points = near_mouth(200, 5)
    c, s = np.cos(1.1), np.sin(1.1)
    turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    there = enclosure_distance(beside(6.0, 2.0 + 1.1), PROFILE, turned)[0]
    assert np.abs(enclosure_distance(TANK, PROFILE, points)[0] - there).max() < ROUNDING


def test_no_box_or_wedge_comes_into_tank_or_bore():
    panels, wedges = enclose_tank(TANK, PROFILE)
    deep = []
    for panel in panels:
        grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 7)] * 3, indexing="ij"), -1).reshape(-1, 3)
        deep.append(enclosure_distance(TANK, PROFILE, panel.centre + (grid * panel.half) @ panel.axes.T)[0].max())
    for wedge in wedges:
        weight = np.random.default_rng(6).dirichlet(np.full(8, 0.3), 60)
        deep.append(enclosure_distance(TANK, PROFILE, weight @ wedge.corners)[0].max())
    assert max(deep) < ROUNDING


def test_an_opened_dome_has_a_hole_as_wide_as_the_riser():
    hole = BORE + TANK.arm_riser.wall
    for front in (False, True):
        away = np.hypot(*(make_dome(TANK, PROFILE, front).triangles_center[:, :2] - [X, Y]).T)
        assert away.min() > 0.9 * hole
    pipe = np.concatenate([make_arm_riser(TANK, PROFILE, front).vertices for front in (False, True)])
    assert np.hypot(*(pipe[:, :2] - [X, Y]).T).min() == pytest.approx(BORE)


def test_a_riser_at_the_edge_of_the_dome_is_refused():
    with pytest.raises(DescriptionError, match=r"riser_42in\.radius.*stands on the dome"):
        enclosure_distance(beside(11.2, 0.0), PROFILE, np.zeros(3))


def test_the_pipe_of_a_riser_stands_on_the_dome_not_its_bore_alone():
    """The dome ends where the haunch begins; half a wall beyond that is too far."""
    edge = PROFILE.pieces[-1].start[0] - BORE
    wall = TANK.arm_riser.wall
    with pytest.raises(DescriptionError, match=rf"at most {edge - wall:.4g} m"):
        enclosure_distance(beside(edge - wall / 2, 0.0), PROFILE, np.zeros(3))
    enclosure_distance(beside(edge - 1.1 * wall, 0.0), PROFILE, np.zeros(3))
