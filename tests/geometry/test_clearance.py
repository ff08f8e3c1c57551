from dataclasses import FrozenInstanceError
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize

import vgtsim
from vgtsim.description import load_manipulator, load_tank
from vgtsim.description.waste import Roughness
from vgtsim.geometry.clearance import (
    arm_clearance,
    enclosure_distance,
    interior_distance,
    nearest_pair,
    obstacles,
    segment_distance,
)
from vgtsim.geometry.gaps import WASTE
from vgtsim.geometry.pairs import pair_members
from vgtsim.geometry.profile import make_profile
from vgtsim.kinematics import Chain, bend_all, hanging_mount
from vgtsim.positioning import Surroundings

ROOT = Path(__file__).parents[2]
TANK = load_tank(ROOT / "scenes/tanks/type_ii.toml")
PROFILE = make_profile(TANK.shell)
AROUND = obstacles(TANK)
ARM = load_manipulator(ROOT / "models/arm15/arm15.toml")
BORE = TANK.arm_riser.bore / 2

CLOUD_SPACING = 1e-3  # m, between the points of the second route
CLOUD = 1e-5  # m; a cloud of that spacing overrates a distance d by spacing² / (8 d), 2.5e-6 m at 0.05 m
ROUNDING = 1e-9  # m
SLOPE = 1e-6  # central differences with steps of 1e-5 m: 1e-10 in truncation, 1e-10 in rounding
SEARCH = 1e-5  # m; the place known within 0.7 mm, 0.02 m away from the rim
MEMBER_SEARCH = 1e-4  # m; the second route looks every 2 mm, which at 0.01 m from the rim overrates by 5e-5 m


def tank_points(count, seed):
    """Points in and around the tank, most of them near its surface."""
    rng = np.random.default_rng(seed)
    anywhere = rng.uniform([-13, -13, -1], [13, 13, 11], (count, 3))
    curve = PROFILE.points(0.05)[rng.integers(0, 500, count)]
    turn = rng.uniform(0, 2 * np.pi, count)
    surface = np.stack([curve[:, 0] * np.cos(turn), curve[:, 0] * np.sin(turn), curve[:, 1]], -1)
    mouth = rng.uniform([-1, -1, 8], [1, 1, 12], (count, 3))
    return np.concatenate([anywhere, surface + rng.normal(0, 0.2, (count, 3)), mouth])


def cloud_distance(points, curve):
    rho = np.hypot(points[:, 0], points[:, 1])
    return np.array([np.hypot(curve[:, 0] - r, curve[:, 1] - z).min() for r, z in zip(rho, points[:, 2], strict=True)])


def is_inside(points):
    rho, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    return (z > 0) & (z < PROFILE.crown) & (rho < PROFILE.radius_at(z))


def test_interior_distance_is_that_of_the_nearest_of_many_points():
    points = tank_points(300, 1)
    distance, _ = interior_distance(PROFILE, points)
    far = np.abs(distance) > 0.05
    assert far.sum() > 500
    brute = cloud_distance(points[far], PROFILE.points(CLOUD_SPACING))
    assert np.abs(np.abs(distance[far]) - brute).max() < CLOUD
    assert np.array_equal(distance > 0, is_inside(points))


def test_enclosure_distance_is_that_of_the_nearest_of_many_points():
    points = tank_points(300, 2)
    rim = float(PROFILE.ceiling_at(BORE))
    shell = PROFILE.points(CLOUD_SPACING)
    heights = np.arange(rim, 16.0, CLOUD_SPACING)
    shell = shell[(shell[:, 0] >= BORE) | (shell[:, 1] < 5)]
    curve = np.concatenate([shell, np.stack([np.full(len(heights), BORE), heights], -1)])
    distance, _ = enclosure_distance(TANK, PROFILE, points)
    rho = np.hypot(points[:, 0], points[:, 1])
    assert np.array_equal(distance > 0, is_inside(points) | ((rho < BORE) & (points[:, 2] >= rim)))
    far = np.abs(distance) > 0.05
    brute = cloud_distance(points[far], curve)
    assert np.abs(np.abs(distance[far]) - brute).max() < CLOUD


def test_the_closed_tank_never_counts_more_room_than_the_open_one():
    points = tank_points(2000, 3)
    assert np.all(enclosure_distance(TANK, PROFILE, points)[0] >= interior_distance(PROFILE, points)[0] - ROUNDING)


@pytest.mark.parametrize("opened", [False, True])
def test_gradients_are_unit_vectors_and_agree_with_differences(opened):
    def distance(x):
        return enclosure_distance(TANK, PROFILE, x) if opened else interior_distance(PROFILE, x)

    points = tank_points(2000, 4)
    value, gradient = distance(points)
    assert np.allclose(np.linalg.norm(gradient, axis=-1), 1, atol=ROUNDING)
    step = 1e-5
    moves = step * np.eye(3)
    ahead, behind = distance(points[:, None] + moves), distance(points[:, None] - moves)
    slope = (ahead[0] - behind[0]) / (2 * step)
    # away from the ridges, where two nearest points change over and there is no gradient
    turn = np.linalg.norm(ahead[1] - behind[1], axis=-1).max(axis=-1)
    smooth = turn < 1e-3
    assert smooth.mean() > 0.95
    curved = step**2 / 0.05**2  # relative truncation at 0.05 m from the rim or from an arc's centre
    assert np.abs(slope - gradient)[smooth & (np.abs(value) > 0.05)].max() < SLOPE + curved


def test_distances_take_any_batch_and_the_axis():
    points = tank_points(4, 5).reshape(2, 2, 3, 3)
    distance, gradient = interior_distance(PROFILE, points)
    assert distance.shape == (2, 2, 3)
    assert gradient.shape == (2, 2, 3, 3)
    one, direction = enclosure_distance(TANK, PROFILE, [0.0, 0.0, 1.0])
    assert one == pytest.approx(1.0)
    assert direction.tolist() == [0, 0, 1]


def test_segment_distance_is_the_least_over_both_parameters():
    rng = np.random.default_rng(6)
    ends = rng.normal(size=(40, 4, 3))
    distance, s, t = segment_distance(*ends.swapaxes(0, 1))
    for (a0, a1, b0, b1), found in zip(ends, distance, strict=True):

        def square(x, a0=a0, a1=a1, b0=b0, b1=b1):
            return float(np.sum((a0 + x[0] * (a1 - a0) - b0 - x[1] * (b1 - b0)) ** 2))

        best = minimize(square, [0.5, 0.5], bounds=[(0, 1), (0, 1)], method="L-BFGS-B", options={"ftol": 1e-15})
        assert found == pytest.approx(np.sqrt(best.fun), abs=1e-6)  # the minimiser stops at a gradient of 1e-5
    a0, a1, b0, b1 = ends.swapaxes(0, 1)
    gap = a0 + s[:, None] * (a1 - a0) - b0 - t[:, None] * (b1 - b0)
    assert np.allclose(np.linalg.norm(gap, axis=-1), distance, atol=ROUNDING)
    assert s.min() >= 0
    assert t.max() <= 1


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ([[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]], 1.0),  # parallel, abreast
        ([[0, 0, 0], [1, 0, 0]], [[3, 1, 0], [2, 1, 0]], 2**0.5),  # parallel, apart, opposed
        ([[0, 0, 0], [1, 0, 0]], [[1.5, 0, 0], [4, 0, 0]], 0.5),  # in one line
        ([[0, 0, 0], [2, 0, 0]], [[1, 0, 0], [5, 0, 0]], 0.0),  # overlapping
        ([[0, 0, 0], [0, 0, 0]], [[1, -1, 0], [1, 1, 0]], 1.0),  # a point and a segment
        ([[1, -1, 0], [1, 1, 0]], [[0, 0, 0], [0, 0, 0]], 1.0),  # the other way round
        ([[1, 2, 3], [1, 2, 3]], [[1, 2, 5], [1, 2, 5]], 2.0),  # two points
        ([[-1, 0, 0], [1, 0, 0]], [[0, -1, 0.1], [0, 1, 0.1]], 0.1),  # crossing
        ([[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 1e-9]], 1.0),  # all but parallel
    ],
)
def test_segment_distance_holds_for_special_positions(a, b, expected):
    assert segment_distance(*a, *b)[0] == pytest.approx(expected, abs=ROUNDING)


def test_segment_distance_agrees_with_capsules_in_mujoco():
    rng = np.random.default_rng(7)
    ends = rng.normal(size=(30, 2, 2, 3))
    radius = 0.05
    for pair in ends:
        spec = mujoco.MjSpec()
        for segment in pair:
            geom = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=segment.ravel())
            geom.size = [radius, 0, 0]
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        theirs = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None)
        ours = segment_distance(*pair[0], *pair[1])[0] - 2 * radius
        if ours > 0:
            assert theirs == pytest.approx(ours, abs=1e-6)  # MuJoCo's distance iterations stop at 1e-6


def arm_configurations(count, pivot, seed, bend=0.2):
    chain = Chain(ARM, hanging_mount(pivot))
    rng = np.random.default_rng(seed)
    q = chain.straight + rng.uniform(-1, 1, (count, chain.layout.inputs)) * np.resize(
        [bend, bend, 0.02], chain.layout.inputs
    )
    return chain, chain.nodes(q)


@pytest.mark.long
@pytest.mark.parametrize(("pivot", "bend"), [(8.2, 0.2), (9.5, 0.1), (11.0, 0.05)])
def test_arm_clearance_is_the_least_over_points_along_all_members(pivot, bend):
    chain, nodes = arm_configurations(5, pivot, 8, bend)
    ends = chain.truss.ends
    radii = np.random.default_rng(9).uniform(0.02, 0.08, len(ends))
    hub, ball = 0.05, 0.3
    tool = nodes[:, -3:].mean(axis=1)
    result = arm_clearance(nodes, ends, radii, hub, TANK, PROFILE, AROUND, (tool, ball))
    assert result.places == ("shell", "riser", *AROUND.names, "waste")

    t = np.linspace(0, 1, 801)[:, None]
    a, b = nodes[:, ends[:, 0], None], nodes[:, ends[:, 1], None]
    along = a + t * (b - a)

    def least(distance):
        members = (distance(along).min(axis=-1) - radii).min(axis=-1)
        return np.minimum(np.minimum(members, (distance(nodes) - hub).min(axis=-1)), distance(tool) - ball)

    def to_axis(axis, x):
        height = np.clip(x[..., 2], axis[0, 2], axis[1, 2])
        return np.linalg.norm(x - np.stack([0 * height + axis[0, 0], 0 * height + axis[0, 1], height], -1), axis=-1)

    enclosure = least(lambda x: enclosure_distance(TANK, PROFILE, x)[0])
    assert np.allclose(result.distance[:, :2].min(axis=1), enclosure, atol=MEMBER_SEARCH)
    for k, (axis, radius) in enumerate(zip(AROUND.axes, AROUND.radii, strict=True)):
        expected = least(lambda x, axis=axis, radius=radius: to_axis(axis, x) - radius)
        assert np.allclose(result.distance[:, 2 + k], expected, atol=1e-4)  # 800 intervals of 2 mm, second order
    assert np.allclose(result.distance[:, -1], least(lambda x: x[..., 2] - AROUND.waste_level), atol=ROUNDING)
    assert np.array_equal(result.least, result.distance.min(axis=1))
    assert np.array_equal(result.nearest, result.distance.argmin(axis=1))


def test_arm_clearance_names_what_is_nearest():
    x, y = AROUND.axes[0, 0, :2]
    nodes = np.array([[0, 0, 8.0], [0, 0, 6.0], [x, y - 0.5, 4.0], [0.5, 0, 10.0]])
    ends = np.array([[0, 1], [1, 2]])
    result = arm_clearance(nodes, ends, [0.01, 0.01], 0.02, TANK, PROFILE, AROUND)
    by_name = dict(zip(result.places, zip(result.distance, result.body, strict=True), strict=True))
    assert result.distance.shape == (len(result.places),)
    assert by_name["riser"] == (pytest.approx(BORE - 0.5 - 0.02), 2 + 3)
    assert by_name[AROUND.names[0]] == (pytest.approx(0.5 - 0.02 - AROUND.radii[0]), 2 + 2)
    assert result.places[int(result.nearest)] == "riser"


def test_a_member_through_the_mouth_meets_the_rim():
    rim = float(PROFILE.ceiling_at(BORE))
    # from the middle of the bore above to far out below: nearest to the rim between its ends
    nodes = np.array([[0.0, 0.0, rim + 0.5], [1.0, 0.0, rim - 0.5]])
    result = arm_clearance(nodes, np.array([[0, 1]]), [0.01], 0.0, TANK, PROFILE, AROUND)
    direction = (nodes[1] - nodes[0]) / np.linalg.norm(nodes[1] - nodes[0])
    to_rim = np.array([BORE, 0, rim]) - nodes[0]
    above_line = to_rim[0] * direction[2] - to_rim[2] * direction[0]
    # the line passes below the rim, clear of it
    assert result.distance[1] == pytest.approx(abs(above_line) - 0.01, abs=SEARCH)
    assert result.body[1] == 0


def test_obstacles_hang_from_the_dome_or_end_where_described():
    for item, axis, radius in zip(TANK.equipment, AROUND.axes, AROUND.radii, strict=True):
        assert np.hypot(*axis[:, :2].T) == pytest.approx([item.radius] * 2)
        assert axis[0, 2] == item.bottom
        assert interior_distance(PROFILE, axis[1])[0] == pytest.approx(
            0 if item.top is None else axis[1, 2], abs=ROUNDING
        )
        assert radius == item.diameter / 2
    short = TANK.equipment[0].model_copy(update={"top": 3.0})
    assert obstacles(TANK.model_copy(update={"equipment": (short,)})).axes[0, 1, 2] == 3.0
    assert obstacles(TANK.model_copy(update={"equipment": ()})).axes.shape == (0, 2, 3)


def test_self_clearance_is_the_least_over_all_pairs_of_distant_modules():
    chain = Chain(ARM, hanging_mount(8.0))
    rng = np.random.default_rng(10)
    q = chain.straight + rng.uniform(-1, 1, (70, chain.layout.inputs)) * np.resize(
        [0.05, 0.05, 0.02], chain.layout.inputs
    )
    q[:, ::3] += rng.uniform(0, 0.5, (70, 1))  # from straight to curled upon itself
    nodes = chain.nodes(q)
    truss = chain.truss
    radii = rng.uniform(0.02, 0.08, len(truss.ends))
    distance, pair = nearest_pair(pair_members(truss.ends, radii, truss.module, 2), nodes)
    first, second = np.nonzero(truss.module[None, :] - truss.module[:, None] >= 2)
    for k in range(0, 70, 7):
        a, b = nodes[k, truss.ends[:, 0]], nodes[k, truss.ends[:, 1]]
        gaps = segment_distance(a[first], b[first], a[second], b[second])[0] - radii[first] - radii[second]
        assert distance[k] == pytest.approx(gaps.min(), abs=ROUNDING)
        assert pair[k].tolist() == [first[gaps.argmin()], second[gaps.argmin()]]


def test_a_batch_gives_what_its_parts_give():
    chain, nodes = arm_configurations(70, 8.2, 12)
    truss = chain.truss
    nodes = nodes.reshape(7, 10, *nodes.shape[1:])
    whole = arm_clearance(nodes, truss.ends, 0.05, 0.06, TANK, PROFILE, AROUND)
    gap, pair = nearest_pair(pair_members(truss.ends, 0.05, truss.module, 2), nodes)
    assert whole.distance.shape == (7, 10, len(whole.places))
    assert gap.shape == (7, 10)
    for k in (0, 6):
        part = arm_clearance(nodes[k, 9], truss.ends, 0.05, 0.06, TANK, PROFILE, AROUND)
        assert np.array_equal(part.distance, whole.distance[k, 9])
        assert np.array_equal(part.body, whole.body[k, 9])
        one, members = nearest_pair(pair_members(truss.ends, 0.05, truss.module, 2), nodes[k, 9])
        assert one == pytest.approx(float(gap[k, 9]), abs=ROUNDING)
        assert np.array_equal(members, pair[k, 9])


def test_two_neighbouring_modules_have_no_self_clearance_to_measure():
    gap, pair = nearest_pair(pair_members(np.array([[0, 1], [1, 2]]), [0.1, 0.1], np.array([0, 1]), 2), np.eye(3))
    assert np.isinf(gap)
    assert pair.tolist() == [-1, -1]


def test_members_that_meet_in_a_hub_are_no_pair():
    """A hinge module keeps two hubs of the section before it in the section behind it."""
    truss = vgtsim.load_arm("tetra4").truss
    radii = np.full(len(truss.ends), 0.04)
    pairs = pair_members(truss.ends, radii, truss.module, 2)
    first, second = truss.ends[pairs.members[0]], truss.ends[pairs.members[1]]
    assert (first[:, :, None] != second[:, None, :]).all()
    apart = np.abs(truss.module[:, None] - truss.module) >= 2
    meet = (truss.ends[:, None, :, None] == truss.ends[None, :, None, :]).any(axis=(2, 3))
    assert (apart & meet).any()
    assert len(first) == pairs.begin[-1] == (apart & ~meet).sum() // 2


def test_obstacles_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        AROUND.axes[0, 0, 0] = 1.0
    with pytest.raises(FrozenInstanceError):
        AROUND.waste_level = 1.0


def test_the_least_of_a_batch_is_the_same_when_only_it_counts(hanging_arm, type_ii):
    """Over mounds, with poses in them and clear of them; each pose alone cannot profit from the ones before it."""
    rough = Roughness(seed=1, count=25, height=1.0, foot=2.5)
    waste = type_ii.waste.model_copy(update={"level": 0.5, "roughness": rough})
    around = Surroundings(hanging_arm, type_ii.model_copy(update={"waste": waste}), 0.15, 0.4572)
    rng = np.random.default_rng(0)
    q = bend_all(hanging_arm, rng.uniform(-0.1, 0.7, (40, 5)), rng.uniform(-3, 3, (40, 1)))
    q = q[hanging_arm.state(q).assembles]
    alone = [around.least(row) for row in q]
    for some in (slice(None), slice(None, None, -1)):
        distance, names = around.clearance(q[some], together=True)
        k = int(np.argmin(distance))
        assert (distance[k], names[k]) == min(alone)
    points = around.points(q)[:, 3:-1]
    bed, reach = around.obstacles.bed, 0.10
    assert bed is not None
    near = bed.distance(points)[0] - around.capsules.point_radii[3:-1] < reach
    rows = around.rows(q, reach, slopes=False)
    found = np.zeros((len(q), points.shape[1] + 4), bool)
    to_bed = rows.bodies[:, 0] == WASTE
    found[rows.config[to_bed], rows.bodies[to_bed, 1]] = True
    assert near.any()
    assert np.array_equal(found[:, 3:-1], near)  # distances sought without a bound tell the same points
