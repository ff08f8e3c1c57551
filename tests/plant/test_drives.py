"""Servos and cylinders on one module and on a whole arm: what they hold, what they run into, what is refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from playing import bend, change, out_of_the_tank, play, shorten

from vgtsim.description import AllowedContact, load_scene
from vgtsim.errors import DescriptionError
from vgtsim.planning import plan_tour
from vgtsim.plant import run
from vgtsim.plant.hydraulics import CAVITY, PRESSURE, STROKE
from vgtsim.site import Site
from vgtsim.statics.elasticity import hold_cylinders, make_elastic_model
from vgtsim.statics.loads import tool_point
from vgtsim.statics.stiffness import settle
from vgtsim.verification import Evidence, drives, shape, verify

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
SETTLED = 1e-6  # m


@pytest.fixture(scope="module")
def module(reach_scene):
    """One elastic module in free air."""
    scene = shorten(reach_scene, 1)
    motion = scene.task.motion.model_copy(update={"settle_speed": 1e-6, "patience": 3.0, "hold": 0.1})
    scene = dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))
    return change(scene, members="elastic", timestep=2e-3, log_rate=100.0, damping_ratio=0.2)


@pytest.fixture(scope="module")
def cylinders():
    return load_scene(ROOT / "scenes/hydraulic_drives.toml")


def weaken(scene, **changes):
    """The scene with other figures of its cylinders."""
    arm = scene.manipulator
    parts = {name: part.model_copy(update=changes) for name, part in arm.cylinders.items()}
    return dataclasses.replace(scene, manipulator=arm.model_copy(update={"cylinders": parts}))


def rows(scene, log):
    return {check.quantity.removeprefix("records with a cylinder "): check for check in verify(Site(scene), log).checks}


def test_servos_hold_an_elastic_arm_as_springs_of_their_stiffness(module):
    """Against equilibrium of the project's truss model with the servo in place of oil and rod."""
    scene = change(module, drive="servo", servo_stiffness=5e7, servo_damping=5e5)
    q, chain = bend(scene, [0.6], [0.4]), Site(scene).chain
    log, simulation = play(scene, q, q, 0.1, out_of_the_tank), scene.task.simulation
    elastic = hold_cylinders(make_elastic_model(chain, scene.task.payload, simulation.gravity), simulation)
    assert log.settled.any()
    assert np.abs(log.nodes[-1] - settle(elastic, chain.nodes(q))).max() < SETTLED
    assert log.actuator_force[-1] == pytest.approx(5e7 * (log.actual[-1] - log.commanded[-1]), rel=1e-4)
    assert shape.check_settled_shape(Evidence(Site(scene), log)).value < 1e-5


def test_an_arm_that_servos_press_on_something_bends_no_member(module):
    """The solver stops where it is near enough, in contact too."""
    scene = change(module, drive="servo")
    motion = scene.task.motion.model_copy(update={"patience": 0.1})
    contacts = tuple(AllowedContact(part=part, place="shell") for part in ("tool", "hubs", "members"))
    scene = dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion, "contacts": contacts}))
    first, last = bend(scene, [0.2], [0.0]), bend(scene, [0.6], [0.8])

    def put_wall(spec):
        block = spec.worldbody.add_geom(name="tank/block", type=6, size=[3, 0.1, 3], contype=1, conaffinity=0)
        block.pos = [0, -1.22, scene.pivot_height]  # 47 mm inside the payload's last place

    log = play(scene, first, last, 0.4, put_wall)
    assert len(log.contact_time) > 20
    assert log.contact_distance.min() > -0.04
    assert np.linalg.norm(log.member_moment, axis=-1).max() < scene.task.limits.end_moment
    assert np.abs(log.member_force).max() > 2e4


def test_servo_at_its_force_limit_is_logged_and_fails_its_row(module):
    scene = change(weaken(module, pressure=0.3e6), drive="servo")
    q = bend(scene, [0.6], [0.4])
    log = play(scene, q, q, 0.3, out_of_the_tank)
    found = rows(scene, log)["at its force limit"]
    assert not found.passed
    assert found.where.startswith("m1/actuator")
    assert found.measured == np.mean((log.saturation & PRESSURE).any(axis=1))
    parts = list(scene.manipulator.cylinders.values())
    assert np.abs(log.actuator_force).max() < 1.05 * max(part.push for part in parts)


def test_servo_faster_than_rated_and_beyond_its_stroke_fails_both_rows(module):
    """A slow cylinder with a short stroke in a plan that knows of neither."""
    scene = change(module, drive="servo")
    start, end = bend(scene, [0.2], [0.0]), bend(scene, [0.6], [0.8])
    middle = float(Site(scene).chain.lengths(start).mean())
    retracted = next(iter(scene.manipulator.cylinders.values())).retracted
    slow = weaken(scene, rate=0.01, stroke=middle + 0.02 - retracted)
    log = play(slow, start, end, 2.0, out_of_the_tank)
    found = rows(slow, log)
    assert not found["above its rated speed"].passed
    assert not found["beyond its stroke"].passed
    assert found["at its force limit"].passed
    assert found["beyond its stroke"].measured == np.mean((log.saturation & STROKE).any(axis=1))
    fine = rows(scene, play(scene, start, (start + end) / 2, 6.0, out_of_the_tank))  # half the way in half of 12 s
    assert fine["above its rated speed"].passed
    assert fine["beyond its stroke"].passed


def hydraulic(scene, **settings):
    return change(scene, drive="hydraulic", **settings)


def test_valve_at_its_flow_limit_fails_its_row_and_the_slow_one_passes(module):
    scene = hydraulic(module)
    start, end = bend(scene, [0.2], [0.0]), bend(scene, [0.6], [0.8])
    # half the way in half of 12 s: as slow as a whole one that takes 12 s
    ways = ((end, 1.0), ((start + end) / 2, 6.0))
    fast, slow = (rows(scene, play(scene, start, last, time, out_of_the_tank)) for last, time in ways)
    assert not fast["at its flow limit"].passed
    assert slow["at its flow limit"].passed
    assert slow["chamber pressures against drive force"].passed
    assert slow["least chamber pressure above the tank's"].passed


def overload(spec):
    """Four times the tip and payload that the plan was told of."""
    out_of_the_tank(spec)
    spec.body("tip").mass *= 4


def test_load_beyond_the_supply_opens_relief_valves_or_cavities_and_fails_their_rows(module):
    """The supply holds what the plan was told of with a twentieth to spare."""
    scene = hydraulic(module)
    q = bend(scene, [0.6], [0.4])
    holds = np.abs(drives.check_actuators(Evidence(Site(scene), play(scene, q, q, 0.1, out_of_the_tank))).value)
    least = next(iter(scene.manipulator.cylinders.values())).pressure * holds
    log = play(weaken(scene, pressure=1.05 * least), q, q, 0.1, overload)
    found = rows(weaken(scene, pressure=1.05 * least), log)
    assert ((log.saturation & (PRESSURE | CAVITY)) != 0).any()
    assert not (found["at its relief pressure"].passed and found["with a cavity in its oil"].passed)


def test_piston_at_its_end_fails_its_row(module):
    scene = hydraulic(module)
    start, end = bend(scene, [0.2], [0.0]), bend(scene, [0.5], [0.0])
    middle = float(Site(scene).chain.lengths(end).max())
    retracted = next(iter(scene.manipulator.cylinders.values())).retracted
    short = weaken(scene, stroke=middle - 0.01 - retracted)
    log = play(short, start, end, 6.0, out_of_the_tank)
    assert not rows(short, log)["at an end of its stroke"].passed
    assert log.actual.max() < middle - 0.01 + 1e-3


def test_pressure_too_low_anywhere_on_the_tour_is_refused_with_cylinder_figures_and_time(module):
    """Enough at the start and at the end, not between: a swing through the horizontal."""
    scene = hydraulic(module)
    start, end = bend(scene, [0.0], [0.0]), bend(scene, [0.7], [0.0])
    held = (play(scene, q, q, 0.1, out_of_the_tank) for q in (start, end))
    used = [drives.check_actuators(Evidence(Site(scene), log)).value for log in held]
    assert used[1] > 1.2 * used[0]
    pressure = next(iter(scene.manipulator.cylinders.values())).pressure
    low = weaken(scene, pressure=pressure * 0.5 * sum(used))
    play(low, start, start, 0.1, out_of_the_tank)
    with pytest.raises(DescriptionError, match=r"MPa, which holds .* kN; allowed: at least .* m1/actuator.* after \d"):
        play(low, start, end, 4.0, out_of_the_tank)


def test_pressures_that_do_not_make_up_the_force_or_leave_their_range_fail_their_rows(module):
    scene = hydraulic(module)
    q, supply = bend(scene, [0.6], [0.4]), next(iter(scene.manipulator.cylinders.values())).pressure
    log = play(scene, q, q, 0.1, out_of_the_tank)
    names = ("chamber pressures against drive force", "chamber pressure over supply")
    names += ("least chamber pressure above the tank's",)
    wrong = (log.pressure * [1.05, 1.0], np.full_like(log.pressure, 1.01 * supply), np.full_like(log.pressure, -1e3))
    for name, pressure in zip(names, wrong, strict=True):
        assert rows(scene, log)[name].passed
        assert not rows(scene, dataclasses.replace(log, pressure=pressure))[name].passed
    unlogged = dataclasses.replace(log, pressure=np.zeros((0, 0, 2)))
    assert not any(rows(scene, unlogged)[name].passed for name in names)


@pytest.mark.parametrize("members", ["rigid", "elastic"])
def test_goals_are_aimed_at_with_what_servos_give_under_load(cylinders, members):
    scene = change(cylinders, drive="servo", members=members, servo_stiffness=5e7)
    chain, simulation = Site(scene).chain, scene.task.simulation
    leg, goal = plan_tour(Site(scene)).legs[0], scene.task.motion.goals[0]
    elastic = make_elastic_model(chain, scene.task.payload, simulation.gravity, lumped=True)
    spring = np.where(elastic.spring > 0, 1e13 if members == "rigid" else elastic.spring, 0.0)
    rod, oil = np.full(elastic.rod.shape, 5e7), np.full(elastic.oil.shape, np.inf)
    unloaded = chain.nodes(chain.inputs_from_lengths(leg.lengths[-1]))
    held = settle(dataclasses.replace(elastic, spring=spring, rod=rod, oil=oil), unloaded)
    assert np.linalg.norm(tool_point(elastic.loads, held) - goal.position) < 2e-4
    assert np.linalg.norm(tool_point(elastic.loads, unloaded) - goal.position) > 5e-3  # it gives, and visibly


@pytest.mark.slow
def test_shipped_scene_on_cylinders_passes_every_check(cylinders):
    log = run(Site(cylinders), plan_tour(Site(cylinders)))
    report = verify(Site(cylinders), log)
    assert report.passed, [check for check in report.checks if not check.passed]
    assert log.pressure.shape == (*log.actual.shape, 2)
    assert np.ptp(log.pressure, axis=0).min() > 1e4  # every chamber worked


@pytest.mark.slow
def test_the_same_tour_on_servos_passes_too(cylinders):
    scene = change(cylinders, drive="servo")
    log = run(Site(scene), plan_tour(Site(scene)))
    report = verify(Site(scene), log)
    assert report.passed, [check for check in report.checks if not check.passed]
    assert not log.pressure.size
