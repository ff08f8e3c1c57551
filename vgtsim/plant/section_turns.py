"""Moves of the joints of an arm with rigid sections, from the places of its hubs."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.mjcf import SectionPose
from vgtsim.plant.member_turns import find_turn

_TRIPLE = np.arange(3)


class SectionTurns:
    """Moves of mast and free hubs, and moves and turns of sections."""

    def __init__(self, model: mujoco.MjModel, pose: SectionPose) -> None:
        """Take the places in the model from a pose."""
        self._pose, self._step = pose, model.opt.timestep

    def __call__(self, data: mujoco.MjData, nodes: Array, lengths: Array, speeds: Array) -> None:  # noqa: ARG002
        """See `foresight.Turns`; the places of the hubs imply the lengths."""
        pose, step = self._pose, self._step
        speeds[pose.slide_speeds] = (nodes[pose.hubs] - pose.reference - data.qpos[pose.slides]) / step
        P, R = pose.find_frames(nodes)
        mast = pose.mast
        speeds[mast.feed_speed] = (mast.find_feed(nodes) - data.qpos[mast.feed]) / step
        if mast.turn is not None:
            speeds[mast.turn_speed] = (mast.find_turn(nodes) - data.qpos[mast.turn]) / step
        speeds[pose.move_speeds[:, None] + _TRIPLE] = (P - data.qpos[pose.moves[:, None] + _TRIPLE]) / step
        speeds[pose.move_speeds[:, None] + 3 + _TRIPLE] = find_turn(data.xmat[pose.bodies].reshape(-1, 3, 3), R) / step
