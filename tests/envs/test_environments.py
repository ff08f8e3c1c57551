"""Environments: Gymnasium's checks without a warning, seeds, limits, both tiers alike, and a policy that gets there."""

from __future__ import annotations

import itertools
import os
import warnings

import numpy as np
import pytest

from vgtsim.errors import CommandError, MissingLibraryError

gymnasium = pytest.importorskip("gymnasium", reason="vgtsim[env] is not installed")

from gymnasium.envs.mujoco.utils import check_mujoco_reset_state  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

from vgtsim.envs import IDS, steer  # noqa: E402
from vgtsim.envs.arm_env import DONE, EFFORT, FAULT, PERIOD  # noqa: E402

TIERS_AGREE = 1e-5  # m and parts of an observation: single precision


def make(name="vgtsim/Reach-arm9-v0", **settings):
    return gymnasium.make(name, **settings).unwrapped


@pytest.fixture(autouse=True)
def strict():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("action", ["rates", "lengths"])
def test_gymnasium_has_nothing_against_the_fast_tier(name, action):
    check_env(make(name, action=action), skip_render_check=True)


@pytest.mark.long
@pytest.mark.parametrize("name", IDS)
def test_gymnasium_has_nothing_against_the_exact_tier(name):
    env = make(name, tier="exact")
    check_env(env, skip_render_check=True)
    check_mujoco_reset_state(env)


@pytest.mark.parametrize("tier", ["fast", "exact"])
def test_a_seed_gives_the_same_bits(tier):
    runs = []
    for _ in range(2):
        env = make(tier=tier)
        env.action_space.seed(5)
        seen = [env.reset(seed=7)[0]]
        for _ in range(4):
            observation, reward, *_ = env.step(env.action_space.sample())
            seen += [observation, np.array([reward])]
        runs.append(np.concatenate(seen))
    assert np.array_equal(*runs)
    assert not np.array_equal(env.reset(seed=8)[0], runs[0][: len(seen[0])])


@pytest.mark.parametrize("action", ["rates", "lengths"])
@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_rates_accelerations_and_strokes_are_kept(action, value):
    """One cylinder to the end of its stroke; rates by differences of lengths."""
    env = make("vgtsim/Reach-arm15-v0", action=action)
    env.reset(seed=0)
    lengths = [env.place]
    for _ in range(40):  # beyond a touch: kinematics go on
        env.step(np.append(np.float32(value), np.zeros(14, np.float32)))
        lengths.append(env.place)
    rates = np.diff(lengths, axis=0) / PERIOD
    assert np.abs(rates).max() < env.rated[0] * (1 + 1e-9)
    assert np.abs(rates).max() > 0.9 * env.rated[0]
    assert np.abs(np.diff(rates, axis=0)).max() < env.site.task.motion.acceleration * PERIOD * (1 + 1e-6)
    assert np.all(np.array(lengths) < env.high + 1e-9)
    assert np.all(np.array(lengths) > env.low - 1e-9)


@pytest.mark.long
@pytest.mark.parametrize("members", ["sections", "rigid"])
def test_both_tiers_say_the_same_while_nothing_touches(members):
    fast, exact = make(), make(tier="exact", members=members)
    assert np.abs(fast.reset(seed=3)[0] - exact.reset(seed=3)[0]).max() < TIERS_AGREE
    for _ in range(10):
        action = steer(fast)
        one, other = fast.step(action), exact.step(action)
        assert one[0] == pytest.approx(other[0], abs=TIERS_AGREE)
        assert one[1] == pytest.approx(other[1], abs=TIERS_AGREE)
    assert fast.tier.state.q[0] == pytest.approx(exact.tier.state.q[0], abs=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow if "arm15" in name else pytest.mark.long] * ("Insertion" in name))
        for name in IDS
    ],
)
@pytest.mark.parametrize("action", ["rates", "lengths"])
def test_the_scripted_policy_gets_there(name, action):
    """And its return is what was left at first, less efforts, and the end's."""
    env = make(name, action=action)
    _, told = env.reset(seed=1)
    first, total, effort = told["left"], 0.0, 0.0
    for _ in range(gymnasium.spec(name).max_episode_steps):
        wish = steer(env)
        _, reward, done, _, told = env.step(wish)
        total, effort = total + reward, effort + EFFORT * float(np.mean(np.clip(wish, -1, 1) ** 2))
        if done:
            break
    assert told["is_success"], told
    assert total == pytest.approx(first - told["left"] + DONE - effort, abs=1e-6)  # actions are in single precision


def test_an_arm_that_opens_in_the_riser_touches_it():
    env = make("vgtsim/Insertion-arm9-v0")
    _, told = env.reset(seed=1)
    assert told["clearance"] == pytest.approx(0.0381, abs=1e-4)  # 1.5 in
    for _ in range(20):
        *_, done, _, told = env.step(np.append(np.ones(9, np.float32), np.float32(0)))
        if done:
            break
    assert told["fault"] == "the arm touches something"


def test_a_touch_ends_an_episode_with_its_fault():
    """Against the distance that plans are judged by."""
    env = make()
    env.reset(seed=0)
    reward, done, told, steps = 0.0, False, {}, 0
    action = np.random.default_rng(3).uniform(-1, 1, 9).astype(np.float32).round()
    while not done and steps < 50:
        assert env.site.surroundings.unloaded.least(env.tier.state.q[0])[0] > 0
        _, reward, done, _, told = env.step(action)
        steps += 1
    assert env.site.surroundings.unloaded.least(env.tier.state.q[0])[0] <= 0
    assert told["fault"] == "the arm touches something"
    assert reward == pytest.approx(FAULT, abs=1.0)


@pytest.mark.parametrize("mode", ["sync", pytest.param("async", marks=pytest.mark.long)])
def test_vectors_of_environments_have_the_rows_of_one(mode):
    """In one process, and with a process for each environment."""
    more = {"context": "spawn"} if mode == "async" else {}  # threads of libraries do not survive a fork
    vector = gymnasium.make_vec("vgtsim/Reach-arm9-v0", num_envs=2, vectorization_mode=mode, vector_kwargs=more)
    seen, _ = vector.reset(seed=[4, 5])
    action = np.tile(np.linspace(-1, 1, 9, dtype=np.float32), (2, 1))
    after, rewards, *_ = vector.step(action)
    vector.close()
    for k, seed in enumerate((4, 5)):
        env = make()
        assert np.array_equal(env.reset(seed=seed)[0], seen[k])
        observation, reward, *_ = env.step(action[k])
        assert np.array_equal(observation, after[k])
        assert reward == rewards[k]


@pytest.mark.render
@pytest.mark.long
def test_pictures_in_every_mode_without_a_window():
    env = make(render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (480, 640, 3)
    for _ in range(12):
        env.step(steer(env))
    assert np.mean(np.abs(first.astype(int) - env.render().astype(int)).max(axis=-1) > 20) > 1e-3  # it moved
    env.render_mode = "depth_array"
    assert np.ptp(env.render()) > 0
    env.render_mode = "rgbd_tuple"
    colour, depth = env.render()
    assert colour.shape[:2] == depth.shape
    env.close()


@pytest.mark.long
def test_a_window_is_drawn_anew_by_every_step(monkeypatch):
    """With a window that only counts: a machine that tests has no display."""
    drawn = []

    class Window:
        def __init__(self, model, data, *_, **__):
            self.data = data

        def render(self, mode):
            drawn.append((mode, self.data.qpos.copy()))

        def close(self):
            drawn.append("closed")

    monkeypatch.setattr("gymnasium.envs.mujoco.mujoco_rendering.MujocoRenderer", Window)
    monkeypatch.setattr("vgtsim.envs.picture.require_display", lambda: None)
    env = make(render_mode="human")
    env.reset(seed=1)
    for _ in range(2):
        env.step(steer(env))
    assert [mode for mode, _ in drawn] == ["human"] * 3
    assert all(np.abs(after - before).max() > 1e-4 for (_, before), (_, after) in itertools.pairwise(drawn))
    env.close()
    assert drawn[-1] == "closed"


@pytest.mark.long
@pytest.mark.skipif(any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")), reason="there is a display")
def test_a_window_without_a_display_is_refused_by_name():
    with pytest.raises(MissingLibraryError, match="a display"):
        make(render_mode="human").reset(seed=1)


def test_bad_choices_are_named():
    for settings, said in (
        ({"action": "force"}, r"action: found 'force'; allowed: 'rates' or 'lengths'"),
        ({"tier": "slow"}, r"tier: found 'slow'"),
        ({"task": "dance"}, r"task: found 'dance'; allowed: 'reach' or 'raster' or 'insertion'"),
    ):
        with pytest.raises(CommandError, match=said):
            make(**settings)
    with pytest.raises(CommandError, match="options"):
        make().reset(options={"goal": 1})
