"""The way in by other routes: dense distances, nodes of the whole arm, differences in time."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from scipy.spatial import cKDTree

import vgtsim
from studies.drawn_directrices import FOLLOWED, follow_drawn, least_of_sections
from vgtsim.description import Bend, Feed, cut_arm
from vgtsim.errors import AssemblyError, DescriptionError, PathError
from vgtsim.kinematics.planar_arm import PlanarArm, axis_of
from vgtsim.planning import insertion, smooth_shapes
from vgtsim.planning.checks import asked_spare, riser_fit
from vgtsim.planning.directrices import count_from, greatest_bend, propose_directrices
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.entry import Entry, check_entry, start_feed
from vgtsim.planning.insertion import BELOW, BORE, follow_directrix, make_guide, plan_insertion, time_way
from vgtsim.planning.postures import find_postures
from vgtsim.proximity import Proximity

HOIST = Feed(stroke=22.0, rate=0.3, acceleration=0.1, force=1e5)
AZIMUTH = np.radians(-170.0)
STOWED = 1e-5  # m: a spline through places 2.5 cm apart is felt a little before the opening
pytestmark = pytest.mark.long
CURVE = make_directrix(5.9, [(8.0, 1 / 4.6)])


def with_hoist(site, hoist=HOIST, **tank):
    task = site.task.model_copy(update={"mast": site.task.mast.model_copy(update={"feed": hoist})})
    return vgtsim.Site(replace(site.scene, task=task, tank=site.tank.model_copy(update=tank)))


@pytest.fixture(scope="module")
def small():
    """A nine-actuator arm in the type II tank."""
    return with_hoist(vgtsim.load("arm9_nullspace"))


@pytest.fixture(scope="module")
def way(small):
    return follow_directrix(small, CURVE, AZIMUTH, followed=FOLLOWED)


@pytest.fixture(scope="module")
def sampled(way):
    """Feeds and inputs between the places that were judged."""
    part = np.linspace(0.0, 1.0, 1201)
    return way.feed(part), way.spline(part)


def test_way_begins_above_the_riser_and_ends_at_the_working_depth(small, way):
    first, last = way.feed([0.0, 1.0])
    tool = small.chain.tool(way.ends[0])[0][2] + first
    flange = small.tank.grade + small.tank.arm_riser.above_grade
    assert tool - small.task.payload.radius == pytest.approx(flange + 0.1)
    assert last == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(way.ends[0], small.chain.stowed, atol=1e-9)


def test_modules_stay_stowed_until_they_are_below_the_rim(small, sampled):
    feed, q = sampled
    rim = small.surroundings.profile.rim(small.tank.arm_riser.bore / 2)
    axis = axis_of(small.chain, small.chain.nodes(q))
    stowed = small.chain.lengths(small.chain.stowed)
    off = np.abs(small.chain.lengths(q) - stowed).reshape(len(q), -1, 3).max(axis=2)
    for a, k in enumerate(small.chain.layout.modules):
        top = axis[:, k, 2] + feed
        assert off[top > rim - BELOW + 1e-9, a].max(initial=0.0) < STOWED
        assert off[-1, a] > 0.05


def test_deviation_is_that_of_nodes_from_dense_points_of_the_curve(small, way, sampled):
    feed, q = sampled
    nodes = small.chain.nodes(q) + np.stack([0 * feed, 0 * feed, feed], axis=-1)[:, None]
    tool = small.chain.tool(q)[0] + np.stack([0 * feed, 0 * feed, feed], axis=-1)
    axis = np.concatenate([axis_of(small.chain, nodes), tool[:, None]], axis=1)
    points = np.concatenate([(1 - t) * axis[:, :-1] + t * axis[:, 1:] for t in np.linspace(0, 1, 7)], axis=1)
    flat, _ = CURVE.at(np.linspace(-20.0, 12.0, 16001))
    dense = PlanarArm(small.chain, AZIMUTH).place(flat)
    assert cKDTree(dense).query(points.reshape(-1, 3))[0].max() == pytest.approx(way.deviation, abs=2e-3)
    assert least_of_sections(small, way) < way.bound <= way.deviation <= FOLLOWED * way.bound


def test_way_is_clear_by_the_distances_of_the_verification(small, way, sampled):
    feed, q = (item[::10] for item in sampled)
    lift = np.stack([0 * feed, 0 * feed, feed], axis=-1)
    nodes, tool, near = small.chain.nodes(q) + lift[:, None], small.chain.tool(q)[0] + lift, Proximity(small)
    around = near.around(nodes, tool)
    least = dict(zip(around.places, around.distance.min(axis=0), strict=True))
    assert min(gap for name, gap in least.items() if name != "riser") >= small.clearance
    assert least["waste"] == pytest.approx(way.gaps["waste"], abs=5e-3)
    assert near.among(nodes, tool)[0].min() == pytest.approx(way.gaps["the arm itself"], abs=5e-3)


def test_bore_is_kept_with_cylinders_by_their_shape(small, way):
    """Points all over the members: barrels from eye to mouth, rods beyond, hubs."""
    chain, truss, arm = small.chain, small.truss, small.arm
    part, bore = np.linspace(0, 1, 25)[:, None], small.tank.arm_riser.bore / 2
    rim = small.surroundings.profile.rim(bore)
    least = np.inf
    for place in np.linspace(0.0, 1.0, 30):
        nodes = chain.nodes(way.spline(place)) + [0.0, 0.0, float(way.feed(place))]
        for member in truss.members:
            a, b = nodes[list(member.ends)]
            if member.role == "actuator":
                tube = arm.cylinders[member.section]
                ends, thick = np.array([tube.eye, tube.barrel_length]) / np.linalg.norm(b - a), tube.barrel_diameter / 2
                points = a + (ends[0] + part * (ends[1] - ends[0])) * (b - a)
            else:
                points, thick = a + part * (b - a), arm.tubes[member.section].outer_diameter / 2
            inside = points[points[:, 2] >= rim]
            least = min(least, bore - np.hypot(inside[:, 0], inside[:, 1]).max(initial=0.0) - thick)
        above = nodes[nodes[:, 2] >= rim]
        least = min(least, bore - np.hypot(above[:, 0], above[:, 1]).max(initial=0.0) - arm.hub.radius)
    assert least >= BORE * asked_spare(small)
    assert way.bore.min() == pytest.approx(least, abs=1e-3)


def test_stowed_arm_in_the_bore_has_what_the_riser_leaves(small):
    planar = PlanarArm(small.chain, 0.0)
    feed = np.linspace(start_feed(small, planar), make_guide(small, CURVE, 0.0).opening.max(), 20)
    gaps = Entry(small).gaps(np.repeat(small.chain.stowed[None], 20, axis=0), feed)
    spare = riser_fit(small.chain, small.tank.arm_riser.bore).spare
    np.testing.assert_allclose(gaps.bore.min(axis=0)[1:], spare, atol=1e-6)


def test_bound_is_no_posture_beaten_by_chance(small, monkeypatch):
    """Random changes of the best posture at a feed leave the curve more, or overrun a stroke."""
    guide = make_guide(small, CURVE, AZIMUTH)
    monkeypatch.setattr("vgtsim.planning.postures._SPACING", 0.5)
    found = find_postures(guide)
    rng = np.random.default_rng(11)
    for w in (3, len(found.feed) // 2, -1):
        free = guide.opening > found.feed[w]
        bend = found.bend[w] + free * rng.normal(0, 0.02, (4000, len(free)))
        reach = found.extension[w] + free * rng.normal(0, 0.02, (4000, len(free)))
        state = guide.chain.state(guide.planar.inputs(bend, reach))
        kept = state.assembles & np.all((state.lengths >= guide.least) & (state.lengths <= guide.greatest), axis=1)
        off, _ = guide.axis(bend[kept], reach[kept], np.full(int(kept.sum()), found.feed[w]))
        assert kept.sum() > 20
        assert np.abs(off).max(axis=1).min() >= 0.995 * found.deviation[w]


def test_slope_of_the_sum_that_is_made_small_is_that_of_differences(small):
    """So far from the curve that the deviation counts most."""
    guide = make_guide(small, CURVE, AZIMUTH)
    track = smooth_shapes.Track(guide, 0.2, small.surroundings.unloaded, clearance=6.0, kept=0.2, mouth=20.0)
    half = track.basis[0].shape[2]
    weights = np.random.default_rng(5).normal(0.0, 0.05, 2 * half)
    slope = smooth_shapes.sum_up(track, weights, sloped=True).slope
    for ahead in np.random.default_rng(6).normal(0.0, 1.0, (4, 2 * half)):
        high, low = (smooth_shapes.sum_up(track, weights + step * ahead, sloped=False).value for step in (1e-6, -1e-6))
        assert (high - low) / 2e-6 == pytest.approx(slope @ ahead, rel=1e-4)


def test_hinges_slope_against_the_gradients_of_their_distances():
    rng = np.random.default_rng(7)
    short, leads, J, Q = (rng.normal(size=shape) for shape in ((3, 4, 2), (2, 3, 4, 3), (3, 4, 3, 6), (3, 6, 5)))
    slopes = np.zeros((3, 4, 2, 5))
    smooth_shapes.near_slopes(short, *leads, J, Q, slopes)
    wanted = -200.0 * np.einsum("cwpk,wpkn,wna->wpca", leads, J, Q)  # hinges count one at 5 mm
    np.testing.assert_allclose(slopes, np.where(short[..., None] > 0, wanted, 0.0), atol=1e-9)


def test_speeds_are_inside_the_ratings_by_differences(small, way):
    timed = time_way(small, way)
    step = 0.02
    feed, length = timed.mast(step)[0], small.chain.lengths(timed.inputs(step))
    step = timed.duration / (len(feed) - 1)
    rates = np.abs(np.diff(length, axis=0)) / step
    rated = small.task.motion.rate_fraction * min(tube.rate for tube in small.arm.cylinders.values())
    assert rates.max() <= rated * (1 + 1e-9)
    assert np.abs(np.diff(length, n=2, axis=0)).max() / step**2 <= small.task.motion.acceleration * 1.01
    assert np.abs(np.diff(feed)).max() / step <= HOIST.rate * (1 + 1e-9)
    assert np.abs(np.diff(feed, n=2)).max() / step**2 <= HOIST.acceleration * 1.01
    assert np.abs(np.diff(feed)[[0, -1]]).max() / step < 1e-3
    assert timed.duration < 2.2 * max(rates.sum(axis=0).max() * step / rated, abs(feed[0] - feed[-1]) / HOIST.rate)


def test_way_out_is_the_way_in_backwards(way):
    out = way.reverse()
    part = np.linspace(0.0, 1.0, 57)
    np.testing.assert_allclose(out.spline(part), way.spline(1 - part), atol=1e-12)
    np.testing.assert_allclose(out.feed(part), way.feed(1 - part), atol=1e-12)


def test_greatest_bend_is_that_of_the_strokes(small):
    planar = PlanarArm(small.chain, AZIMUTH)
    box = small.box
    most = greatest_bend(planar, box.least, box.greatest)
    assert np.radians(40) < most < np.radians(60)


def test_curve_too_tight_is_refused_with_the_reason(small):
    with pytest.raises(PathError, match=r"leaves the directrix|overruns a stroke|uses a member"):
        follow_directrix(small, make_directrix(5.9, [(4.0, 1 / 1.2)]), AZIMUTH, followed=1.0)


def test_same_site_gives_the_same_curves(small):
    one, two = (next(propose_directrices(small)) for _ in range(2))
    assert one[0].foot == two[0].foot
    assert one[1] == two[1]


def test_planes_in_which_the_modules_bend_most_are_tried_too(small, monkeypatch):
    """Two modules over sludge that lets them in where they bend by 60 degrees, and not 45 degrees aside, where they start."""
    monkeypatch.setattr(insertion, "_CURVES", 2)
    scene = small.scene
    motion = scene.task.motion.model_copy(update={"start": (Bend(angle=0.5, azimuth=np.radians(165.0)),) * 2})
    waste = scene.tank.waste.model_copy(update={"level": 3.2})
    site = vgtsim.Site(
        replace(
            scene,
            manipulator=cut_arm(scene.manipulator, 2),
            tank=scene.tank.model_copy(update={"waste": waste}),
            task=scene.task.model_copy(update={"motion": motion}),
        )
    )
    for directrix, towards in islice(propose_directrices(site), 2):
        with pytest.raises(PathError, match="waste"):
            follow_directrix(site, directrix, towards)
    way = plan_insertion(site)
    assert way.azimuth == pytest.approx(np.radians(-150.0))
    assert way.gaps["waste"] >= site.clearance
    assert count_from(site) == pytest.approx(np.radians([165.0, -150.0]))


def test_shapes_that_do_not_assemble_between_their_places_are_a_miss(small, monkeypatch):
    def refuse(*_):
        raise AssemblyError("m1", 1e-3)

    monkeypatch.setattr(insertion, "judge_way", refuse)
    with pytest.raises(PathError, match="m1 does not assemble"):
        follow_directrix(small, CURVE, AZIMUTH)


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.145, 2.5])
def test_reference_arm_is_inserted_over_heel_and_sludge(level):
    reach = vgtsim.load("type_ii_reach")
    waste = reach.tank.waste.model_copy(update={"level": level})
    site = with_hoist(reach, waste=waste)
    way = plan_insertion(site)
    assert way.gaps["waste"] >= site.clearance
    assert max(way.strength, way.pressure) <= 1.0
    assert np.all(site.box.spare(site.chain.lengths(way.ends[1])) >= 0)


@pytest.mark.parametrize(
    ("tank", "hoist", "wanted"),
    [
        ({}, None, "mast.feed: found nothing"),
        ({}, HOIST.model_copy(update={"stroke": 10.0}), "less than lifts the arm's tool out of the riser"),
        ({"headroom": 4.0}, HOIST, "tank.headroom: found 4 m"),
    ],
)
def test_scene_without_room_for_the_way_is_refused(small, tank, hoist, wanted):
    with pytest.raises(DescriptionError, match=wanted):
        check_entry(with_hoist(small, hoist, **tank))


def test_obstacle_in_the_mouth_and_waste_above_the_pivot_are_refused(small):
    item = small.tank.equipment[0].model_copy(update={"radius": 0.4, "diameter": 0.1})
    with pytest.raises(DescriptionError, match=r"thermocouple_tree, 0.183 m inside the cylinder below the mouth"):
        check_entry(with_hoist(small, equipment=(item,)))
    waste = small.tank.waste.model_copy(update={"level": 7.5})
    with pytest.raises(DescriptionError, match=r"7.5 m, 0.18 m above the arm's pivot"):
        check_entry(with_hoist(small, waste=waste))
    narrow = small.tank.arm_riser.model_copy(update={"bore": 1.0})
    with pytest.raises(DescriptionError, match=r"does not fit riser_42in: .* too little"):
        check_entry(with_hoist(small, arm_riser=narrow))


@pytest.mark.slow
def test_drawn_curves_are_followed_near_the_bound():
    site = vgtsim.load("arm9_nullspace")
    trials = list(follow_drawn(site, 3, 1))
    assert all(trial.way is not None for trial in trials)
    for trial in trials:
        way = trial.way
        assert least_of_sections(site, way) < way.bound <= way.deviation <= FOLLOWED * way.bound


@pytest.fixture(scope="module")
def aside(small):
    """The same arm in a riser 2.5 m beside the axis."""
    riser = small.tank.arm_riser.model_copy(update={"radius": 2.5, "azimuth": 1.0})
    return vgtsim.Site(replace(small.scene, tank=small.tank.model_copy(update={"arm_riser": riser, "equipment": ()})))


@pytest.mark.slow
def test_a_module_unfolds_soon_enough_below_the_rim():
    """On this curve shapes between knots 0.35 m apart leave it by 1.5 times the least, just after a module's opening."""
    arcs = [(4.93716159, 0.20644784), (4.14793234, 0.19739532), (3.10120803, -0.04266906)]
    way = follow_directrix(vgtsim.load("arm30_shape"), make_directrix(7.29361322, arcs), -3.1135868, followed=FOLLOWED)
    assert way.bound <= way.deviation <= FOLLOWED * way.bound


def test_a_riser_beside_the_axis_holds_the_stowed_arm_as_one_on_it_does(small, aside):
    """Deep in the bore the tank is out of reach: the least distance from the bore is that of the riser's fit."""
    lift = np.array([start_feed(small, PlanarArm(small.chain, 0.0))])
    gaps = [Entry(site).gaps(site.chain.stowed[None], lift).bore for site in (small, aside)]
    np.testing.assert_allclose(gaps[1], gaps[0], atol=1e-9)
    assert gaps[1].min() == pytest.approx(riser_fit(aside.chain, aside.tank.arm_riser.bore).spare, abs=1e-9)


def test_an_arm_comes_in_beside_the_axis(aside):
    way = follow_directrix(aside, CURVE, AZIMUTH, followed=FOLLOWED)
    feed, q = way.feed(np.linspace(0, 1, 301)), way.spline(np.linspace(0, 1, 301))
    gaps = Entry(aside).gaps(q, feed).least()
    assert gaps["riser"] > 0.9 * asked_spare(aside) * BORE
    assert min(gap for place, gap in gaps.items() if place != "riser") > 0.8 * aside.clearance
    line = axis_of(aside.chain, aside.chain.nodes(q[-1]))
    np.testing.assert_allclose(line[0, :2], aside.tank.arm_riser.place, atol=1e-9)
