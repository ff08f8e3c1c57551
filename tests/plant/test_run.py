"""The step loop: it plays what it is told, repeats itself, and stops when it must."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from playing import bend, change, play, shorten

from vgtsim.errors import DescriptionError, DivergenceError
from vgtsim.log import Contact, RunLog, open_log, save_log
from vgtsim.mjcf import build_model
from vgtsim.planning import Leg, Tour
from vgtsim.plant import run
from vgtsim.plant.watch import list_contacts, name_collision
from vgtsim.site import Site

pytestmark = pytest.mark.long

LAG = 1e-5  # m: a hundredth of what a lag of one step would be at this speed
SERVO_LAG = 3e-3  # m: 0.1 m/s times damping over stiffness, 0.01 s, and 1e5 N on 1e8 N/m


@pytest.fixture(scope="module")
def module_scene(reach_scene):
    return change(shorten(reach_scene, 1), timestep=5e-3)


@pytest.fixture(scope="module")
def motion(module_scene):
    return bend(module_scene, [0.2], [0.0]), bend(module_scene, [0.6], [0.8])


@pytest.fixture(scope="module")
def log(module_scene, motion):
    return play(module_scene, *motion, 4.0)


def test_actual_lengths_follow_the_command(log):
    assert np.abs(log.actual - log.commanded).max() < LAG


def test_arm_arrives_and_settles(log, module_scene, motion):
    position, _ = Site(module_scene).chain.tool(motion[1])
    assert log.settled[-1]
    assert np.allclose(log.tool_position[-1], position, atol=1e-6)


def test_records_are_at_the_log_rate(log, module_scene):
    assert np.allclose(np.diff(log.time), 1 / module_scene.task.simulation.log_rate)


def test_mast_carries_the_weight_at_rest(log, module_scene):
    arm, task = module_scene.manipulator, module_scene.task
    from vgtsim.statics.loads import make_load_model

    model = make_load_model(Site(module_scene).chain, task.payload, task.simulation.gravity)
    weight = model.mass * task.simulation.gravity
    assert log.mast_reaction[-1, :3] == pytest.approx([0, 0, weight], abs=1e-3)
    assert arm.name == "arm15"


def test_same_scene_gives_the_same_log(log, module_scene, motion):
    again = play(module_scene, *motion, 4.0)
    for item in dataclasses.fields(RunLog):
        if item.name not in ("performance",):
            assert np.array_equal(getattr(log, item.name), getattr(again, item.name)), item.name


def test_log_and_scene_survive_their_file(log, module_scene, tmp_path):
    save_log(tmp_path, module_scene, log)
    book = open_log(tmp_path)
    back = book.read(0, book.count)
    assert book.scene == module_scene
    for item in dataclasses.fields(RunLog):
        assert np.array_equal(getattr(log, item.name), getattr(back, item.name)), item.name


def test_arrays_of_a_log_cannot_be_written(log):
    with pytest.raises(ValueError, match="read-only"):
        log.nodes[0] = 0.0


def test_no_contact_and_no_warning_in_free_motion(log):
    assert not len(log.contact_time)
    assert not log.warnings


def test_servo_drive_follows_too(module_scene, motion):
    log = play(change(module_scene, drive="servo"), *motion, 4.0)
    assert np.abs(log.actual - log.commanded).max() < SERVO_LAG


def test_a_collision_ends_a_run_under_rigid_drives(module_scene, motion):
    def raise_floor(spec):
        block = spec.worldbody.add_geom(name="block", type=6, size=[3, 3, 0.1], contype=1, conaffinity=0)
        block.pos = [0, 0, module_scene.pivot_height - 2.9]

    log = play(module_scene, *motion, 4.0, raise_floor)
    assert "collision" in log.stopped
    assert log.stopped.endswith("under rigid drives")
    assert "block" in log.contact_pair[0]


def test_what_the_start_posture_touches_is_named(module_scene, motion):
    """Before time zero, while the constraints take up the weight."""

    def lift_block(spec):
        block = spec.worldbody.add_geom(name="block", type=6, size=[3, 3, 0.5], contype=1, conaffinity=0)
        block.pos = [0, 0, module_scene.pivot_height - 2.2]

    with pytest.raises(DescriptionError, match=r"motion\.start: found .*block.*; allowed: a posture clear"):
        play(module_scene, *motion, 0.1, lift_block)


def test_a_collision_says_which_drives_it_is_under():
    touching = SimpleNamespace(geom=(0, 1), dist=-0.001)
    model = SimpleNamespace(geom=lambda i: SimpleNamespace(name=("arm", "block")[i]))
    contacts = list_contacts(cast(Any, model), cast(Any, SimpleNamespace(contact=[touching], time=2.0)))
    assert contacts == [Contact(2.0, "arm", "block", -0.001)]
    for drive in ("rigid", "hydraulic", "servo"):
        assert name_collision(contacts[0], drive) == f"collision of arm with block at t = 2.000 s under {drive} drives"
    pressed = contacts[0]._replace(force=(0.0, 3e3, 4e3))
    assert "t = 2.000 s, pressed with 5 kN in the first step under" in name_collision(pressed, "servo")


def test_a_loop_that_cannot_close_stops_the_run_and_names_the_row(module_scene, motion):
    """Two batten actuators ordered to lengths whose sum is less than the third's."""
    chain, step = Site(module_scene).chain, Site(module_scene).timestep
    start = chain.lengths(motion[0])
    lengths = start + np.linspace(0, 1, 401)[:, None] * (np.array([2.6, 0.9, 0.9]) - start)
    program = Tour(motion[0], (Leg("apart", 0, lengths, motion[0], 1.0, "nothing"),), step)
    model = build_model(Site(module_scene))
    model.geom_contype[:] = model.geom_conaffinity[:] = 0  # or a collision would end it first
    with pytest.raises(DivergenceError) as caught:
        run(Site(module_scene), program, model)
    assert 0 < caught.value.time < 2.0
    assert caught.value.row.endswith(("/closure", "/drive"))
    assert isinstance(caught.value.log, RunLog)
    assert "diverged" in caught.value.log.stopped
