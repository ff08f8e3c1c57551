"""A scripted policy to compare with: resolved rate towards the goal, or lengths straight to the posture."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.envs.arm_env import PERIOD, ArmEnv
from vgtsim.envs.tasks import Entrance
from vgtsim.planning import plan_insertion
from vgtsim.site import Site

_GAIN = 0.4  # of what is left, a second
_DAMPING = 0.05  # of the least squares: keeps rates finite near singular postures
_SPEED, _TURN = 0.4, 0.2  # m/s and rad/s that are asked for at the most
# m: of the feed, by which lengths lead; off which lengths stop it; and by which it goes on at its end.
_AHEAD, _LATE, _CLOSE = 0.1, 0.04, 0.02
_KNOTS = 1500  # of the planned way: a centimetre of feed apart


def steer(env: ArmEnv) -> NDArray[np.float32]:
    """An action of an environment (`env.unwrapped`) that takes the tool straight to the goal; clearance is not looked at."""
    wanted = _follow(env) if isinstance(env.task, Entrance) else _reach(env)
    wish = wanted / env.rated
    wish /= max(float(np.abs(wish).max()), 1.0)  # all at once slower: the tool keeps its course
    if env.action == "lengths":
        aim = env.place + wish * env.rated * PERIOD
        wish = (2 * aim - env.low - env.high) / (env.high - env.low)
    return wish.astype(np.float32)


def _reach(env: ArmEnv) -> Array:
    """Rates of the cylinders, m/s, for a tool that goes straight to the goal."""
    state, goal = env.tier.state, env.goal
    position, direction = (item[0] for item in state.tool)
    J = state.tool_jacobian[0]
    v = _limit(_GAIN * (goal.position - position), _SPEED)
    w = _limit(_GAIN * np.cross(direction, goal.direction), _TURN)
    across = np.eye(3) - np.outer(direction, direction)  # the spin about the tool is free
    rows = np.concatenate([J[:3], across @ J[3:]])
    by_length = rows @ env.site.chain.input_rates(state)[0]
    square = by_length @ by_length.T + _DAMPING**2 * np.eye(6)
    return by_length.T @ np.linalg.solve(square, np.concatenate([v, w]))


def _follow(env: ArmEnv) -> Array:
    """Rates of the cylinders and the feed, m/s, along the planned way: lengths first, then down as far as they are there."""
    feed, lengths = _plan_way(env.site)
    ahead = max(env.tier.feed - _AHEAD, 0.0)
    wanted = [np.interp(ahead, feed, column) for column in lengths.T]
    off = np.array(wanted) - env.tier.lengths
    down = -_GAIN * (env.tier.feed - ahead + _CLOSE) * max(0.0, 1 - float(np.abs(off).max()) / _LATE)
    return np.append(_GAIN * off, down)


@lru_cache(maxsize=4)
def _plan_way(site: Site) -> tuple[Array, Array]:
    """Feeds, rising, shape (K,), m, and lengths there, shape (K, J), m, of the planned insertion; it takes seconds."""
    way, s = plan_insertion(site), np.linspace(1.0, 0.0, _KNOTS)
    return np.maximum.accumulate(way.feed(s).ravel()), site.chain.lengths(way.spline(s))


def _limit(vector: Array, most: float) -> Array:
    return vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-12))
