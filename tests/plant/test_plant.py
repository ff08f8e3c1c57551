"""The plant as its clients step it: commands, states, records, refusals, and what stops it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, shorten

from vgtsim.description import AllowedContact
from vgtsim.errors import AssemblyError, CommandError, StoppedError
from vgtsim.log import RunLog
from vgtsim.mjcf import build_spec, finish_model
from vgtsim.planning import Leg, Tour
from vgtsim.plant import Plant, run
from vgtsim.site import Site
from vgtsim.statics import solve_members

pytestmark = pytest.mark.long

PLACED = 1e-9  # m: state against kinematics at the end of a hold
FOLLOWED = 1e-6  # m: what a rigid drive leaves of a step of the command, 2 ratio² time constants
FORCE = (
    1e-6  # of the greatest: drive forces of the state against those of the sensors, which see the rod's mass besides
)
SCENES = {
    "rigid": {},
    "servo": {"drive": "servo"},
    "springs": {"members": "elastic", "timestep": 2e-3, "log_rate": 100.0, "damping_ratio": 0.5},
    "hydraulic": {
        "members": "elastic",
        "drive": "hydraulic",
        "timestep": 2e-3,
        "log_rate": 100.0,
        "damping_ratio": 0.5,
        "member_mass": "lumped",
    },
}


@pytest.fixture(scope="module")
def scene(reach_scene):
    return change(shorten(reach_scene, 1), timestep=5e-3)


@pytest.fixture(scope="module")
def sites(scene):
    return {name: Site(change(scene, **settings)) for name, settings in SCENES.items()}


@pytest.fixture(scope="module")
def site(sites):
    return sites["rigid"]


@pytest.fixture(scope="module")
def postures(scene):
    return bend(scene, [0.2], [0.0]), bend(scene, [0.3], [0.4])


@pytest.fixture(scope="module")
def lengths(site, postures):
    """From one posture to another in 0.5 s."""
    s = np.linspace(0, 1, 101)[:, None]
    s = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
    return site.chain.lengths(postures[0] + s * (postures[1] - postures[0]))


@pytest.fixture
def plant(site, postures):
    plant = Plant(site)
    plant.reset(inputs=postures[0])
    return plant


def assert_equal(log, other):
    for item in dataclasses.fields(RunLog):
        if item.name != "performance":
            assert np.array_equal(getattr(log, item.name), getattr(other, item.name)), item.name


def test_a_plant_stepped_by_hand_gives_the_log_of_the_tour(site, postures, lengths):
    """Reading the state at every step changes nothing."""
    tour = Tour(postures[0], (Leg("goal", 0, lengths, postures[1], 1.0, "nothing"),), site.timestep)
    plant, hold = Plant(site), round(site.task.motion.hold / tour.timestep)
    plant.reset(lengths[0], postures[0])
    plant.step(hold)
    plant.mark(0)
    for row in lengths[1:]:
        plant.command(row)
        plant.step()
        assert plant.state.time == plant.time
    while not plant.state.calm:
        plant.step()
    plant.mark(0, settled=True)
    for _ in range(hold):
        plant.step()
        assert not plant.state.stopped
    log = run(site, tour)
    assert log.digests == plant.log.digests | {"programme": tour.digest}
    assert_equal(plant.log, dataclasses.replace(log, digests=plant.log.digests))


@pytest.mark.parametrize("name", SCENES)
def test_a_reset_plant_does_the_same_again(sites, postures, lengths, name):
    plant, logs = Plant(sites[name]), []
    for _ in range(2):
        plant.reset(lengths[0], postures[0])
        for row in lengths[1:40]:
            plant.command(row)
            plant.step()
        logs.append(plant.log)
    assert_equal(*logs)


def test_a_second_plant_of_a_site_has_a_model_of_its_own(site):
    first, second = Plant(site), Plant(site)
    first.model.eq_data[:] = 7.0
    assert not np.array_equal(first.model.eq_data, second.model.eq_data)


def test_the_state_is_that_of_kinematics_at_rest(plant, site, postures):
    plant.step(10)
    state, chain = plant.state, site.chain
    position, direction = chain.tool(postures[0])
    assert np.abs(state.nodes - chain.nodes(postures[0])).max() < PLACED + FOLLOWED
    assert np.abs(state.lengths - chain.lengths(postures[0])).max() < FOLLOWED
    assert np.abs(state.tool_position - position).max() < FOLLOWED
    assert np.abs(state.tool_direction - direction).max() < FOLLOWED
    assert np.abs(state.tool_rotation.T @ state.tool_rotation - np.eye(3)).max() < PLACED
    assert np.abs(state.rates).max() < FOLLOWED
    assert state.calm
    assert not state.contacts
    with pytest.raises(ValueError, match="read-only"):
        state.nodes[0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.time = 1.0


@pytest.mark.parametrize("name", SCENES)
def test_drive_forces_of_the_state_are_those_that_the_sensors_log(sites, postures, name):
    """At rest and when shaken by a step of the rate."""
    plant = Plant(sites[name], record_rate=1 / sites[name].timestep)
    plant.reset(inputs=postures[0])
    for rate in (0.0, 0.01):
        plant.command(rates=[2 * rate, rate, 0.0])
        plant.step(10)
        logged = plant.log.actuator_force[-1]
        assert np.abs(logged).max() > 1e3
        assert np.abs(plant.state.drive_force - logged).max() < FORCE * np.abs(logged).max()


def test_rates_move_the_cylinders_until_they_are_told_otherwise(plant):
    begin, rates = plant.state.commanded, np.array([0.01, 0.0, -0.005])
    plant.command(rates=rates)
    plant.step(100)
    assert plant.state.commanded == pytest.approx(begin + 100 * plant.timestep * rates, abs=1e-12)
    assert np.abs(plant.state.lengths - plant.state.commanded).max() < 1e-4
    assert not plant.calm
    plant.command(rates=np.zeros(3))
    plant.step(100)
    assert plant.state.commanded == pytest.approx(begin + 100 * plant.timestep * rates, abs=1e-12)
    assert plant.calm
    plant.command(rates=rates)
    plant.command(begin)  # in place of rates that were not zero
    plant.step(2)
    assert np.array_equal(plant.state.commanded, begin)


def test_the_last_lengths_are_held(plant, lengths):
    plant.command(lengths[1])
    plant.step(20)
    assert np.array_equal(plant.state.commanded, lengths[1])
    assert np.abs(plant.state.lengths - lengths[1]).max() < FOLLOWED


def test_a_plant_takes_the_step_that_it_is_given(site, lengths):
    """As a model built for that step would; a step half as long falls behind the command half as far."""
    late = []
    for step in (4e-3, 2e-3):
        plant = Plant(site, timestep=step, record_rate=50.0)
        exact = finish_model(build_spec(site, timestep=step), site)
        assert plant.model.opt.timestep == exact.opt.timestep == step
        assert np.array_equal(plant.model.eq_solref, exact.eq_solref)
        plant.reset(lengths[0])
        plant.command(rates=np.full(3, 0.01))
        plant.step(round(0.2 / step))
        assert plant.time == pytest.approx(0.2)
        assert np.allclose(np.diff(plant.log.time), 0.02)
        late.append(np.abs(plant.state.lengths - plant.state.commanded).max())
    assert late[1] == pytest.approx(late[0] / 2, rel=0.05)


@pytest.mark.parametrize(
    ("rate", "steps"),
    [
        (200.0, np.arange(60)),
        (25.0, np.arange(0, 60, 8)),
        (80.0, np.ceil(np.arange(24) * 2.5)),  # no whole fraction of 200 Hz: the first step at or after each instant
        (0.0, []),
    ],
)
def test_records_come_at_the_rate_asked_for(site, postures, rate, steps):
    plant = Plant(site, record_rate=rate)
    plant.reset(inputs=postures[0])
    plant.step(60)
    assert plant.log.time == pytest.approx(np.array(steps) * plant.timestep)
    assert plant.log.nodes.shape == (len(steps), len(site.truss.nodes), 3)


def test_the_rate_of_records_may_change_on_the_way(site, postures):
    plant = Plant(site, record_rate=20.0)
    plant.reset(inputs=postures[0])
    plant.step(20)
    plant.record_rate = 200.0
    plant.step(3)
    plant.record_rate = 50.0
    plant.step(8)
    assert plant.log.time == pytest.approx(np.array([0, 10, 20, 21, 22, 23, 27]) * plant.timestep)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"lengths": [1.0, 2.0]}, r"lengths: found shape \(2,\); allowed: shape \(3,\)"),
        ({"lengths": [1.0, np.nan, 2.0]}, "lengths: found nan at 1; allowed: finite"),
        ({"rates": [0.0, 0.0, np.inf]}, "rates: found inf at 2"),
        ({"lengths": ["long", 1.0, 2.0]}, "lengths: .*3 numbers"),
        ({}, "either lengths or rates"),
        ({"lengths": [1.0] * 3, "rates": [0.0] * 3}, "either lengths or rates"),
    ],
)
def test_wrong_commands_are_refused_by_name_and_change_nothing(plant, given, said):
    before = plant.state.commanded
    with pytest.raises(CommandError, match=said):
        plant.command(**given)
    plant.step()
    assert np.array_equal(plant.state.commanded, before)


def test_wrong_resets_steps_and_rates_are_refused(site):
    with pytest.raises(CommandError, match=r"timestep: found 0 s"):
        Plant(site, timestep=0.0)
    with pytest.raises(CommandError, match=r"record_rate: found 1000 Hz; allowed: 0 to 200 Hz"):
        Plant(site, record_rate=1000.0)
    plant = Plant(site)
    with pytest.raises(CommandError, match="inputs: found mid-plane normal lies in the base plane"):
        plant.reset(inputs=np.full(3, 2.0))
    assert not len(plant.log.time)
    with pytest.raises(CommandError, match=r"inputs: found shape \(2,\)"):
        plant.reset(inputs=[0.0, 0.0])
    for act in (plant.step, lambda: plant.command(rates=np.zeros(3)), lambda: plant.state):
        with pytest.raises(StoppedError, match="not been reset"):
            act()


def test_a_reset_that_is_refused_changes_nothing(plant):
    plant.step(3)
    with pytest.raises(CommandError, match="lengths"):
        plant.reset([1.0, np.inf, 1.0])
    with pytest.raises(AssemblyError):
        plant.reset([9.0, 0.1, 0.1])
    assert plant.time == pytest.approx(3 * plant.timestep)
    plant.step()


@pytest.mark.parametrize("name", ["rigid", "servo", "hydraulic"])
@pytest.mark.parametrize("allowed", [False, True], ids=["collision", "allowed"])
def test_a_contact_stops_what_does_not_yield_or_may_not_touch_and_says_what_touched(sites, postures, name, allowed):
    site = sites[name]
    if allowed:
        contacts = (AllowedContact(part="tool", place="shell"),)
        site = Site(dataclasses.replace(site.scene, task=site.task.model_copy(update={"contacts": contacts})))
    spec = build_spec(site)
    block = spec.worldbody.add_geom(name="tank/block", type=6, size=[3, 3, 0.1], contype=1, conaffinity=0)
    lowest = site.chain.tool(postures[0])[0][2] - site.task.payload.radius
    block.pos = [0, 0, lowest - 0.101]
    plant = Plant(site, model=finish_model(spec, site))
    plant.reset(inputs=postures[0])
    plant.command(rates=np.full(3, -0.02))  # closer mid-planes stretch the module
    for _ in range(400):
        plant.step()
        if plant.state.contacts:
            break
    contact = plant.state.contacts[0]
    assert "tank/block" in contact[1:3]
    assert contact.time == pytest.approx(plant.time)
    assert contact.gap <= 0
    if allowed and name != "rigid":
        plant.step()
        assert not plant.stopped
        assert plant.state.contacts[0].force[2] > 0  # the block holds the arm up
        return
    assert plant.log.contact_pair[0].tolist() == [contact.first, contact.second]
    assert np.isfinite(contact.force).all() == (name != "rigid")
    assert ("pressed with" in plant.stopped) == (name != "rigid")
    assert plant.log.stopped == plant.state.stopped == plant.stopped
    assert plant.stopped.startswith(f"collision of {contact.first} with {contact.second} at t = ")
    time = plant.time
    for act in (plant.step, lambda: plant.command(rates=np.zeros(3))):
        with pytest.raises(StoppedError, match=r"collision of .*block"):
            act()
    assert plant.time == time
    plant.reset(inputs=postures[0])
    assert not plant.stopped
    plant.step()


@pytest.mark.parametrize("members", ["rigid", "sections"])
def test_forces_now_are_those_of_the_log_and_of_statics_at_the_start(scene, members):
    site = Site(change(scene, members=members, timestep=20e-3, log_rate=50.0))
    plant = Plant(site)
    plant.reset()
    still = plant.axial
    plant.command(rates=np.full(len(site.truss.actuated), 2e-3))
    plant.step(8)
    axial, log = plant.axial, plant.log.axial(site.truss.ends)[-1]
    assert np.abs(axial - log).max() < FORCE * np.abs(log).max()
    statics = solve_members(site.load_model, plant.log.nodes[0]).near_axial
    assert np.abs(still - statics).max() < 1e-3 * np.abs(statics).max()  # the posture is kept to rounding by the drives
    assert np.abs(axial - still).max() > FORCE * np.abs(log).max()
