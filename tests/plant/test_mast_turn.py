"""The mast that turns: the arm swings as a whole, loops stay closed, and the drive gives the torque that its inertia asks for."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, climb, hoist, shorten, slew

from vgtsim.description import MoveStep, Slew
from vgtsim.errors import CommandError, DescriptionError
from vgtsim.log.runlog import TURN
from vgtsim.planning import Leg, Tour, plan_mission
from vgtsim.plant import Plant, run
from vgtsim.site import Site
from vgtsim.verification import verify

STEP, TIME = 0.02, 5.0  # s
ANGLE, HEIGHT = 0.9, 0.5  # rad and m
CLOSED = 1e-7  # m
TIERS = {
    "rigid": {},
    "sections": {"members": "sections"},
    "servo": {"drive": "servo", "timestep": 5e-3},
    "springs": {"members": "elastic", "timestep": 0.01, "log_rate": 100.0, "damping_ratio": 0.5},
}
ROWS = {
    "turn to its command",
    "commanded turn to the plan",
    "turning drive's torque error at rest over the mast's moment",
    "turning drive's torque error over the mast's moment",
    "distance to the end of the turn",
    "turn speed over rated speed",
    "commanded turn acceleration over rated",
    "turning drive's torque over rated torque",
}


@pytest.fixture(scope="module")
def scene(reach_scene):
    scene = slew(hoist(change(shorten(reach_scene, 2), timestep=STEP, log_rate=50.0)))
    motion = scene.task.motion.model_copy(update={"settle_speed": 1e-8})
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))


@pytest.fixture(scope="module", params=TIERS)
def turned(request, scene):
    """Site, tour and log of a motion of cylinders, feed and turn at once."""
    free = change(scene, **TIERS[request.param])
    start, end = bend(free, [0.2, 0.25], [0.0, 1.0]), bend(free, [0.25, 0.2], [0.2, 0.9])
    site = Site(free)
    s = climb(1.0, TIME, site.timestep)
    lengths = site.chain.lengths(start + s[:, None] * (end - start))
    leg = Leg(
        name="way",
        goal=0,
        lengths=lengths,
        q=end,
        clearance=1.0,
        place="nothing",
        feed=HEIGHT * s,
        turn=ANGLE * s,
    )
    tour = Tour(start, (leg,), site.timestep)
    return site, tour, run(site, tour)


def test_arm_swings_as_a_whole(turned):
    """By hand: where kinematics has the nodes, less the axis, turned by a matrix."""
    site, _, log = turned
    if site.task.simulation.members == "elastic":
        return
    c, s, o = np.cos(log.turn), np.sin(log.turn), np.zeros(log.count)
    R = np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, o + 1]]), -1, 0)
    axis = [*site.tank.arm_riser.place, 0.0]
    nodes = site.chain.nodes(site.chain.inputs_from_lengths(log.actual)) - axis
    expected = np.einsum("tij,tnj->tni", R, nodes) + axis + log.feed[:, None, None] * [0, 0, 1]
    gaps = np.linalg.norm(log.ends - log.nodes[:, site.truss.ends], axis=-1)
    assert np.abs(log.nodes - expected).max() < CLOSED
    assert gaps.max() < CLOSED
    assert log.turn[-1] == pytest.approx(ANGLE, abs=CLOSED)


def test_torque_is_the_change_of_angular_momentum(turned):
    """By hand: that of the hubs, whose mass is all there is where the members' mass is in them; of others within a tenth."""
    site, _, log = turned
    dt = log.time[1] - log.time[0]
    away = log.nodes - [*site.tank.arm_riser.place, 0.0]
    speed = np.gradient(log.nodes, dt, axis=0)
    momentum = away[..., 0] * speed[..., 1] - away[..., 1] * speed[..., 0]
    masses = site.load_model.mass / len(site.truss.nodes)  # spread evenly: enough for the size and the sign
    rough = np.gradient((masses * momentum).sum(axis=1), dt)
    assert np.corrcoef(rough[5:-5], log.turn_torque[5:-5])[0, 1] > 0.9


def test_checks_pass_while_the_mast_turns(turned):
    site, tour, log = turned
    report = verify(site, log, tour)
    words = ("turn ", "turning", "feed", "hoist", "node", "gap", "reaction", "largest force")
    rows = [row for row in report.checks if any(word in row.quantity + " " for word in words)]
    trails = {"turn to its command"} if site.task.simulation.drive == "servo" else set()
    assert {row.quantity for row in rows} >= ROWS - trails
    assert [(row.quantity, row.measured) for row in rows if not row.passed] == []


def test_commands_of_the_turn(scene):
    plant = Plant(Site(scene))
    plant.reset(turn=0.3)
    assert plant.state.turn == pytest.approx(0.3, abs=CLOSED)
    plant.command(turn=0.301)
    plant.step()
    assert not plant.calm
    assert plant.state.feed == pytest.approx(0.0, abs=CLOSED)
    for wrong in (-2.1, 2.6, np.nan):
        with pytest.raises(CommandError, match=r"turn.*-2 to 2.5 rad, the range of mast.turn"):
            plant.command(turn=wrong)
    mast = scene.task.mast.model_copy(update={"turn": None})
    held = dataclasses.replace(scene, task=scene.task.model_copy(update={"mast": mast}))
    with pytest.raises(CommandError, match=r"no mast\.turn is given"):
        Plant(Site(held)).reset(turn=0.1)
    plant = Plant(Site(held))
    plant.reset()
    assert all(not getattr(plant.log, name).size for name in TURN)


@pytest.mark.long
def test_a_step_of_a_mission_turns_the_mast(scene):
    """A goal turned about the mast's axis, with the mast, needs the posture of the goal itself; the way back is a turn alone."""
    site = Site(scene)
    position, direction = site.chain.tool(site.start)
    axis = np.array([*site.tank.arm_riser.place, 0.0])
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    poses = {"near": (position, direction), "aside": (R @ (position - axis) + axis, R @ direction)}
    motion, mould = scene.task.motion, scene.task.motion.goals[0]
    goals = tuple(
        mould.model_copy(update={"name": name, "position": tuple(place), "direction": tuple(way)})
        for name, (place, way) in poses.items()
    )
    mission = (
        MoveStep(do="move", goal="near"),
        MoveStep(do="move", goal="aside", turn=ANGLE),
        MoveStep(do="move", goal="near", turn=0.0),
    )
    slow = slew(scene, rate=0.2, acceleration=0.1).task.mast
    mast = slow.model_copy(update={"feed": None})
    update = {"motion": motion.model_copy(update={"goals": goals}), "mission": mission, "mast": mast}
    site = Site(dataclasses.replace(scene, task=scene.task.model_copy(update=update)))
    tour = plan_mission(site)
    out, back = tour.legs[1:]
    assert tour.legs[0].turn is None
    assert (out.turn[0], out.turn[-1]) == (0.0, pytest.approx(ANGLE, abs=1e-12))
    assert (back.turn[0], back.turn[-1]) == (pytest.approx(ANGLE, abs=1e-12), 0.0)
    moving = np.abs(np.diff(out.turn)) > 0
    assert np.abs(np.diff(out.lengths, axis=0))[moving].max() < 1e-12  # the arm keeps its shape meanwhile
    rated = site.task.mast.turn
    assert np.abs(np.diff(out.turn)).max() / tour.timestep < 1.001 * rated.rate
    assert 0.9 < np.abs(np.diff(out.turn, n=2)).max() / tour.timestep**2 / rated.acceleration < 1.001
    report = verify(site, run(site, tour), tour)
    assert [(row.quantity, row.measured) for row in report.checks if not row.passed] == []


@pytest.mark.parametrize(
    ("turn", "match"), [(2.6, r"-2 to 2\.5 rad, the range of mast\.turn"), (0.1, r"no mast\.turn")]
)
def test_a_turn_that_the_mast_does_not_make_is_refused(scene, turn, match):
    goal = scene.task.motion.goals[0].name
    held = scene.task.mast.model_copy(update={"feed": None})
    mast = held if turn > 1 else held.model_copy(update={"turn": None})
    task = scene.task.model_copy(update={"mission": (MoveStep(do="move", goal=goal, turn=turn),), "mast": mast})
    with pytest.raises(DescriptionError, match=match) as caught:
        dataclasses.replace(scene, task=task)._check_mission()
    assert caught.value.key == "mission.0.turn"


@pytest.mark.parametrize("wrong", [(0.1, 1.0), (-3.2, 1.0), (0.0, 0.0), (0.0, 3.2)])
def test_the_range_of_a_turn_holds_zero_and_less_than_a_whole_turn(wrong):
    with pytest.raises(ValueError, match="a range that holds 0"):
        Slew(range=wrong, rate=0.1, acceleration=0.1, torque=1e4)
