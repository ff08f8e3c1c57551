"""Where the next command takes an arm of imposed lengths: speeds of its joints, from kinematics, before the step is made."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, move_points

Array = NDArray[np.float64]

_SMOOTH = 2e-7  # m: change of a cylinder's acceleration, times step², that opens a loop of the reference arm by 1e-8 m


class Turns(Protocol):
    """Knows what the joints of a model do for its hubs to come to given places."""

    def __call__(self, data: mujoco.MjData, nodes: Array, lengths: Array, speeds: Array) -> None:
        """Write speeds, shape (nv,), that lead to nodes, shape (N, 3), m, and lengths, shape (J,), m, within a step."""
        ...


class Foresight:
    """Foresees the speeds of a step from the lengths and the place of the mast commanded for its end.

    Where the commands go on smoothly, the speeds of two steps tell the next ones as well and cost nothing; kinematics is
    asked where an acceleration jumps.
    """

    def __init__(self, turns: Turns, chain: Chain, q: Array, lengths: Array, turn: float = 0.0) -> None:
        """Start at rest at inputs, shape (n,), with lengths, shape (J,), m, and a turn of the mast, rad."""
        self._turns, self._chain = turns, chain
        self._last = chain.state(np.array(q)[None])
        self._past = [np.append(lengths, turn)] * 3

    def correct(self, data: mujoco.MjData, lengths: Array, mast: tuple[float, float], speeds: Array) -> None:
        """Correct foreseen speeds in place, shape (nv,), where the lengths at the step's end, shape (J,), m, say better.

        The mast is then at a feed, m, and a turn, rad. The feed lifts all nodes alike, so its jumps open no loop.
        """
        asked = np.append(lengths, mast[1])  # a radian counts one metre
        first, second, third = self._past
        self._past = [second, third, asked]
        if np.abs(asked - 3 * third + 3 * second - first).max() < _SMOOTH:
            return
        state = self._chain.follow(lengths, self._last)
        if state is not None:
            self._last = state
            self._turns(data, move_points(self._chain, state.nodes[0], *mast), lengths, speeds)
