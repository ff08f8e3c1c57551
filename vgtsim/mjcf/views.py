"""Cameras and goal markers."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from vgtsim.description.scene import Goal
from vgtsim.description.tank import Tank
from vgtsim.mjcf import names

GOAL_COLOUR = (0.10, 0.75, 0.35, 0.9)


def add_goal_markers(spec: mujoco.MjSpec, goals: Sequence[Goal]) -> None:
    """Mark each goal by a ball at the tool point and a rod along the tool direction.

    Args:
        spec: Changed in place.
        goals: In frame G.
    """
    for goal in goals:
        p, d = np.array(goal.position), np.array(goal.direction)
        spec.worldbody.add_site(name=names.goal(goal.name), pos=p, size=[0.12, 0, 0], rgba=GOAL_COLOUR, group=0)
        spec.worldbody.add_site(
            name=f"{names.goal(goal.name)}/direction",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*p, *(p + 0.7 * d)],
            size=[0.03, 0, 0],
            rgba=GOAL_COLOUR,
            group=0,
        )


def add_tank_cameras(spec: mujoco.MjSpec, tank: Tank, pivot_height: float) -> None:
    """Place the four cameras of a scene; the tank is cut open towards -y.

    Args:
        spec: Changed in place.
        tank: The tank.
        pivot_height: Of the arm's base face, m.
    """
    radius, crown = tank.shell.inner_diameter / 2, tank.shell.crown
    middle = np.array([0.0, 0.0, 0.42 * crown])
    _add_camera(spec, "overview", np.array([-0.9 * radius, -2.0 * radius, 1.9 * crown]), middle, 45)
    _add_camera(spec, "cutaway", np.array([0.0, -2.35 * radius, 0.62 * crown]), middle, 38)
    _add_camera(spec, "riser", np.array([2.2, -4.2, pivot_height + 0.6]), np.array([0, 0, pivot_height - 0.9]), 60)
    _add_tool_camera(spec)


def add_arm_cameras(spec: mujoco.MjSpec, height: float) -> None:
    """Place the four cameras of an arm alone.

    Args:
        spec: Changed in place.
        height: Of the arm's base face, m.
    """
    middle = np.array([0.0, 0.0, height / 2])
    _add_camera(spec, "overview", np.array([-0.9 * height, -1.5 * height, 0.9 * height]), middle, 50)
    _add_camera(spec, "cutaway", np.array([0.0, -1.6 * height, height / 2]), middle, 50)
    _add_camera(spec, "riser", np.array([2.2, -4.2, height + 0.6]), np.array([0, 0, height - 0.9]), 60)
    _add_tool_camera(spec)


def _add_tool_camera(spec: mujoco.MjSpec) -> None:
    tip = spec.body(names.TIP)
    camera = tip.add_camera(name="tool", pos=[0.0, 1.1, -0.8], fovy=75)
    camera.quat = _look([0.0, 1.1, -0.8], [0.0, 0.0, 0.3], up=[0.0, 0.0, 1.0])


def _add_camera(spec: mujoco.MjSpec, name: str, place: np.ndarray, target: np.ndarray, fovy: float) -> None:
    spec.worldbody.add_camera(name=name, pos=place, quat=_look(place, target, [0, 0, 1]), fovy=fovy)


def _look(place: Sequence[float] | np.ndarray, target: Sequence[float] | np.ndarray, up: Sequence[float]) -> np.ndarray:
    """Orientation of a camera (x right, y up, looking along -z) at a place towards a target, w x y z."""
    back = np.subtract(place, target)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.stack([right, np.cross(back, right), back], axis=-1).ravel())
    return quat
