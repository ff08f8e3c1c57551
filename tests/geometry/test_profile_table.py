"""The profile of a tank given by a table of heights and radii."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from pydantic import ValidationError

from vgtsim.description import load_tank
from vgtsim.description.tank import Shell
from vgtsim.errors import DescriptionError
from vgtsim.geometry import make_profile
from vgtsim.geometry.clearance import interior_distance
from vgtsim.geometry.panels import make_panels

REST = {"crown": 9.0, "dome_thickness": 0.3, "liner_thickness": 0.01, "soil_cover": 2.0}
ROWS = [[0, 0], ["1 m", "4 m"], [2, 6], [6, 6], [8, 4]]
ROUNDING = 1e-9


def a_shell(**changes):
    return Shell.model_validate({"profile": ROWS} | REST | changes)


def test_pieces_meet_with_one_tangent_and_end_at_the_crown():
    pieces = make_profile(a_shell()).pieces
    for before, after in pairwise(pieces):
        assert before.end == pytest.approx(after.start, abs=ROUNDING)
        assert before.heading + before.turn == pytest.approx(after.heading, abs=ROUNDING)
    assert pieces[-1].end == pytest.approx((0.0, 9.0), abs=ROUNDING)
    assert pieces[-1].heading + pieces[-1].turn == pytest.approx(pi)


def test_the_volume_is_that_of_cones_and_a_cap():
    rows = np.array([(0, 0), (1, 4), (2, 6), (6, 6), (8, 4)], float)
    (low, high), (near, out) = (rows[:-1, 0], rows[1:, 0]), (rows[:-1, 1], rows[1:, 1])
    cones = np.sum(pi / 3 * (high - low) * (near**2 + near * out + out**2))
    cap = pi * 1.0 / 6 * (3 * 4**2 + 1.0**2)
    # arcs of 1 mm at the corners leave less than a litre out
    assert make_profile(a_shell(knuckle_radius=1e-3, haunch_radius=1e-3)).volume() == pytest.approx(
        cones + cap, abs=1e-3
    )


def test_radius_floor_and_ceiling_are_those_of_the_rows():
    profile = make_profile(a_shell())
    assert profile.radius_at([0.5, 1.5, 4.0, 7.0]) == pytest.approx([2, 5, 6, 5])
    assert profile.floor_at([2.0, 5.0]) == pytest.approx([0.5, 1.5])
    assert profile.ceiling_at([5.0]) == pytest.approx([7.0])
    assert profile.inner_radius == 6.0


def test_a_fine_table_of_a_shipped_tank_is_nearly_that_tank():
    shell = load_tank("type_ii").shell
    whole = make_profile(shell)
    spring = whole.pieces[-1].start
    points = whole.points(0.05)
    points = points[points[:, 1] <= spring[1]]
    kept, heading = [points[0]], -1e-9
    for point, after in zip(points[1:], [*points[2:], spring], strict=True):
        if np.arctan2(*(after - point)[::-1]) > heading + 1e-6:  # rows in line say nothing
            kept.append(point)
            heading = np.arctan2(*(after - point)[::-1])
    upper = {key: getattr(shell, key) for key in REST}
    table = make_profile(
        Shell.model_validate(
            {"profile": [[z, r] for r, z in kept], "knuckle_radius": 0.1, "haunch_radius": 0.02} | upper
        )
    )
    inside = np.random.default_rng(1).uniform([-10, -10, 0.5], [10, 10, 8.5], (500, 3))
    ours, theirs = interior_distance(table, inside)[0], interior_distance(whole, inside)[0]
    assert (
        np.abs(ours - theirs).max() < 5e-3
    )  # chords of 5 cm of an arc of 0.5 m are 0.6 mm away; corners take more, and the upright wall ends 4 mm early
    assert np.all(ours < theirs + 1e-6)  # never roomier


def test_boxes_about_a_table_stay_outside_and_close():
    tank = load_tank("type_ii")
    tank = tank.model_copy(update={"shell": a_shell()})
    profile = make_profile(tank.shell)
    grid = np.array([[x, y, 1] for x in np.linspace(-1, 1, 5) for y in np.linspace(-1, 1, 5)])
    faces = [
        panel.centre + (grid * panel.half) @ panel.axes.T
        for panel in make_panels(tank, profile)
        if "riser" not in panel.name
    ]
    assert max(interior_distance(profile, face)[0].max() for face in faces) < ROUNDING
    curve = profile.points(0.2)
    curve = curve[curve[:, 0] > 0.6]
    panels = make_panels(tank, profile)
    for r, z in curve[::3]:
        point = np.array([r * np.cos(0.3), r * np.sin(0.3), z])
        away = min(np.abs(_outside(panel, point)).max() for panel in panels if np.linalg.norm(panel.centre - point) < 9)
        assert away < 0.012
    assert profile.crown == pytest.approx(9.0)


def _outside(panel, point):
    local = np.abs((point - panel.centre) @ panel.axes) - panel.half
    return np.maximum(local, 0)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"profile": [[0, 0], [1, 4], [4, 4]], "wall_top": 4.5}, "wall_top or a profile"),
        ({"profile": [[0, 1], [1, 4], [4, 4]]}, "lowest point on the axis"),
        ({"profile": [[0, 0], [2, 4], [2, 6], [6, 6]]}, "inward corners"),
        ({"profile": [[0, 0], [0, 4], [9.5, 4]]}, "below the crown"),
        ({"profile": [[0, 0], ["4 kg", 4], [8, 4]]}, "rows of a height"),
    ],
)
def test_a_table_that_is_no_tank_is_refused(changes, told):
    with pytest.raises(ValidationError, match=told):
        a_shell(**changes)


def test_arcs_that_do_not_fit_are_refused():
    with pytest.raises(DescriptionError, match=r"shell\.profile.*between rows \d and \d"):
        make_profile(a_shell(knuckle_radius=9.0, profile=[[0, 0], [0, 4], [2, 5], [6, 5.2]]))


def test_a_shell_read_back_is_the_same():
    shell = a_shell()
    assert Shell.model_validate(shell.model_dump(mode="json")) == shell
