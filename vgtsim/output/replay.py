"""The model posed from the log, without stepping: what the camera sees at an instant of the run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.judging import Cut
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Truss
from vgtsim.mjcf import PoseMap, fill_qpos, make_pose_map, names
from vgtsim.output.colours import force_colours
from vgtsim.runlog import RunLog

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Replay:
    """A model that can be posed.

    Attributes:
        model: Its geom colours are changed by `pose_model`.
        data: Its positions are changed by `pose_model`.
        truss: The arm's truss.
        pose: Addresses in qpos.
        geoms: Indices of the members' geoms, rods of cylinders included.
        owners: Member of each of those geoms.
        end: Both ends of the colour scale, N.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    truss: Truss
    pose: PoseMap
    geoms: NDArray[np.intp]
    owners: NDArray[np.intp]
    end: float


def make_replay(model: mujoco.MjModel, truss: Truss, end: float) -> Replay:
    """Prepare a model for replay.

    Args:
        model: Compiled model of the truss.
        end: Both ends of the colour scale, N.
    """
    pairs = []
    for index, member in enumerate(truss.members):
        pairs.append((model.geom(member.name).id, index))
        if member.role == "actuator":
            pairs.append((model.geom(names.rod(member.name)).id, index))
    geoms, owners = np.array(pairs, dtype=np.intp).T
    return Replay(model, mujoco.MjData(model), truss, make_pose_map(model, truss), geoms, owners, end)


def pose_model(replay: Replay, nodes: Array, axial: Array) -> None:
    """Pose the model and colour its members.

    Args:
        nodes: Hub positions in frame G, shape (N, 3), m.
        axial: Tension positive, shape (M,), N.
    """
    fill_qpos(replay.pose, replay.truss, nodes, replay.data.qpos)
    mujoco.mj_kinematics(replay.model, replay.data)
    mujoco.mj_comPos(replay.model, replay.data)
    mujoco.mj_camlight(replay.model, replay.data)
    replay.model.geom_rgba[replay.geoms] = force_colours(axial, replay.end)[replay.owners]


def frame_times(log: RunLog, fps: int, speed: float) -> Array:
    """Simulated times at which the film's frames are taken.

    Args:
        fps: Frames a second of film.
        speed: Simulated seconds in a second of film.

    Returns:
        From the first record on, evenly spaced, none after the last, shape (F,), s.
    """
    span = float(log.time[-1] - log.time[0])
    return float(log.time[0]) + np.arange(int(span * fps / speed + 1e-9) + 1) * speed / fps


def interpolate(log: RunLog, axial: Array, time: float) -> tuple[int, Array, Array]:
    """Find the state between two records.

    Args:
        axial: Axial forces at its records, shape (T, M), N.

    Returns:
        The record before, the nodes, shape (N, 3), m, and the axial forces, shape (M,), N.
    """
    before = int(np.clip(np.searchsorted(log.time, time + 1e-9, side="right") - 1, 0, max(len(log.time) - 2, 0)))
    after = min(before + 1, len(log.time) - 1)
    span = float(log.time[after] - log.time[before])
    part = min(max((time - float(log.time[before])) / span, 0.0), 1.0) if span else 0.0
    nodes = (1 - part) * log.nodes[before] + part * log.nodes[after]
    return (after if part >= 1 else before), nodes, (1 - part) * axial[before] + part * axial[after]


def camera_at(cuts: tuple[Cut, ...], time: float) -> str:
    """Choose the camera of an instant.

    Returns:
        Camera of the first shot that has not ended; the last one when all have.
    """
    return next((cut.camera for cut in cuts if cut.until is None or time < cut.until), cuts[-1].camera)


def project(scene: mujoco.MjvScene, points: Array, width: int, height: int) -> Array:
    """Where points stand in the picture.

    Args:
        scene: After `Renderer.update_scene`.
        points: In frame G, shape (K, 3), m.
        width: Of the picture, pixels.
        height: Of the picture, pixels.

    Returns:
        Column and row, shape (K, 2), pixels; NaN for points behind the camera.
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
