from __future__ import annotations

import numpy as np
import pytest
from offset_arms import with_offset
from scenes_of_kinds import make_general_arm

from vgtsim.description import ToolPath, cut_arm, load_manipulator, load_tool_path
from vgtsim.errors import DescriptionError, FollowError, GoalError, ReachError
from vgtsim.geometry.stretches import find_nearest, make_stretches, spline
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.following import follow_path, follow_request, report
from vgtsim.planning.resolution import aim_tool
from vgtsim.positioning import MidStroke, Problem, bring_inside
from vgtsim.site import ArmAlone, load_site

pytestmark = pytest.mark.long

DIFFERENCES = 1.002  # differences over a step against derivatives
START, OVER, END = [6.0, -1.5, 1.5], [6.5, -1.0, 1.4], [7.0, -0.5, 0.9]


def make_path(**changes) -> ToolPath:
    plain = {
        "name": "test",
        "start": START,
        "direction": [0.3, 0.0, -1.0],
        "pieces": [
            {"shape": "spline", "through": [OVER, END], "direction": [0.0, 0.0, -2.0]},
            {"shape": "raster", "width": [0.0, 0.6, 0.0], "depth": ["-20 cm", 0.0, 0.0], "rows": 2},
        ],
    }
    return ToolPath.model_validate(plain | changes)


@pytest.fixture(scope="module")
def path():
    return make_path()


@pytest.fixture(scope="module")
def followed(hanging_arm, path):
    return follow_request(ArmAlone(hanging_arm), path, ("mid_stroke",))


def distance_to_segment(points, first, last):
    way = last - first
    part = np.clip((points - first) @ way / (way @ way), 0.0, 1.0)
    return np.linalg.norm(points - first - part[:, None] * way, axis=1)


def test_every_difference_stays_within_rates_and_accelerations(followed, path):
    step = followed.time[1]
    rates = np.abs(np.diff(followed.lengths, axis=0)) / step / followed.limits.rate
    accelerations = np.abs(np.diff(followed.lengths, n=2, axis=0)) / step**2
    assert rates.max() <= DIFFERENCES
    assert accelerations.max() <= path.acceleration * DIFFERENCES
    assert accelerations.max() > 0.9 * path.acceleration  # and the motion is not slower than it has to be


def test_tool_is_on_the_path_at_every_instant(hanging_arm, followed, path):
    tool, direction = hanging_arm.tool(followed.q)
    first = followed.stretch == 0
    curve = spline([START, OVER, END], 20_001)
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1).max()
    off = [np.linalg.norm(curve - point, axis=1).min() for point in tool[first][::10]]
    assert max(off) <= path.tolerance + steps
    corners = np.array(END) + np.array([[0, 0, 0], [0, 0.6, 0], [-0.2, 0.6, 0], [-0.2, 0, 0]])
    for k in range(3):
        mine = followed.stretch == k + 1
        assert distance_to_segment(tool[mine], corners[k], corners[k + 1]).max() <= path.tolerance
    np.testing.assert_allclose(direction[~first], np.tile([0, 0, -1], (np.sum(~first), 1)), atol=path.tolerance)
    np.testing.assert_allclose(tool[[0, -1]], [START, corners[3]], atol=1e-8)


def test_a_raster_goes_to_and_fro_over_a_parallelogram():
    piece = {"shape": "raster", "width": [1.0, 0.0, 0.0], "depth": [0.0, 2.0, 0.0], "rows": 3}
    stretches = make_stretches(make_path(start=[0.0, 0.0, 0.0], pieces=[piece]))
    ends = [stretch.points(2) for stretch in stretches]
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 2, 0], [1, 2, 0]]
    np.testing.assert_allclose([ends[0][0], *(end[1] for end in ends)], corners, atol=1e-12)
    np.testing.assert_allclose([end[0] for end in ends[1:]], corners[1:-1], atol=1e-12)


def test_arm_rests_where_stretches_meet(followed):
    changes = np.flatnonzero(np.diff(followed.stretch))
    assert len(changes) == len(followed.names) - 1
    for k in changes:
        assert np.abs(followed.lengths[k + 1] - followed.lengths[k]).max() < 1e-8


def test_reported_figures_are_those_of_the_lengths(hanging_arm, followed):
    facts = report(ArmAlone(hanging_arm), followed)
    tool = hanging_arm.tool(followed.q)[0]
    assert facts["length of the tool's way, m"] == pytest.approx(np.linalg.norm(np.diff(tool, axis=0), axis=1).sum())
    assert facts["duration, s"] == pytest.approx(0.01 * (len(followed.lengths) - 1))
    low, high = hanging_arm.stroke
    least = min((followed.lengths - low).min(), (high - followed.lengths).min())
    assert facts["least distance to the end of a stroke, m"] == pytest.approx(least)
    assert facts["goals that are local optima, %"] == 100


def test_tool_speed_is_kept_and_reached(hanging_arm, followed):
    line = {"shape": "line", "to": END}
    slow = follow_request(ArmAlone(hanging_arm), make_path(pieces=[line], speed="8 cm/s"), ("mid_stroke",))
    free, kept = (
        np.linalg.norm(np.diff(hanging_arm.tool(run.q)[0], axis=0), axis=1).max() / 0.01 for run in (followed, slow)
    )
    assert free > 0.1
    assert 0.079 < kept <= 0.08


def test_arcs_and_directions_turn_evenly():
    piece = {"shape": "arc", "centre": [0, 0, 0], "axis": [0, 0, 1], "angle": "90 deg", "direction": [0, 1, 0]}
    (stretch,) = make_stretches(make_path(start=[2.0, 0.0, 1.0], direction=[1, 0, 0], pieces=[piece]))
    third = np.radians([0, 30, 60, 90])
    wanted = np.stack([np.cos(third), np.sin(third), 0 * third], axis=1)
    np.testing.assert_allclose(stretch.points(4), 2 * wanted + [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(stretch.directions(4), wanted, atol=1e-12)


def test_a_path_that_goals_cannot_hold_is_given_up_with_its_figure(hanging_arm):
    """No spline of goals solved to 1e-9 keeps the tool to 1e-12."""
    with pytest.raises(FollowError, match=r"between 2049 goals .* allowed 1e-12") as caught:
        follow_request(ArmAlone(hanging_arm), make_path(tolerance=1e-12), ("mid_stroke",))
    assert caught.value.deviation < 1e-6


def test_a_goal_out_of_reach_is_named_by_its_place(hanging_arm):
    far = make_path(pieces=[{"shape": "line", "to": [40.0, 0.0, 0.0]}])
    with pytest.raises(ReachError, match=r"line 1 at \d+% of the way"):
        follow_request(ArmAlone(hanging_arm), far, ("mid_stroke",))


@pytest.mark.parametrize(
    ("pieces", "found"),
    [
        ([{"shape": "line", "to": END, "direction": [-0.3, 0, 1]}], "not opposite"),
        ([{"shape": "spline", "through": [START, END]}], "way-points that differ"),
    ],
)
def test_paths_that_are_none_are_refused(pieces, found):
    with pytest.raises(DescriptionError, match=found):
        make_stretches(make_path(pieces=pieces))


def test_file_errors_name_the_entry(tmp_path):
    file = tmp_path / "path.toml"
    file.write_text('name = "x"\nstart = [0, 0, 0]\ndirection = [0, 0, 1]\n[[pieces]]\nshape = "arc"\nangel = 1\n')
    with pytest.raises(DescriptionError, match=r"pieces\.0.*angel.*did you mean 'angle'"):
        load_tool_path(file)


@pytest.mark.parametrize("name", ["mixed", "arm30", "general", "offset"])
def test_arms_of_every_kind_follow_a_path(name):
    """The tool by direct kinematics, from the tip's nodes of the lengths alone, against a straight line and a held direction."""
    if name == "general":
        arm = make_general_arm()
    else:
        arm = with_offset(load_manipulator("arm15")) if name == "offset" else load_manipulator(name)
    place = ArmAlone(Chain(arm, hanging_mount(9.0)))
    chain, begin = place.chain, bring_inside(place.box, place.chain.straight)
    middle = chain.inputs_from_lengths(chain.lengths(begin) + 0.02 * np.sin(np.arange(chain.layout.actuators)))
    (first, along), way = chain.tool(middle), np.array([0.15, -0.1, 0.1])
    piece = {"shape": "spline", "through": [(first + way).tolist()], "direction": along.tolist()}
    line = ToolPath.model_validate(
        {"name": name, "start": first.tolist(), "direction": along.tolist(), "pieces": [piece]}
    )
    followed = follow_request(place, line, ("mid_stroke",))
    nodes = chain.nodes(chain.inputs_from_lengths(followed.lengths[::5]))
    corner = nodes[:, chain.truss.tip]
    normal = np.cross(corner[:, 0] - corner[:, 2], corner[:, 1] - corner[:, 2])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tool = corner.mean(axis=1) + arm.tip_plate.tool_offset * normal
    assert distance_to_segment(tool, first, first + way).max() <= line.tolerance
    assert np.linalg.norm(np.ptp(tool, axis=0)) > 0.9 * np.linalg.norm(way)
    assert np.linalg.norm(np.cross(normal, along), axis=1).max() <= line.tolerance
    rates = np.abs(np.diff(followed.lengths, axis=0)) / followed.time[1] / followed.limits.rate
    assert rates.max() <= DIFFERENCES


def test_a_coupled_scene_is_coupled_all_along_its_path():
    site = load_site("arm15_coupled")
    first, along = site.chain.tool(site.start)
    piece = {"shape": "spline", "through": [(first + [0.0, 0.2, 0.2]).tolist()], "direction": along.tolist()}
    line = ToolPath.model_validate(
        {"name": "c", "start": first.tolist(), "direction": along.tolist(), "pieces": [piece]}
    )
    followed = follow_request(site, line, ("mid_stroke",))
    assert site.subspace.find_errors(followed.q).max() < 1e-9
    assert np.ptp(followed.q, axis=0).max() > 0.005


def test_one_module_follows_points_while_its_tool_points_as_it_likes():
    chain = Chain(cut_arm(load_manipulator("arm9"), 4), hanging_mount(7.0))
    assert len(chain.layout.names) == 1
    rows = {"shape": "raster", "width": [0.3, 0.0, 0.0], "depth": [0.0, 0.2, 0.0], "rows": 2}
    path = make_path(start=[0.5, 0.1, 3.5], direction=[0.0, 0.0, -1.0], pieces=[rows])
    place = ArmAlone(chain)
    problem = Problem(place.box, aim_tool(path.start, None), MidStroke())
    run = follow_path(problem, path, place.start, place.timestep, place.subspace, free=True)
    tool, direction = chain.tool(run.q)
    nearest = find_nearest(make_stretches(path), tool)
    assert np.linalg.norm(tool - nearest[:, :3], axis=1).max() < path.tolerance
    assert np.arccos(direction @ [0.0, 0.0, -1.0]).max() > np.radians(5.0)  # it leans
    with pytest.raises(GoalError):  # three cylinders and five rows
        follow_path(problem, path, place.start, place.timestep, place.subspace)
