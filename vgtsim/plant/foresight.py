"""Where the next command takes an arm of imposed lengths: speeds of its joints, from kinematics, before the step is made."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.errors import AssemblyError
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, State, move_points
from vgtsim.plant.turns import Turns

# m by which a parabola through the ways of three steps may miss the next one. A loop of the reference arm opens by a share of
# it, the turn of a member in a step, so by 1e-8 m at its fastest and 40 ms.
_SMOOTH = 2e-7


class Foresight:
    """Foresees the speeds of a step from the lengths and the place of the mast commanded for its end.

    Where the commands go on smoothly, the speeds of three steps tell the next ones as well and cost nothing; kinematics is
    asked elsewhere.
    """

    def __init__(self, turns: Turns, chain: Chain, q: Array, lengths: Array, turn: float = 0.0) -> None:
        """Start at rest at inputs, shape (n,), with lengths, shape (J,), m, and a turn of the mast, rad."""
        self._turns, self._chain = turns, chain
        self._last = chain.state(np.array(q)[None])
        self._past = np.tile(np.append(lengths, turn), (5, 1))  # commands of the last steps, this one at the end

    def correct(self, data: mujoco.MjData, lengths: Array, mast: tuple[float, float], speeds: Array) -> None:
        """Correct foreseen speeds in place, shape (nv,), where the lengths at the step's end, shape (J,), m, say better.

        The mast is then at a feed, m, and a turn, rad. The feed lifts all nodes alike, so its jumps open no loop.
        """
        if note_command(self._past, lengths, mast[1]) < _SMOOTH:  # a radian counts one metre
            return
        state = self._chain.follow(lengths, self._last) or self._search(lengths)
        if state is not None:
            self._last = state
            self._turns(data, move_points(self._chain, state.nodes[0], *mast), lengths, speeds)

    def _search(self, lengths: Array) -> State | None:
        """State of lengths far from the last ones that were asked for; None where the arm would pass a singularity."""
        try:
            return self._chain.state(self._chain.inputs_from_lengths(lengths, self._last.q[0])[None])
        except AssemblyError:
            return None


@compiled
def note_command(past: Array, lengths: Array, turn: float) -> float:
    """Move the last commands, shape (5, J + 1), on by one, and tell by how much it misses the parabola of those before, m."""
    worst = 0.0
    for i in range(past.shape[1]):
        for k in range(4):
            past[k, i] = past[k + 1, i]
        past[4, i] = lengths[i] if i < len(lengths) else turn
        miss = past[4, i] - 4 * (past[3, i] + past[1, i]) + 6 * past[2, i] + past[0, i]
        worst = max(worst, abs(miss))
    return worst
