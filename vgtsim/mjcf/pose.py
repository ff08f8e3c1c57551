"""Generalised coordinates of the MuJoCo model from node positions: keyframes, start states and replay."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.kinematics import Truss, find_mast_turn, quaternions_to
from vgtsim.mjcf import names


@dataclass(frozen=True)
class MastPose:
    """Coordinates and degrees of freedom of the mast's feed and of its turn, None where it has none.

    The reference are the nodes at its flange at zero feed and turn, shape (3, 3), m, which stand at a height, m.
    """

    feed: int
    feed_speed: int
    height: float
    turn: int | None
    turn_speed: int | None
    reference: Array

    def find_feed(self, nodes: Array) -> float:
        """Feed, m, with which the first three of the nodes, shape (N, 3), m, are at the flange."""
        return float(nodes[:3, 2].mean() - self.height)

    def find_turn(self, nodes: Array) -> float:
        """Turn, rad, likewise."""
        return find_mast_turn(nodes[:3], self.reference)

    def fill(self, nodes: Array, qpos: Array) -> None:
        """Write the coordinates for nodes, shape (N, 3), m, into qpos, shape (nq,)."""
        qpos[self.feed] = self.find_feed(nodes)
        if self.turn is not None:
            qpos[self.turn] = self.find_turn(nodes)


def make_mast_pose(model: mujoco.MjModel, truss: Truss) -> MastPose:
    """Look up the motions of the mast in a compiled model."""
    feed = model.joint(names.FEED)
    turn = model.joint(names.TURN) if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, names.TURN) >= 0 else None
    foot = model.body(names.MAST).pos
    return MastPose(
        feed=int(feed.qposadr[0]),
        feed_speed=int(feed.dofadr[0]),
        height=float(foot[2]),
        turn=None if turn is None else int(turn.qposadr[0]),
        turn_speed=None if turn is None else int(turn.dofadr[0]),
        reference=np.array([model.body(node).pos + foot for node in truss.nodes[truss.base]]),
    )


@dataclass(frozen=True)
class PoseMap:
    """Where each part's coordinates stand in qpos; F free hubs and joint blocks, R rings of three joint blocks.

    Attributes:
        slides: Slides of the free hubs and joint blocks, shape (F, 3).
        hub_reference: Positions of those at zero slides, shape (F, 3), m.
        turns: First of the four coordinates of each joint block's ball joint, shape (3 R,).
        turn_reference: Orientations of the blocks at zero rotation, shape (3 R, 4), w x y z.
        seat: Joint block that each member hangs from, shape (M,); 3 R, one past the last, for a hub, and 3 R + 1 for one at the
            flange, which turns with the mast.
        hung: Indices of the members on ball joints, all but the actuators between joint blocks, shape (H,).
        balls: First of the four coordinates of their ball joints, shape (H,).
        orientation: Of each member in the frame of what it hangs from, at zero rotation, shape (M, 4), w x y z.
        pins: Hinge of each actuator between joint blocks, in the order of the rings, shape (3 R,).
        sliding: Indices of the S members with slides: the actuators, then the elastic tubes, shape (S,).
        members: Slide of each of those, shape (S,).
        at_zero: Length of each of those at zero slide, shape (S,), m: none of an actuator.
        mast: Where the motions of the mast stand.
        tip: First of the seven coordinates of the tip plate.
    """

    slides: Index
    hub_reference: Array
    turns: Index
    turn_reference: Array
    seat: Index
    hung: Index
    balls: Index
    orientation: Array
    pins: Index
    sliding: Index
    members: Index
    at_zero: Array
    mast: MastPose
    tip: int


def make_pose_map(model: mujoco.MjModel, truss: Truss) -> PoseMap:
    """Look up the addresses of a truss in its compiled model."""

    def addresses(joints: Iterable[str]) -> Index:
        return np.array([model.joint(joint).qposadr[0] for joint in joints], dtype=int)

    hubs, labels = [truss.nodes[i] for i in truss.free], truss.member_names
    rings, pinned, base = truss.rings.reshape(-1, 3), truss.ring_actuators.ravel(), truss.base.stop
    block_of = {int(node): row for row, block in enumerate(rings) for node in block}
    middles = [truss.nodes[i] for i in rings[:, 1]]
    hung = np.setdiff1d(np.arange(len(labels)), pinned)
    bodies = {model.body(i).name for i in range(model.nbody)}
    tubes = [i for i, label in enumerate(labels) if names.half(label) in bodies]
    sliding = np.concatenate([truss.actuated, np.array(tubes, dtype=int)])
    return PoseMap(
        slides=addresses(joint for node in hubs for joint in names.slides(node)).reshape(-1, 3),
        hub_reference=np.array([model.body(node).pos for node in hubs]).reshape(-1, 3),
        turns=addresses(names.turn(node) for node in middles),
        turn_reference=np.array([model.body(node).quat for node in middles]).reshape(-1, 4),
        seat=np.array([block_of.get(node := member.ends[0], len(rings) + (node < base)) for member in truss.members]),
        hung=hung,
        balls=addresses(labels[i] for i in hung),
        orientation=np.array([model.body(label).quat for label in labels]),
        pins=addresses(names.pin(labels[i]) for i in pinned),
        sliding=sliding,
        members=addresses(names.slide(labels[i]) for i in sliding),
        at_zero=np.array([*np.zeros(len(truss.actuated)), *(model.body(names.half(labels[i])).pos[2] for i in tubes)]),
        mast=make_mast_pose(model, truss),
        tip=int(model.joint(names.TIP).qposadr[0]),
    )


def qpos_from_nodes(model: mujoco.MjModel, truss: Truss, nodes: Array) -> Array:
    """Coordinates, shape (nq,), of the pose in which the hubs stand at nodes and no member has spun.

    The nodes are in frame G, shape (N, 3), m. Flange and tip plate must be undeformed.
    """
    return fill_qpos(make_pose_map(model, truss), truss, nodes, np.array(model.qpos0))


def fill_qpos(pose: PoseMap, truss: Truss, nodes: Array, qpos: Array) -> Array:
    """As `qpos_from_nodes`, for a map made beforehand: writes into qpos, shape (nq,), and returns it."""
    qpos[pose.slides] = nodes[truss.free] - pose.hub_reference
    span = nodes[truss.ends[:, 1]] - nodes[truss.ends[:, 0]]
    length = np.linalg.norm(span, axis=-1)
    half = 0.0 if pose.mast.turn is None else pose.mast.find_turn(nodes) / 2
    seats = [[1.0, 0, 0, 0], [np.cos(half), 0, 0, np.sin(half)]]
    blocks = np.append(_quaternions(block_rotations(truss, nodes).reshape(-1, 3, 3)), seats, axis=0)
    qpos[pose.turns[:, None] + np.arange(4)] = _multiply(_conjugate(pose.turn_reference), blocks[:-2])
    turned = _multiply(_conjugate(blocks[pose.seat]), quaternions_to(span / length[:, None]))
    since = _multiply(_conjugate(pose.orientation), turned)
    qpos[pose.balls[:, None] + np.arange(4)] = since[pose.hung]
    qpos[pose.pins] = _pin_angles(pose, truss, nodes)
    qpos[pose.members] = length[pose.sliding] - pose.at_zero
    pose.mast.fill(nodes, qpos)
    corner = nodes[truss.tip]
    x = (corner[0] - corner[2]) / np.linalg.norm(corner[0] - corner[2])
    z = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    z /= np.linalg.norm(z)
    R = np.stack([x, np.cross(z, x), z], axis=-1)
    qpos[pose.tip : pose.tip + 3] = corner.mean(axis=0)
    mujoco.mju_mat2Quat(qpos[pose.tip + 3 : pose.tip + 7], R.ravel())
    return qpos


def block_rotations(truss: Truss, nodes: Array) -> Array:
    """Rotations of each ring's blocks, (R, 3, 3, 3), of nodes (N, 3), m: Z from foot to head, X out from the ring's middle."""
    foot, middle, head = (nodes[truss.rings[:, :, k]] for k in range(3))
    z = (head - foot) / np.linalg.norm(head - foot, axis=-1, keepdims=True)
    out = middle - middle.mean(axis=1, keepdims=True)
    out -= np.sum(out * z, axis=-1, keepdims=True) * z
    x = out / np.linalg.norm(out, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def pinned_rotation(block: Array, span: Array) -> Array:
    """Orientation of a barrel in the frame of its joint block, shape (3, 3): Z along the actuator, X along the pin.

    The pin is Z of the block, whose rotation has shape (3, 3); the span from near to far end, shape (3,), is across it.
    """
    z = block.T @ span
    z[2] = 0.0  # rounding
    z /= np.linalg.norm(z)
    x = np.array([0.0, 0.0, 1.0])
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _pin_angles(pose: PoseMap, truss: Truss, nodes: Array) -> Array:
    """Turn of each barrel on its block since the reference pose, shape (3 R,), rad, from -pi to pi."""
    pinned = truss.ring_actuators.ravel()
    span = nodes[truss.ends[pinned, 1]] - nodes[truss.ends[pinned, 0]]
    now = np.einsum("bji,bj->bi", block_rotations(truss, nodes).reshape(-1, 3, 3), span)
    w, x, y, z = pose.orientation[pinned].T
    begin = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x)])  # the barrel's Z in the block's frame
    angle = np.arctan2(now[:, 1], now[:, 0]) - np.arctan2(begin[1], begin[0])
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _quaternions(rotations: Array) -> Array:
    """Quaternions of rotations of shape (B, 3, 3), shape (B, 4)."""
    result = np.empty((len(rotations), 4))
    for row, R in zip(result, rotations, strict=True):
        mujoco.mju_mat2Quat(row, np.ascontiguousarray(R).ravel())
    return result


def _conjugate(q: Array) -> Array:
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def _multiply(p: Array, q: Array) -> Array:
    w, v = p[:, :1], p[:, 1:]
    s, u = q[:, :1], q[:, 1:]
    return np.concatenate([w * s - np.sum(v * u, -1, keepdims=True), w * u + s * v + np.cross(v, u)], axis=-1)
