"""The closure correction: what it rests on in MuJoCo, and what it does for loops, nodes and speeds in long steps."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from offset_arms import with_offset
from playing import shorten

from vgtsim.description import load_manipulator
from vgtsim.description.motion import Bend
from vgtsim.mjcf import build_model, names
from vgtsim.mjcf.rows import SOLIMP, SOLREF_RATIO, SOLREF_STEPS
from vgtsim.plant import Plant
from vgtsim.plant.correction import Correction, Foresight
from vgtsim.site import Site

STEP = 0.02  # s; four times what the same arm needs without a correction
IMPEDANCE = SOLIMP[1]
K, B = 1 / (IMPEDANCE * (SOLREF_STEPS * SOLREF_RATIO) ** 2), 2 / (IMPEDANCE * SOLREF_STEPS)  # of a row, a step's
LAW = 1e-11  # m: rounding of the solver in the law of a row
LOOPS = 1e-7  # m: gap when accelerations jump at every second step, at 20 ms
SAME = 1e-13  # m: two ways to the same departure


@pytest.fixture(scope="module")
def scene(reach_scene):
    return shorten(reach_scene, 2)


@pytest.fixture(scope="module")
def site(scene):
    return Site(scene)


@pytest.fixture(scope="module")
def sites(site):
    """The arm, the same with joint blocks, and an octahedral module between two of its own."""
    scene, motion = site.scene, site.task.motion
    mixed = load_manipulator("mixed")
    straight = scene.task.model_copy(
        update={"motion": motion.model_copy(update={"start": (Bend(),) * len(mixed.active)})}
    )
    return {
        "double octahedra": site,
        "joint offset": Site(dataclasses.replace(scene, manipulator=with_offset(scene.manipulator))),
        "mixed": Site(dataclasses.replace(scene, manipulator=mixed, task=straight)),
    }


def wander(site, seconds, jump=0.1):
    """Lengths by an erratic hand, step by step: speeds go to random ones, up to 20 mm/s and newly drawn every 0.1 s."""
    rng = np.random.default_rng(3)
    lengths = [site.chain.lengths(site.start)]
    speed = wanted = np.zeros(len(lengths[0]))
    for step in range(round(seconds / STEP)):
        if step % 5 == 0:
            wanted = rng.uniform(-0.02, 0.02, len(speed))
        speed = speed + np.clip(wanted - speed, -jump * STEP, jump * STEP)
        lengths.append(lengths[-1] + speed * STEP)
    return lengths


def free(site):
    """The site's model, touched by nothing."""
    model = build_model(site)
    model.geom_contype[:] = model.geom_conaffinity[:] = 0
    return model


def follow(site, lengths, watch=lambda _: None):
    """Step through lengths from rest at the first; returns the greatest gap of a member's end from its hub, m."""
    plant = Plant(site, timestep=STEP, record_rate=1 / STEP, model=free(site))
    plant.reset(lengths[0], site.start)
    for row in lengths[1:]:
        plant.command(row)
        plant.step()
        watch(plant)
    log, ends = plant.log, site.truss.ends
    return float(np.linalg.norm(log.ends - log.nodes[:, ends], axis=-1).max())


def test_two_halves_of_a_step_are_a_step(site):
    """Bit for bit, in motion."""
    model = free(site)
    model.opt.timestep = STEP
    first, second = mujoco.MjData(model), mujoco.MjData(model)
    for _ in range(10):
        mujoco.mj_step(model, first)
        mujoco.mj_step1(model, second)
        mujoco.mj_step2(model, second)
        for name in ("qpos", "qvel", "qacc", "efc_force", "sensordata"):
            assert np.array_equal(getattr(first, name), getattr(second, name)), name


def test_the_second_half_of_a_step_reads_the_gaps_and_meets_them_by_the_law_of_a_row(site):
    """The correction rests on this law; with the gaps as they were before they were changed it must fail."""
    plant = Plant(site, timestep=STEP, model=free(site))
    plant.reset()
    model, data = plant.model, plant.data
    rng = np.random.default_rng(1)
    for _ in range(3):
        mujoco.mj_step1(model, data)
        before, speed = np.array(data.efc_pos), STEP * np.array(data.efc_vel)
        p = before + rng.uniform(-1e-5, 1e-5, before.shape)
        data.efc_pos[:] = p
        mujoco.mj_step2(model, data)
        met = np.empty(data.nefc)
        mujoco.mj_mulJacVec(model, data, met, data.qvel)
        left = STEP * met + STEP**2 * data.efc_R * data.efc_force
        assert np.abs(left - (speed - K * p) / (1 + B + K)).max() < LAW
        assert np.abs(left - (speed - K * before) / (1 + B + K)).max() > 1e5 * LAW


def test_the_departure_of_a_spinning_bar_is_that_of_a_finite_turn(site):
    """By Rodrigues' formula, for a member between two hubs, with speeds that nothing restrains."""
    plant = Plant(site, timestep=STEP, model=free(site))
    plant.reset()
    model, data = plant.model, plant.data
    correction = Correction(model, data, None)
    correction.step(plant.state.lengths)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    member = next(
        item for item in site.truss.members if item.role == "longeron" and item.ends[1] < len(site.truss.nodes) - 3
    )
    ball = model.joint(member.name).dofadr[0]
    w = np.array([1.0, -2.0, 5.0])
    data.qvel[:] = 0.0
    data.qvel[ball : ball + 3] = w
    mujoco.mj_step1(model, data)
    correction._past = np.array([data.qvel, data.qvel])
    found = correction._find_departures(plant.state.lengths, (0.0, 0.0))[correction._closures[:, None] + np.arange(3)]
    R, length = data.site(names.near(member.name)).xmat.reshape(3, 3), model.site(names.far(member.name)).pos[2]
    angle = np.linalg.norm(w) * STEP
    K = np.cross(w / np.linalg.norm(w), np.eye(3)).T
    arc = np.sin(angle) * K + (1 - np.cos(angle)) * K @ K - angle * K
    rows = model.equality(names.closure(member.name)).id
    place = list(data.efc_id[correction._closures]).index(rows)
    assert np.abs(found[place] - R @ arc[:, 2] * length).max() < SAME
    assert np.abs(found[place]).max() > 1e-4
    others = np.delete(found, place, axis=0)
    assert np.abs(others).max() < SAME


@pytest.mark.parametrize("name", ["double octahedra", "joint offset", "mixed"])
def test_an_erratic_hand_leaves_loops_closed(sites, name):
    assert follow(sites[name], wander(sites[name], 1.0)) < LOOPS


def test_without_foresight_or_without_a_correction_they_open(site, monkeypatch):
    """Both halves of the idea are needed, so both are at work."""
    lengths = wander(site, 1.0)
    closed = follow(site, lengths)
    monkeypatch.setattr(Foresight, "correct", lambda *_: None)
    assert follow(site, lengths) > 10 * closed
    monkeypatch.setattr(Correction, "_find_departures", lambda self, *_: np.zeros(self._count))
    assert follow(site, lengths) > 300 * closed


@pytest.mark.parametrize(("name", "left"), [("double octahedra", 0.02), ("joint offset", 0.1), ("mixed", 0.02)])
def test_turns_are_foreseen_where_accelerations_jump(sites, name, left, monkeypatch):
    """Against the speeds that the step then has, of all turns that kinematics determines.

    Blocks also spin idly, which nobody foresees, and what hangs from them turns with them.
    """
    site, seen = sites[name], []
    correct = Foresight.correct

    def note(self, data, lengths, feed, speeds):
        guess = np.array(speeds)
        correct(self, data, lengths, feed, speeds)
        seen.append((guess, np.array(speeds)))

    monkeypatch.setattr(Foresight, "correct", note)
    errors = []

    def watch(plant):
        joints = plant._correction._foresight._turns._joints
        turned = np.concatenate([joints.balls[:, :2].ravel(), joints.tip, joints.turns[:, :2].ravel(), joints.pins])
        errors.append([np.abs(speeds - plant.data.qvel)[turned].max() for speeds in seen[-1]])

    follow(site, wander(site, 0.4), watch)
    guessed, foreseen = np.array(errors).max(axis=0)
    assert foreseen < left * guessed


class Weight:
    """A force on the tip plate."""

    def __init__(self, force: float) -> None:
        self.force = force

    def press(self, data: mujoco.MjData, wrenches: np.ndarray) -> None:
        wrenches[data.body(names.TIP).id, 2] += self.force


def test_loads_on_one_body_add_up_in_each_step_and_leave_those_of_others(site):
    plant = Plant(site, timestep=STEP)
    plant.reset()
    loads = Weight(3.0), Weight(4.0)
    plant._correction._loads = loads
    tip = plant.data.body(names.TIP).id
    plant.data.xfrc_applied[tip, 2] = 10.0  # of somebody else
    plant.step(3)
    assert plant.data.xfrc_applied[tip, 2] == pytest.approx(17.0)
    loads[0].force = -3.0
    plant.step()
    assert plant.data.xfrc_applied[tip, 2] == pytest.approx(11.0)
