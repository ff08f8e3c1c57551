"""The controller on a plant that does at once what it is told: targets, limits, refusals, and no jump whatever comes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hands import STEP, Echo, Hand, Ride
from playing import bend

from vgtsim.control import Controller
from vgtsim.control.arm_now import ArmNow
from vgtsim.control.watches import GapWatch
from vgtsim.description import AllowedContact, Bend, Operator, load_manipulator
from vgtsim.errors import CommandError, DescriptionError, ReachError, StoppedError
from vgtsim.site import Site, load_site
from vgtsim.statics import find_use, motion_from_log, solve_members

pytestmark = pytest.mark.long

TRACKED = 1e-3  # m: the tracking limit of the shipped scenes
ARRIVED = 1e-4  # m: ways of less than 10 µs at full speed, and what is not worth coming back for
ADDED = 0.1  # of the greatest static force: what an erratic hand may add
ROUNDING = 1e-9


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(reach_scene)


@pytest.fixture
def ride(site):
    return Ride(site)


def away(report):
    return np.linalg.norm(report.tool_position - report.target_position)


def test_a_twist_moves_and_turns_the_tool_as_asked(ride):
    twist = np.array([0.05, 0.02, -0.04, 0.0, 0.0, 0.01])
    ride.go(3.0, twist=twist)
    q = ride.inputs[-1]
    rates = (ride.inputs[-1] - ride.inputs[-2]) / STEP
    moved = ride.site.chain.jacobian(q) @ rates
    assert np.allclose(moved, twist, atol=5e-4)
    assert away(ride.reports[-1]) < TRACKED
    assert ride.reports[-1].held_by == ()


def test_a_goal_is_reached_straight_and_held(ride):
    position, direction = ride.site.chain.tool(ride.site.start)
    goal = position + [0.3, 0.2, -0.3]
    ride.go(9.0, goal=np.concatenate([goal, direction + [0, 0.1, 0]]))
    ways = ride.site.chain.tool(np.array(ride.inputs))[0] - position
    along = (goal - position) / np.linalg.norm(goal - position)
    across = ways - (ways @ along)[:, None] * along
    assert np.linalg.norm(ways[-1] + position - goal) < ARRIVED
    assert np.linalg.norm(across, axis=1).max() < TRACKED
    wanted = (direction + [0, 0.1, 0]) / np.linalg.norm(direction + [0, 0.1, 0])
    assert np.linalg.norm(np.cross(ride.reports[-1].tool_direction, wanted)) < ARRIVED
    assert not ride.rates[-1].any()


def test_a_goal_by_newton_ends_in_the_posture_of_the_solver(ride):
    position, direction = ride.site.chain.tool(ride.site.start)
    ride.go(18.0, goal=[position + [0.2, -0.3, -0.4], direction], method="newton")
    assert np.linalg.norm(ride.reports[-1].tool_position - position - [0.2, -0.3, -0.4]) < ARRIVED
    ways = np.array(ride.lengths) - ride.lengths[0]
    share = ways / ways[-1]
    assert np.ptp(share, axis=1).max() < 0.05  # the cylinders go there together


def test_inputs_and_lengths_are_reached(ride):
    site = ride.site
    q = site.start + 0.02
    ride.go(13.0, inputs=q)
    assert np.abs(ride.inputs[-1] - q).max() < ARRIVED
    wanted = ride.lengths[0]
    ride.go(13.0, lengths=wanted)
    assert np.abs(ride.lengths[-1] - wanted).max() < ARRIVED


def test_an_arm_that_nobody_moves_stays_where_it_is(ride):
    ride.go(1.0)
    ride.go(2.0, twist=np.zeros(6))
    assert np.ptp(np.array(ride.lengths), axis=0).max() == 0.0


def test_hold_brings_the_arm_to_rest_within_a_second_or_two(ride):
    ride.go(2.0, twist=[0, 0, -0.2, 0, 0, 0])
    ride.go(5.0, hold=True)
    assert not ride.rates[-1].any()


@pytest.mark.parametrize("kind", ["twist", "goal", "lengths", "mixed"])
def test_an_erratic_hand_breaks_no_limit_and_adds_a_tenth_to_the_forces_at_most(site, kind):
    ride = Ride(site)
    Hand(kind, seed=7).drive(ride, 8.0)
    check_erratic(ride)


def check_erratic(ride):
    """Rates, accelerations, strokes, clearance, tracking and added forces of a ride under an erratic hand."""
    site = ride.site
    motion, box, lengths = site.task.motion, site.box, np.array(ride.lengths)
    full = np.array([0.4 * site.arm.cylinders[site.truss.members[i].section].rate for i in site.truss.actuated])
    assert np.all(np.abs(ride.rates) <= full * (1 + ROUNDING))
    assert np.abs(ride.accelerations).max() <= motion.acceleration * (1 + 1e-6)
    assert box.spare(lengths).min() >= 0
    assert site.surroundings.clearance(np.array(ride.inputs[::10]))[0].min() > 0.9 * site.clearance
    nodes = ride.nodes
    moving = motion_from_log(STEP * np.arange(len(nodes)), nodes, STEP)
    still, shaken = solve_members(site.load_model, nodes), solve_members(site.load_model, nodes, moving)
    added = np.abs(shaken.near_axial - still.near_axial).max(axis=1) / np.abs(still.near_axial).max(axis=1)
    assert added.max() < ADDED
    assert added.max() > 1e-4  # the hand did shake the arm
    assert max(map(away, ride.reports)) < TRACKED


def test_the_same_hand_without_filters_and_bounds_adds_more(site):
    motion = site.task.motion.model_copy(update={"acceleration": 10.0})
    rough = site.task.model_copy(update={"operator": Operator(acceleration=1e3, filter=1e-3), "motion": motion})
    ride = Ride(Site(dataclasses.replace(site.scene, task=rough)))
    Hand("twist", seed=7).drive(ride, 3.0)
    nodes = ride.nodes
    moving = motion_from_log(STEP * np.arange(len(nodes)), nodes, STEP)
    still, shaken = solve_members(site.load_model, nodes), solve_members(site.load_model, nodes, moving)
    added = np.abs(shaken.near_axial - still.near_axial).max(axis=1) / np.abs(still.near_axial).max(axis=1)
    assert added.max() > ADDED


def test_a_wall_slows_the_tool_then_stops_it_and_is_named(ride):
    report = ride.go(10.0, twist=[-0.2, 0, 0, 0, 0, 0])
    assert report.held_by == ("clearance: payload to tank",)
    assert report.nearest == "payload to tank"
    assert report.clearance == pytest.approx(ride.site.clearance, abs=1e-3)
    assert report.part < 0.01
    speeds = np.linalg.norm(np.diff(ride.site.chain.tool(np.array(ride.inputs[50:]))[0], axis=0), axis=1) / STEP
    slowing = speeds[np.argmax(speeds) :]
    assert np.diff(slowing).max() < 1e-3  # no jerk back
    report = ride.go(3.0, twist=[0.1, 0, 0, 0, 0, 0])  # a new command acts at once
    assert report.held_by == ()
    assert report.part > 0.99


def test_a_stroke_and_a_rate_are_named(ride):
    report = ride.go(3.0, twist=[0, 0, 0, 0, 0.25, 0])
    assert all(word.startswith("rate: m") for word in report.held_by)
    assert report.held_by
    assert away(report) < TRACKED
    ride.go(1.0, objective=(), twist=np.zeros(6))
    held = set()
    for _ in range(20):  # the stroke holds from the ninth second on
        held |= set(ride.go(1.0, twist=[0, 0, 0, 0, -0.25, 0]).held_by)
    assert any(word.startswith("stroke: ") for word in held)
    assert ride.site.box.spare(np.array(ride.lengths)).min() >= 0


def test_members_are_not_used_beyond_their_rating(reach_scene):
    heavy = reach_scene.task.payload.model_copy(update={"mass": 620.0})
    site = Site(dataclasses.replace(reach_scene, task=reach_scene.task.model_copy(update={"payload": heavy})))
    ride = Ride(site)
    held = set()
    for _ in range(20):  # the rating holds in the seventeenth second
        held |= set(ride.go(1.0, twist=[0, 0, 0.2, 0, 0, 0]).held_by)
    assert any(word.startswith("rating: m") for word in held)
    use = find_use(site.load_model, site.sections, ride.nodes[::10], site.task.limits.safety_factor)
    first = 1.1 * max(use.strength[0].max(), use.pressure[0].max())
    assert 1.1 * max(use.strength.max(), use.pressure.max()) < max(1.0, first) + 5e-3


def test_lost_directions_are_named_and_refused(reach_scene, site):
    straight = tuple(Bend() for _ in reach_scene.task.motion.start)
    motion = reach_scene.task.motion.model_copy(update={"start": straight, "objective": ("mid_stroke",)})
    hung = Site(dataclasses.replace(reach_scene, task=reach_scene.task.model_copy(update={"motion": motion})))
    ride = Ride(hung)
    # a straight arm cannot turn its tool about its own axis
    report = ride.go(1.0, twist=[0, 0, 0, 0, 0, 0.1])
    assert report.condition > 1e5
    assert report.held_by[0].startswith("lost direction")
    assert "turn about z" in report.held_by[0]
    assert np.ptp(np.array(ride.lengths), axis=0).max() < 1e-6


@pytest.mark.parametrize("arm", ["mixed", "stewart", "octahedron_offset", "octahedron_general", "tetra4"])
def test_any_kind_of_module_is_driven(reach_scene, arm):
    manipulator = load_manipulator(arm)
    if manipulator.stowable and manipulator.stowed is None:  # it is driven all the same, with what its like has
        manipulator = manipulator.model_copy(update={"stowed": load_manipulator("octahedron_offset").stowed})
    start = tuple(Bend() for _ in manipulator.active)
    motion = reach_scene.task.motion.model_copy(update={"start": start, "objective": ("mid_stroke",), "clearance": 0.0})
    task = reach_scene.task.model_copy(update={"motion": motion})
    ride = Ride(Site(dataclasses.replace(reach_scene, manipulator=manipulator, task=task)))
    ride.go(2.0, twist=[0.02, 0.01, 0, 0, 0, 0])
    ride.go(2.0, twist=[-0.01, 0, 0.02, 0, 0.02, 0.01])
    assert max(map(away, ride.reports)) < TRACKED
    moved = ride.site.chain.tool(np.array(ride.inputs))[0]
    assert np.linalg.norm(moved[-1] - moved[0]) > 1e-3
    assert ride.site.box.spare(np.array(ride.lengths)).min() >= 0


@pytest.mark.parametrize("scene", ["arm15_coupled", "arm30_shape", "arm60_shape"])
def test_the_arms_of_all_methods_are_driven_and_an_erratic_hand_adds_a_tenth_at_most(scene):
    site = load_site(scene)
    ride = Ride(site)
    position, direction = site.chain.tool(site.start)
    way = np.array([0.1, 0.05, -0.1])
    ride.go(7.0, goal=np.concatenate([position + way, direction]))
    assert np.linalg.norm(ride.reports[-1].tool_position - position - way) < ARRIVED
    assert ride.reports[-1].held_by == ()
    Hand("mixed", seed=7).drive(ride, 4.0)
    check_erratic(ride)


def test_a_contact_holds_the_arm_until_it_is_released(site):
    ride = Ride(site)
    ride.go(1.0, twist=[0, 0, -0.1, 0, 0, 0])
    now, controller = ride.lengths[-1], ride.controller
    hit = Echo(now, now, contacts=((1.0, "m1/longeron/1", "shell", -1e-4),))
    assert np.array_equal(controller.step(hit), now)
    assert np.array_equal(controller.step(Echo(now, now)), now)
    assert controller.report.held_by == ("contact of m1/longeron/1 with shell",)
    with pytest.raises(StoppedError, match="contact of m1/longeron/1"):
        controller.command(twist=np.zeros(6))
    controller.release()
    report = ride.go(1.0, twist=[0, 0, 0.1, 0, 0, 0])
    assert report.held_by == ()
    assert np.abs(ride.accelerations[-45:]).max() <= site.task.motion.acceleration * (1 + 1e-6)


def test_what_may_touch_comes_together_slowly_and_does_not_hold():
    """The tool of an arm with servos is 5 cm over the waste, half the clearance; other gaps close as without the rule."""
    scene = load_site("arm9_nullspace").scene
    q = bend(scene, [0.7, 0.4, -0.3], [0.0, 0.0, 0.0])
    level = float(Site(scene).chain.tool(q)[0][2]) - scene.task.payload.radius - 0.05
    tank = scene.tank.model_copy(update={"waste": scene.tank.waste.model_copy(update={"level": level})})
    found = {}
    for drive, rules in (("servo", (AllowedContact(part="tool", place="waste"),)), ("servo", ()), ("rigid", None)):
        simulation = scene.task.simulation.model_copy(update={"drive": drive})
        rules = (AllowedContact(part="tool", place="waste"),) if rules is None else rules
        task = scene.task.model_copy(update={"simulation": simulation, "contacts": rules})
        site = Site(dataclasses.replace(scene, task=task, tank=tank))
        watch, arm = GapWatch(site=site), ArmNow(site.chain, site.chain.state(q[None]))
        least = watch.bound(arm, np.full(9, 0.1), STEP)[1]
        found[drive, bool(rules)] = dict(zip(map(watch.name, range(len(least))), least.tolist(), strict=True)), site
    slow, never, rigid = (found[key][0] for key in (("servo", True), ("servo", False), ("rigid", True)))
    assert slow["payload to waste"] == -0.02
    assert never["payload to waste"] == rigid["payload to waste"] == 0
    tool = {name for name in slow if name.endswith("to waste") and name.startswith(("payload", "s3/top"))}
    assert len(slow) > len(tool)
    assert {name: slow[name] for name in slow if name not in tool} == {n: never[n] for n in never if n not in tool}
    site = found["servo", True][1]
    controller, now = Controller(site, STEP), site.chain.lengths(q)
    controller.start(now, q)
    controller.command(twist=[-0.05, 0, 0, 0, 0, 0])
    for _ in range(10):
        now = controller.step(Echo(now, now, contacts=((1.0, "payload", "tank/waste", -1e-4),)))
    assert np.abs(controller.report.rates).max() > 0
    assert np.array_equal(controller.step(Echo(now, now, contacts=((1.0, "m1/batten/1", "tank/waste", -1e-4),))), now)
    assert controller.report.held_by == ("contact of m1/batten/1 with tank/waste",)


def test_a_plant_that_has_stopped_is_not_commanded(site):
    ride = Ride(site)
    now = ride.lengths[-1]
    assert np.array_equal(ride.controller.step(Echo(now, now, stopped="collision of a with b")), now)
    with pytest.raises(StoppedError, match="collision of a with b"):
        ride.controller.command(hold=True)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ({}, "found nothing; allowed: one of twist, goal, inputs, lengths, hold"),
        ({"twist": np.zeros(6), "hold": True}, "found twist and hold"),
        ({"twist": np.zeros(5)}, r"twist: found shape \(5,\); allowed: shape \(6,\)"),
        ({"twist": [0, 0, np.nan, 0, 0, 0]}, "twist: found nan at 2; allowed: finite numbers"),
        ({"twist": "fast"}, "twist: found 'fast'; allowed: 6 numbers"),
        ({"goal": np.zeros(6)}, "goal: found a direction of length 0"),
        ({"goal": [[0, 0, 0], [0, 0]]}, "goal: found .*; allowed: 6 numbers"),
        ({"inputs": np.zeros(3)}, r"inputs: found shape \(3,\); allowed: shape \(15,\)"),
        (
            {"inputs": np.full(15, 2.0)},
            "inputs: found mid-plane normal .*; allowed: inputs that every module",
        ),
        ({"lengths": np.full(15, 9.0)}, "lengths: found m1/actuator/1 at 9.0000 m; allowed: 0.* to .* m"),
        ({"goal": [0, 0, 0, 0, 0, 1], "method": "guess"}, "method: found 'guess'; allowed: 'rate' or 'newton'"),
    ],
)
def test_wrong_commands_are_refused_by_name_and_change_nothing(ride, command, words):
    ride.go(0.5, twist=[0, 0, -0.1, 0, 0, 0])
    with pytest.raises(CommandError, match=words):
        ride.controller.command(**command)
    report = ride.go(1.5)
    assert report.tool_position[2] < ride.site.chain.tool(ride.site.start)[0][2] - 0.05  # it goes on as it was


def test_unknown_objectives_and_goals_out_of_reach_are_refused(ride):
    with pytest.raises(DescriptionError, match="did you mean 'mid_stroke'"):
        ride.controller.command(hold=True, objective=("mid_stroke_",))
    with pytest.raises(ReachError, match="out of reach"):
        ride.controller.command(goal=[0, 0, 40.0, 0, 0, 1], method="newton")
    ride.go(0.1)


def test_a_controller_without_a_state_takes_no_command(site):
    with pytest.raises(StoppedError, match="has not seen a state"):
        Controller(site).command(hold=True)
