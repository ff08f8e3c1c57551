"""Generalised coordinates of the MuJoCo model from node positions: keyframes, start states and replay."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Truss
from vgtsim.mjcf import names

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PoseMap:
    """Where each part's coordinates stand in qpos.

    Attributes:
        slides: Of the free hubs' slides, shape (N - 6, 3).
        hub_reference: Hub positions at zero slides, shape (N - 6, 3), m.
        balls: First of the four coordinates of each member's ball joint, shape (M,).
        ball_reference: Member orientations at zero rotation, shape (M, 4), w x y z.
        cylinders: Slide of each actuator, shape (J,).
        retracted: Length of each actuator at zero slide, shape (J,), m.
        tubes: Indices of the members that are elastic tubes, shape (E,); none when members are rigid.
        springs: Slide of each elastic tube, shape (E,).
        unloaded: Length of each elastic tube at zero slide, shape (E,), m.
        feed: Of the mast's feed.
        feed_reference: Height of the mast flange at zero feed, m.
        tip: First of the seven coordinates of the tip plate.
    """

    slides: NDArray[np.intp]
    hub_reference: Array
    balls: NDArray[np.intp]
    ball_reference: Array
    cylinders: NDArray[np.intp]
    retracted: Array
    tubes: NDArray[np.intp]
    springs: NDArray[np.intp]
    unloaded: Array
    feed: int
    feed_reference: float
    tip: int


def make_pose_map(model: mujoco.MjModel, truss: Truss) -> PoseMap:
    """Look up the addresses once.

    Args:
        model: Compiled model of the truss.
        truss: The truss.

    Returns:
        The map.
    """

    def address(joint: str) -> int:
        return int(model.joint(joint).qposadr[0])

    hubs = truss.nodes[truss.base.stop : truss.tip.start]
    actuators = [truss.members[i].name for i in truss.actuated]
    bodies = {model.body(i).name for i in range(model.nbody)}
    tubes = [i for i, member in enumerate(truss.members) if names.half(member.name) in bodies]
    halves = [truss.members[i].name for i in tubes]
    return PoseMap(
        slides=np.array([[address(joint) for joint in names.slides(node)] for node in hubs], dtype=int).reshape(-1, 3),
        hub_reference=np.array([model.body(node).pos for node in hubs]).reshape(-1, 3),
        balls=np.array([address(member.name) for member in truss.members]),
        ball_reference=np.array([model.body(member.name).quat for member in truss.members]),
        cylinders=np.array([address(names.slide(name)) for name in actuators], dtype=int),
        retracted=np.array([model.numeric(f"{name}/retracted").data[0] for name in actuators]),
        tubes=np.array(tubes, dtype=int),
        springs=np.array([address(names.slide(name)) for name in halves], dtype=int),
        unloaded=np.array([model.body(names.half(name)).pos[2] for name in halves]),
        feed=address(names.FEED),
        feed_reference=float(model.body(names.MAST).pos[2]),
        tip=address(names.TIP),
    )


def qpos_from_nodes(model: mujoco.MjModel, truss: Truss, nodes: Array) -> Array:
    """Coordinates of the pose in which the hubs stand at given positions and no member has spun.

    Args:
        model: Compiled model of the truss.
        truss: The truss.
        nodes: Positions in frame G, shape (N, 3), m; the flange and the tip plate must be undeformed.

    Returns:
        qpos, shape (nq,).
    """
    pose = make_pose_map(model, truss)
    return fill_qpos(pose, truss, nodes, np.array(model.qpos0))


def fill_qpos(pose: PoseMap, truss: Truss, nodes: Array, qpos: Array) -> Array:
    """Write the coordinates of a pose into an array; as `qpos_from_nodes`, for a map made beforehand.

    Args:
        pose: Addresses.
        truss: The truss.
        nodes: Positions in frame G, shape (N, 3), m.
        qpos: Written in place, shape (nq,).

    Returns:
        The same array.
    """
    qpos[pose.slides] = nodes[truss.base.stop : truss.tip.start] - pose.hub_reference
    span = nodes[truss.ends[:, 1]] - nodes[truss.ends[:, 0]]
    length = np.linalg.norm(span, axis=-1)
    turned = quaternions_to(span / length[:, None])
    qpos[pose.balls[:, None] + np.arange(4)] = _multiply(_conjugate(pose.ball_reference), turned)
    qpos[pose.cylinders] = length[truss.actuated] - pose.retracted
    qpos[pose.springs] = length[pose.tubes] - pose.unloaded
    qpos[pose.feed] = nodes[truss.base, 2].mean() - pose.feed_reference
    corner = nodes[truss.tip]
    x = (corner[0] - corner[2]) / np.linalg.norm(corner[0] - corner[2])
    z = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    z /= np.linalg.norm(z)
    R = np.stack([x, np.cross(z, x), z], axis=-1)
    qpos[pose.tip : pose.tip + 3] = corner.mean(axis=0)
    mujoco.mju_mat2Quat(qpos[pose.tip + 3 : pose.tip + 7], R.ravel())
    return qpos


def quaternions_to(direction: Array) -> Array:
    """Shortest rotations that carry z to given directions.

    Args:
        direction: Unit vectors, shape (M, 3).

    Returns:
        Shape (M, 4), w x y z; for the direction -z a half turn about x.
    """
    q = np.stack(
        [1 + direction[:, 2], -direction[:, 1], direction[:, 0], np.zeros(len(direction))],
        axis=-1,
    )
    opposite = q[:, 0] < 1e-12
    q[opposite] = [0.0, 1.0, 0.0, 0.0]
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def _conjugate(q: Array) -> Array:
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def _multiply(p: Array, q: Array) -> Array:
    w, v = p[:, :1], p[:, 1:]
    s, u = q[:, :1], q[:, 1:]
    return np.concatenate([w * s - np.sum(v * u, -1, keepdims=True), w * u + s * v + np.cross(v, u)], axis=-1)
