"""Speeds of the joints of an arm from the places of its hubs: of members that are bodies, or of rigid sections."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, rotate_upright
from vgtsim.mjcf import SectionPose, make_mast_pose, names
from vgtsim.plant.addresses import Addresses

_TRIPLE = np.arange(3)
_PASSES = 2  # over the turn of a bar: a turn of 0.05 rad is then found to 1e-8 of it


class _Joints(NamedTuple):
    """Degrees of freedom: three for each ball of a member, shape (H, 3), of the tip plate's turn and of joint blocks.

    `hung` are the members on balls, `pins` the hinges of actuators between joint blocks, `blocks` the blocks' bodies.
    """

    hung: Index
    balls: Index
    tip: Index
    turns: Index
    pins: Index
    blocks: Index


class MemberTurns:
    """Turns of members, joint blocks and tip plate, and the slides of cylinders."""

    def __init__(self, model: mujoco.MjModel, at: Addresses, chain: Chain) -> None:
        self._chain, self._at, self._step = chain, at, model.opt.timestep
        self._joints, self._mast = _find_joints(model, chain), make_mast_pose(model, chain.truss)
        self._flanged = np.array([member.ends[0] < chain.truss.base.stop for member in chain.truss.members])

    def __call__(self, data: mujoco.MjData, nodes: Array, lengths: Array, speeds: Array) -> None:
        """Write speeds, shape (nv,), that lead to nodes, shape (N, 3), m, and lengths, shape (J,), m, within a step.

        They lead there from where the bodies are; spins stay as foreseen.
        """
        truss, joints, at, step = self._chain.truss, self._joints, self._at, self._step
        corner = nodes[truss.tip]
        x, y = corner[0] - corner[2], corner[1] - corner[2]
        z = np.cross(x, y)
        x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
        plate = np.array([x, np.cross(z, x), z], float).T
        speeds[joints.tip] = find_turn(data.xmat[at.tip].reshape(3, 3), plate) / step
        spans = truss.spans(nodes)
        if len(joints.blocks):
            self._turn_blocks(data, nodes, spans, speeds)
        if self._mast.turn is not None:
            turn = self._mast.find_turn(nodes) - data.qpos[self._mast.turn]
            speeds[self._mast.turn_speed] = turn / step
            spans[self._flanged] = spans[self._flanged] @ rotate_upright(turn)  # as if the flange had not turned
        near = data.site_xmat[at.near].reshape(-1, 3, 3)
        ahead = (spans[:, None] @ near)[:, 0]
        ahead /= np.sqrt(np.sum(ahead**2, axis=1, keepdims=True))
        spin = speeds[joints.balls[:, 2]] * step
        speeds[joints.balls[:, :2]] = _find_swings(ahead[joints.hung], spin) / step
        pinned = truss.ring_actuators.ravel()
        speeds[joints.pins] = -np.arcsin(ahead[pinned, 1]) / step
        speeds[at.slide] = (lengths - data.qpos[at.position]) / step

    def _turn_blocks(self, data: mujoco.MjData, nodes: Array, spans: Array, speeds: Array) -> None:
        """Speeds of the turns of joint blocks; spans, shape (M, 3), m, become what their members see of them."""
        truss, joints, step = self._chain.truss, self._joints, self._step
        foot, _, head = np.moveaxis(nodes[truss.rings].reshape(-1, 3, 3), 1, 0)
        seats = data.xmat[joints.blocks].reshape(-1, 3, 3)
        ahead = ((head - foot)[:, None] @ seats)[:, 0]
        turn = speeds[joints.turns] * step
        turn[:, :2] = _find_swings(ahead / np.linalg.norm(ahead, axis=1, keepdims=True), turn[:, 2])
        speeds[joints.turns] = turn / step
        back = seats @ _rotate(-turn) @ seats.swapaxes(-1, -2)
        for way, block in zip(back, truss.rings.reshape(-1, 3), strict=True):
            hangs = np.isin(truss.ends[:, 0], block)
            spans[hangs] = spans[hangs] @ way.T  # as if the block had not turned


def _find_joints(model: mujoco.MjModel, chain: Chain) -> _Joints:
    truss = chain.truss
    label = truss.member_names
    pinned = truss.ring_actuators.ravel()
    hung = np.setdiff1d(np.arange(len(label)), pinned)
    middles = [truss.nodes[i] for i in truss.rings[:, :, 1].ravel()]

    def first(joints: list[str]) -> Index:
        return np.array([model.joint(joint).dofadr[0] for joint in joints], dtype=int)

    return _Joints(
        hung=hung,
        balls=first([label[i] for i in hung])[:, None] + _TRIPLE,
        tip=first([names.TIP])[0] + 3 + _TRIPLE,
        turns=first([names.turn(node) for node in middles])[:, None] + _TRIPLE,
        pins=first([names.pin(label[i]) for i in pinned]),
        blocks=np.array([model.body(node).id for node in middles], dtype=int),
    )


def find_turn(now: Array, after: Array) -> Array:
    """Rotation vectors in frames of bodies, shape (..., 3), rad, from rotations to others, each of shape (..., 3, 3).

    Good for turns of less than a right angle.
    """
    R = np.swapaxes(now, -1, -2) @ after
    axis = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1) / 2
    sine = np.sqrt(np.sum(axis**2, axis=-1, keepdims=True))
    return axis * np.arcsin(np.minimum(sine, 1.0)) / np.where(sine > 0, sine, 1.0)


def _rotate(turns: Array) -> Array:
    """Rotations by rotation vectors, shape (..., 3), rad: shape (..., 3, 3)."""
    angle = np.linalg.norm(turns, axis=-1)[..., None, None]
    K = np.cross(turns[..., None, :], np.eye(3))  # its transpose, as a product from the left
    K = K.swapaxes(-1, -2)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * K @ K


def _find_swings(ahead: Array, spin: Array) -> Array:
    """First two components of rotation vectors whose third is a spin, shape (H,), rad, that carry Z ahead, (H, 3).

    Rodrigues' formula for the image of Z, solved for them with the angle of the pass before; its sine and cosine are
    series, good to 1e-11 at 0.2 rad.
    """
    up, side, _ = ahead.T
    x, y = -side, up
    for _ in range(_PASSES):
        square = x**2 + y**2 + spin**2
        a = 1 - square / 6 * (1 - square / 20 * (1 - square / 42))
        b = (0.5 - square / 24 * (1 - square / 30 * (1 - square / 56))) * spin
        size = a**2 + b**2
        x, y = (b * up - a * side) / size, (a * up + b * side) / size
    return np.stack([x, y], axis=-1)


class SectionTurns:
    """Moves of mast and free hubs, and moves and turns of sections."""

    def __init__(self, model: mujoco.MjModel, pose: SectionPose) -> None:
        self._pose, self._step = pose, model.opt.timestep

    def __call__(self, data: mujoco.MjData, nodes: Array, lengths: Array, speeds: Array) -> None:  # noqa: ARG002
        """See `MemberTurns`; the places of the hubs imply the lengths."""
        pose, step = self._pose, self._step
        speeds[pose.slide_speeds] = (nodes[pose.hubs] - pose.reference - data.qpos[pose.slides]) / step
        P, R = pose.find_frames(nodes)
        mast = pose.mast
        speeds[mast.feed_speed] = (mast.find_feed(nodes) - data.qpos[mast.feed]) / step
        if mast.turn is not None:
            speeds[mast.turn_speed] = (mast.find_turn(nodes) - data.qpos[mast.turn]) / step
        speeds[pose.move_speeds[:, None] + _TRIPLE] = (P - data.qpos[pose.moves[:, None] + _TRIPLE]) / step
        speeds[pose.move_speeds[:, None] + 3 + _TRIPLE] = find_turn(data.xmat[pose.bodies].reshape(-1, 3, 3), R) / step


Turns = MemberTurns | SectionTurns
