from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vgtsim.description.tank import Equipment
from vgtsim.errors import PathError
from vgtsim.geometry import make_profile
from vgtsim.kinematics import azimuth, bend_all, swing
from vgtsim.kinematics.inertia import member_radii
from vgtsim.planning.path import plan_path
from vgtsim.planning.sampling import can_search
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import Surroundings, make_box

pytestmark = pytest.mark.long

SAMPLING = 0.01  # points 4 cm apart stand for capsules, arcs 2 cm apart for the tank's profile
CLEARANCE, STROKE_MARGIN = 0.10, 0.005  # m
BENDS = np.radians([10.0, 32.0, 32.0, 25.0, 10.0])


@pytest.fixture(scope="module")
def around(hanging_arm, type_ii):
    return Surroundings(hanging_arm, type_ii, 0.15, 0.4572)


def corridor(around, clearance=CLEARANCE):
    return Corridor(make_box(around.chain, STROKE_MARGIN), around, clearance)


def pose(chain, azimuth_g):
    return bend_all(chain, BENDS, -np.radians(azimuth_g))


@pytest.fixture(scope="module")
def past_equipment(hanging_arm, around):
    """From one side of the equipment, which stands at 50 to 75 degrees, to the other."""
    return plan_path(corridor(around), pose(hanging_arm, 110), pose(hanging_arm, 10), "past")


def brute_clearance(chain, tank, q):
    """Least distance of points all over the arm from points all over the tank and from its equipment."""
    nodes, ends = chain.nodes(q), chain.truss.ends
    part = np.linspace(0, 1, 45)[:, None]
    radii = member_radii(chain)
    cloud = (nodes[ends[:, 0], None] * (1 - part) + nodes[ends[:, 1], None] * part).reshape(-1, 3)
    thick = np.repeat(radii, 45)
    moving = np.repeat(ends.min(axis=1) > 2, 45)  # members at the mast flange do not come nearer
    cloud, thick = cloud[moving], thick[moving]
    tool = chain.tool(q)[0]
    cloud, thick = np.append(cloud, tool[None], axis=0), np.append(thick, 0.15)
    profile = make_profile(tank.shell).points(0.02)
    rho = np.hypot(cloud[:, 0], cloud[:, 1])
    flat = np.stack([rho, cloud[:, 2]], axis=-1)
    gaps = [cKDTree(profile).query(flat)[0] - thick]
    gaps.append(cloud[:, 2] - tank.waste.level - thick)
    for item in tank.equipment:
        x, y = item.radius * np.cos(item.azimuth), item.radius * np.sin(item.azimuth)
        below = np.maximum(item.bottom - cloud[:, 2], 0.0)
        gaps.append(np.hypot(np.hypot(cloud[:, 0] - x, cloud[:, 1] - y), below) - item.diameter / 2 - thick)
    return float(min(gap.min() for gap in gaps))


def test_path_is_clear_by_brute_force(hanging_arm, type_ii, past_equipment):
    samples = past_equipment.curve(np.linspace(0, 1, 97))
    least = min(brute_clearance(hanging_arm, type_ii, q) for q in samples)
    assert least >= CLEARANCE
    assert least == pytest.approx(past_equipment.clearance, abs=SAMPLING)


def test_path_joins_its_ends(hanging_arm, past_equipment):
    np.testing.assert_allclose(past_equipment.curve(0.0), pose(hanging_arm, 110), atol=1e-12)
    np.testing.assert_allclose(past_equipment.curve(1.0), pose(hanging_arm, 10), atol=1e-12)


def test_path_stays_inside_the_strokes(hanging_arm, past_equipment):
    lengths = hanging_arm.lengths(past_equipment.curve(np.linspace(0, 1, 1001)))
    margin = STROKE_MARGIN
    assert np.all(lengths > hanging_arm.stroke[0] + margin)
    assert np.all(lengths < hanging_arm.stroke[1] - margin)
    assert past_equipment.spare > 0


def test_path_goes_the_long_way_round_the_equipment(hanging_arm, past_equipment):
    tools = hanging_arm.tool(past_equipment.curve(np.linspace(0, 1, 301)))[0]
    turned = np.unwrap([azimuth(hanging_arm, tool) for tool in tools])
    assert abs(turned[-1] - turned[0]) == pytest.approx(np.radians(260), abs=1e-6)


def test_path_takes_the_short_way_where_nothing_stands(hanging_arm, around):
    path = plan_path(corridor(around), pose(hanging_arm, 120), pose(hanging_arm, 200), "free")
    tools = hanging_arm.tool(path.curve(np.linspace(0, 1, 101)))[0]
    turned = np.unwrap([azimuth(hanging_arm, tool) for tool in tools])
    assert abs(turned[-1] - turned[0]) == pytest.approx(np.radians(80), abs=1e-6)
    assert path.clearance >= CLEARANCE


def test_path_blocked_both_ways_names_what_blocks_it(hanging_arm, type_ii):
    second = Equipment(name="second_screen", diameter=0.25, radius=2.4, azimuth=np.radians(230), bottom=0.1)
    blocked = type_ii.model_copy(update={"equipment": (*type_ii.equipment, second)})
    around = Surroundings(hanging_arm, blocked, 0.15, 0.4572)
    with pytest.raises(PathError) as caught:
        plan_path(corridor(around), pose(hanging_arm, 110), pose(hanging_arm, 10), "shut in")
    assert caught.value.leg == "shut in"
    assert caught.value.place in {"saltwell_screen", "second_screen", "thermocouple_tree"}
    assert caught.value.clearance < CLEARANCE


def test_more_clearance_is_kept_when_it_is_asked_for(hanging_arm, around):
    ends = pose(hanging_arm, 120), pose(hanging_arm, 150)
    assert plan_path(corridor(around, 0.3), *ends, "wide").clearance >= 0.3


@pytest.mark.skipif(not can_search(), reason="OMPL is not installed")
def test_the_last_section_goes_through_an_opening_hardly_wider_than_it(hanging_arm, type_ii):
    """Between two posts, 1.05 times as far apart as the section is wide; a path smoothed once misses the clearance."""
    home, through = np.radians([[-13.0, 42.0, 40.0, 24.0, 43.0], [26.0, 33.0, -2.0, 33.0, -2.0]])
    first = swing(hanging_arm, bend_all(hanging_arm, home, 0.0), -np.pi / 3)
    last = bend_all(hanging_arm, through, 0.0)
    across, hub = hanging_arm.nodes(last)[-6:, 1], hanging_arm.manipulator.hub.radius
    low, high = across.min() - hub, across.max() + hub
    sides = [(low + high) / 2 + side * (1.05 * (high - low) + 0.3) / 2 for side in (1, -1)]
    posts = [
        Equipment(name=f"post_{k}", diameter=0.3, radius=np.hypot(9.4, y), azimuth=np.arctan2(y, 9.4))
        for k, y in enumerate(sides)
    ]
    narrow = Surroundings(hanging_arm, type_ii.model_copy(update={"equipment": tuple(posts)}), 0.15, 0.4572)
    found = plan_path(corridor(narrow, 0.01), first, last, "opening")
    samples = found.curve(np.linspace(0, 1, 1001))
    assert narrow.clearance(samples)[0].min() > 0.009
    assert found.clearance >= 0.01
    np.testing.assert_allclose(found.curve([0.0, 1.0]), [first, last], atol=1e-12)
