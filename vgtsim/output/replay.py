"""The model posed from the log, without stepping: what the camera sees at an instant of the run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import Cut
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Truss
from vgtsim.log import RunLog
from vgtsim.mjcf import PoseMap, fill_qpos, make_pose_map, names
from vgtsim.output.colours import force_colours


@dataclass(frozen=True)
class Replay:
    """A model whose positions and colours `pose_model` sets.

    Attributes:
        pose: Addresses in qpos.
        geoms: Indices of the members' geoms, rods of cylinders included.
        owners: Member of each of those geoms.
        end: Both ends of the colour scale, N.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    truss: Truss
    pose: PoseMap
    geoms: Index
    owners: Index
    end: float


def make_replay(model: mujoco.MjModel, truss: Truss, end: float) -> Replay:
    """Prepare the compiled model of a truss for replay; the colour scale ends at this axial force, N."""
    pairs = []
    for index, member in enumerate(truss.members):
        pairs.append((model.geom(member.name).id, index))
        if member.role == "actuator":
            pairs.append((model.geom(names.rod(member.name)).id, index))
    geoms, owners = np.array(pairs, dtype=np.intp).T
    return Replay(
        model=model,
        data=mujoco.MjData(model),
        truss=truss,
        pose=make_pose_map(model, truss),
        geoms=geoms,
        owners=owners,
        end=end,
    )


def pose_model(replay: Replay, nodes: Array, axial: Array) -> None:
    """Pose the model by its nodes in frame G, shape (N, 3), m; colour its members by axial force, shape (M,), N."""
    fill_qpos(replay.pose, replay.truss, nodes, replay.data.qpos)
    mujoco.mj_kinematics(replay.model, replay.data)
    mujoco.mj_comPos(replay.model, replay.data)
    mujoco.mj_camlight(replay.model, replay.data)
    replay.model.geom_rgba[replay.geoms] = force_colours(axial, replay.end)[replay.owners]


def frame_times(log: RunLog, fps: int, speed: float) -> Array:
    """Times of the film's frames, shape (F,), s: evenly from the first record on, none after the last.

    A second of film has `fps` frames and `speed` simulated seconds.
    """
    span = float(log.time[-1] - log.time[0])
    return float(log.time[0]) + np.arange(int(span * fps / speed + 1e-9) + 1) * speed / fps


def interpolate(log: RunLog, axial: Array, time: float) -> tuple[int, Array, Array]:
    """Find the state between two records: the record before, the nodes, (N, 3), m, and the axial forces, (M,), N.

    `axial` holds the forces at all records, shape (T, M), N.
    """
    last = np.searchsorted(log.time, time + 1e-9, side="right") - 1  # the slack takes in rounding of frame times
    before = int(np.clip(last, 0, max(len(log.time) - 2, 0)))
    after = min(before + 1, len(log.time) - 1)
    span = float(log.time[after] - log.time[before])
    part = min(max((time - float(log.time[before])) / span, 0.0), 1.0) if span else 0.0
    nodes = (1 - part) * log.nodes[before] + part * log.nodes[after]
    return (after if part >= 1 else before), nodes, (1 - part) * axial[before] + part * axial[after]


def camera_at(cuts: tuple[Cut, ...], time: float) -> str:
    """Choose the camera of an instant: that of the first shot that has not ended, or of the last one."""
    return next((cut.camera for cut in cuts if cut.until is None or time < cut.until), cuts[-1].camera)


def project(scene: mujoco.MjvScene, points: Array, width: int, height: int) -> Array:
    """Column and row, shape (K, 2), pixels, of points in frame G, shape (K, 3), m; NaN for points behind the camera.

    The scene is that of `Renderer.update_scene`; width and height are those of the picture, pixels.
    """
    camera = scene.camera[0]
    forward, up = np.array(camera.forward), np.array(camera.up)
    eye = (np.array(camera.pos) + np.array(scene.camera[1].pos)) / 2
    view = (points - eye) @ np.stack([np.cross(forward, up), up, forward], axis=-1)
    depth = np.where(view[:, 2] > camera.frustum_near, view[:, 2], np.nan)
    tall = camera.frustum_top - camera.frustum_bottom
    plane = view[:, :2] / depth[:, None] * camera.frustum_near
    column = width / 2 + plane[:, 0] * height / tall
    row = (camera.frustum_top - plane[:, 1]) * height / tall
    return np.stack([column, row], axis=-1)
