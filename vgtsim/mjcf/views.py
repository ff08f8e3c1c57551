"""Light, cameras and goal markers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Goal, Tank
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names

GOAL_COLOUR = (0.10, 0.75, 0.35, 0.9)


def add_goal_markers(spec: mujoco.MjSpec, goals: Sequence[Goal]) -> None:
    """Mark each goal by a ball at the tool point and a rod along the tool direction."""
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
    """Place the five cameras of a scene, cut open towards -y; `above` sees the whole way of an arm that comes down."""
    radius, crown = tank.shell.inner_diameter / 2, tank.shell.crown
    middle = np.array([0.0, 0.0, 0.42 * crown])
    _add_camera(spec, "overview", [-0.9 * radius, -2.0 * radius, 1.9 * crown], middle, 45)
    _add_camera(spec, "cutaway", [0.0, -2.35 * radius, 0.62 * crown], middle, 38)
    _add_camera(spec, "above", [0.7 * radius, -4.8 * radius, 2.4 * crown], [0.0, 0.0, 1.75 * crown], 38)
    _add_arm_cameras(spec, pivot_height, tank.arm_riser.place)


def light_tank(spec: mujoco.MjSpec, tank: Tank) -> None:
    """A headlight that reaches everywhere, one lamp for relief, no shadows; a pale sky."""
    radius, crown = tank.shell.inner_diameter / 2, tank.shell.crown
    light = spec.visual.headlight
    light.ambient, light.diffuse, light.specular = [0.35] * 3, [0.45] * 3, [0.1] * 3
    body = spec.body(names.TANK)
    lamp = body.add_light(name=f"{names.TANK}/lamp", castshadow=False, diffuse=[0.5] * 3, specular=[0.2] * 3)
    lamp.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    lamp.pos, lamp.dir = [-radius, -radius, 2 * crown], [0.4, 0.6, -0.7]
    sky = spec.add_texture(name=f"{names.TANK}/sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1, sky.rgb2 = [0.80, 0.86, 0.92], [0.97, 0.97, 0.97]


def add_arm_views(spec: mujoco.MjSpec, height: float) -> None:
    """Place the four cameras of an arm alone, whose base face is at a height, m."""
    middle = np.array([0.0, 0.0, height / 2])
    _add_camera(spec, "overview", [-0.9 * height, -1.5 * height, 0.9 * height], middle, 50)
    _add_camera(spec, "cutaway", [0.0, -1.6 * height, height / 2], middle, 50)
    _add_arm_cameras(spec, height)


def add_floor(spec: mujoco.MjSpec) -> None:
    """Add a floor under an arm alone, and light."""
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.35] * 3, [0.5] * 3
    floor = spec.worldbody.add_geom(name=names.FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1], conaffinity=0)
    floor.rgba = [0.86, 0.87, 0.88, 1]


def _add_arm_cameras(spec: mujoco.MjSpec, height: float, place: tuple[float, float] = (0.0, 0.0)) -> None:
    """Cameras beside the arm's base face, at a height and an x and y, m, and on the tip plate, beside the tool and behind it."""
    x, y = place
    _add_camera(spec, "riser", [x + 2.2, y - 4.2, height + 0.6], [x, y, height - 0.9], 60)
    camera = spec.body(names.TIP).add_camera(name="tool", pos=[0.0, 1.1, -0.8], fovy=75)
    camera.quat = _look([0.0, 1.1, -0.8], [0.0, 0.0, 0.3])


def _add_camera(spec: mujoco.MjSpec, name: str, place: ArrayLike, target: ArrayLike, fovy: float) -> None:
    spec.worldbody.add_camera(name=name, pos=place, quat=_look(place, target), fovy=fovy)


def _look(place: ArrayLike, target: ArrayLike) -> Array:
    """Orientation of a camera (x right, y up, looking along -z) at a place towards a target, z being up; w x y z."""
    back = np.subtract(place, target)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.stack([right, np.cross(back, right), back], axis=-1).ravel())
    return quat
