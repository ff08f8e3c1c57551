"""Where the next command takes an arm of imposed lengths: speeds of its joints, from kinematics, before the step is made."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain

Array = NDArray[np.float64]

_SMOOTH = 2e-7  # m: change of a cylinder's acceleration, times step², that opens a loop of the reference arm by 1e-8 m


class Turns(Protocol):
    """Knows what the joints of a model do for its hubs to come to given places."""

    def __call__(self, data: mujoco.MjData, nodes: Array, lengths: Array, speeds: Array) -> None:
        """Write speeds, shape (nv,), that lead to nodes, shape (N, 3), m, and lengths, shape (J,), m, within a step."""
        ...


class Foresight:
    """Foresees the speeds of a step from the lengths and the feed commanded for its end.

    Where the commands go on smoothly, the speeds of two steps tell the next ones as well and cost nothing; kinematics is
    asked where an acceleration jumps.
    """

    def __init__(self, turns: Turns, chain: Chain, q: Array, lengths: Array) -> None:
        """Start at rest at inputs, shape (n,), with lengths, shape (J,), m."""
        self._turns, self._chain = turns, chain
        self._last = chain.state(np.array(q)[None])
        self._past = [np.array(lengths)] * 3

    def correct(self, data: mujoco.MjData, lengths: Array, feed: float, speeds: Array) -> None:
        """Correct foreseen speeds in place, shape (nv,), where the lengths at the step's end, shape (J,), m, say better.

        The feed, m, lifts all nodes alike, so its jumps open no loop.
        """
        first, second, third = self._past
        self._past = [second, third, lengths]
        if np.abs(lengths - 3 * third + 3 * second - first).max() < _SMOOTH:
            return
        state = self._chain.follow(lengths, self._last)
        if state is not None:
            self._last = state
            self._turns(data, state.nodes[0] + [0.0, 0.0, feed], lengths, speeds)
