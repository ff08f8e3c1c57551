"""Rollouts: the bits of stepping alone, and kinematics and plant within the accuracy that is told."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from playing import bend, change, climb, hoist, shorten

from vgtsim.batch import Batch
from vgtsim.errors import CommandError
from vgtsim.plant import Plant
from vgtsim.site import Site

STEP, SECONDS = 0.02, 2.0
KIND = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
CLOSED, FOLLOWED = 2e-5, 1e-4  # m: loops, and tool, of rollouts at 20 ms and rated speeds


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(hoist(change(shorten(reach_scene, 2), timestep=STEP, log_rate=50.0)))


@pytest.fixture(scope="module")
def batch(site):
    with Batch(site, threads=2) as batch:
        yield batch


@pytest.fixture(scope="module")
def motion(site):
    """Inputs of three smooth motions from one pose, shape (3, T, 6)."""
    start = bend(site.scene, [0.2, 0.25], [0.0, 1.0])
    ends = [bend(site.scene, angles, [0.3, 1.2]) for angles in ([0.22, 0.25], [0.2, 0.22], [0.18, 0.28])]
    s = climb(1.0, SECONDS, STEP)[1:, None]
    return start, np.array([start + s * (end - start) for end in ends])


def step_alone(batch, state, lengths, feed):
    data, found = mujoco.MjData(batch.model), np.empty_like(state)
    mujoco.mj_setState(batch.model, data, state, KIND)
    states = []
    for row, lift in zip(lengths, feed, strict=True):
        data.ctrl[0], data.ctrl[1:] = lift, row
        mujoco.mj_step(batch.model, data)
        mujoco.mj_getState(batch.model, data, found, KIND)
        states.append(found.copy())
    return np.array(states)


def test_rollouts_have_the_bits_of_stepping_alone(site, batch, motion):
    start, q = motion
    lengths, states = site.chain.lengths(q), np.repeat(batch.stand(start), 3, axis=0)
    feed = np.linspace(0.0, [0.0, 0.1, 0.2], len(q[0])).T
    played = batch.play(states, lengths, feed)
    for found, state, rows, lifts in zip(played.states, states, lengths, feed, strict=True):
        assert np.array_equal(found, step_alone(batch, state, rows, lifts))
    assert np.array_equal(batch.play(states, lengths, feed).states, played.states)


def test_rollouts_follow_kinematics_as_far_as_told(site, batch, motion):
    start, q = motion
    played = batch.play(np.repeat(batch.stand(start), 3, axis=0), site.chain.lengths(q))
    off = np.linalg.norm(played.tool - site.chain.tool(q)[0], axis=-1)
    assert off.max() < FOLLOWED
    assert batch.measure_gaps(played.states).max() < CLOSED
    assert np.abs(played.lengths - site.chain.lengths(q)).max() < 1e-6
    assert np.ptp(played.tool, axis=1).max() > 0.05  # they moved


def test_a_rollout_is_near_the_plant(site, batch, motion):
    start, q = motion
    lengths = site.chain.lengths(q[0])
    played, plant = batch.play(batch.stand(start), lengths[None]), Plant(site, record_rate=0)
    plant.reset(inputs=start)
    for row, tool in zip(lengths, played.tool[0], strict=True):
        plant.command(row)
        plant.step()
        assert plant.state.tool_position == pytest.approx(tool, abs=FOLLOWED)


def test_a_policy_plays_in_pieces(site, batch, motion):
    """Pieces differ from the whole by the solver's start alone."""
    start, q = motion
    lengths = site.chain.lengths(q)
    states = whole = np.repeat(batch.stand(start), 3, axis=0)
    for piece in np.split(lengths, 5, axis=1):
        states = batch.play(states, piece).last
    assert states == pytest.approx(batch.play(whole, lengths).last, abs=1e-8)


def test_bad_input_is_named(site, batch, motion):
    state, rows = batch.stand(motion[0]), site.chain.lengths(motion[1])[:1]
    with pytest.raises(CommandError, match=r"lengths: found shape \(1, 100, 5\); allowed: shape \(1, T, 6\)"):
        batch.play(state, rows[..., :5])
    with pytest.raises(CommandError, match=r"states: found shape \(1, 3\)"):
        batch.play(state[:, :3], rows)
    with pytest.raises(CommandError, match="not finite"):
        batch.play(state, np.where(rows == rows[0, 3, 2], np.nan, rows))
    with pytest.raises(CommandError, match=r"feed: found shape \(2,\)"):
        batch.play(state, rows, np.zeros(2))
    with pytest.raises(CommandError, match="threads: found 0"):
        Batch(site, threads=0)


@pytest.mark.parametrize("name", ["stewart", "arm9", "arm15"])
def test_warp_takes_the_models(name):
    warp = pytest.importorskip("mujoco_warp", reason="vgtsim[batch] is not installed")
    import vgtsim

    warp.put_model(vgtsim.load_model(name))
