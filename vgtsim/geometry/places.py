"""Poses of the tool by named places of a tank, and the frame of the tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Equipment, Goal, GoalPlace, Scene, Tank, Thing, closest
from vgtsim.errors import DescriptionError
from vgtsim.geometry.bed import make_bed
from vgtsim.geometry.clearance import segment_distance
from vgtsim.geometry.profile import make_profile
from vgtsim.geometry.things import cylinder_axis, find_footprint

WALL, WASTE = "wall", "waste"
_NEEDS = {WALL: ("azimuth", "height", "distance"), WASTE: ("azimuth", "radius", "height")}
_BESIDE, _AFTER = ("height", "distance"), ("offset",)
_FREE = {"place", "elevation", "heading"}
_DOWN = np.radians(-30.0)  # elevation of a tool over waste: what arms that hang from above reach far out

_CLOSE = 1e-9  # m: of a place beside a thing
_UPRIGHT = 1 - 1e-9  # size of a direction's z from which it has no vertical plane


def tool_frame(direction: ArrayLike) -> Array:
    """Axes x, y, z of the tool's frame in frame G as columns, shape (3, 3), for a unit direction, shape (3,).

    z is the direction. x is upward in the vertical plane of z, y horizontal. Of a vertical tool x is the x axis of frame G.
    """
    z = np.asarray(direction, float)
    up = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < _UPRIGHT else np.array([1.0, 0.0, 0.0])
    x = up - (up @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def place_goals(scene: Scene) -> Scene:
    """The scene with the pose of each goal that is given by a place; the same scene where none is.

    Raises:
        DescriptionError: There is no such place, or a figure is missing or one too many.
    """
    goals = scene.task.motion.goals
    if all(goal.at is None for goal in goals):
        return scene
    placed: dict[str, Goal] = {}
    for index, goal in enumerate(goals):
        try:
            placed[goal.name] = _place(goal, scene.tank, placed)
        except DescriptionError as error:
            raise scene.error(f"motion.goals.{index}.at.{error.key}", error.found, error.allowed) from None
    motion = scene.task.motion.model_copy(update={"goals": tuple(placed.values())})
    return replace(scene, task=scene.task.model_copy(update={"motion": motion}))


@dataclass(frozen=True)
class _Pose:
    """Tool point, m, and azimuth and elevation of the tool's direction, rad."""

    point: Array
    heading: float
    elevation: float


def _place(goal: Goal, tank: Tank, before: Mapping[str, Goal]) -> Goal:
    at = goal.at
    if at is None:
        return goal
    standing = {item.name: item for item in tank.things}
    if at.place in _NEEDS:
        pose = _at_wall(at, tank) if at.place == WALL else _over_waste(at, tank)
    elif at.place in standing:
        pose = _beside(at, standing[at.place], tank)
    elif at.place in before:
        pose = _after(at, before[at.place])
    else:
        names = (*_NEEDS, *standing, *before)
        raise DescriptionError(None, "place", repr(at.place), f"a place{closest(at.place, names)}")
    heading = pose.heading if at.heading is None else at.heading
    elevation = pose.elevation if at.elevation is None else at.elevation
    level = np.cos(elevation)
    direction = np.array([level * np.cos(heading), level * np.sin(heading), np.sin(elevation)])
    if "direction" in goal.model_fields_set:
        direction = np.array(goal.direction)
    update = {"position": tuple(pose.point.tolist()), "direction": tuple(direction.tolist()), "at": None}
    return Goal.model_validate(goal.model_dump() | update)


def _require(at: GoalPlace, needed: tuple[str, ...], allowed: tuple[str, ...] = ()) -> None:
    given = {name for name in at.model_fields_set if getattr(at, name) is not None} - _FREE
    if lacking := [name for name in needed if name not in given]:
        raise DescriptionError(None, lacking[0], "nothing", f"this key with place = {at.place!r}")
    if beyond := sorted(given - {*needed, *allowed}):
        keys = ", ".join(sorted({*needed, *allowed, *_FREE}))
        raise DescriptionError(None, beyond[0], "a key of another place", f"with {at.place!r}: {keys}")


def _figures(at: GoalPlace, names: tuple[str, ...]) -> list[float]:
    _require(at, names)
    return [float(getattr(at, name)) for name in names]


def _at_wall(at: GoalPlace, tank: Tank) -> _Pose:
    azimuth, height, distance = _figures(at, _NEEDS[WALL])
    profile = make_profile(tank.shell)
    if not 0 < height < profile.crown:
        raise DescriptionError(None, "height", f"{height:.4g} m", f"a height in the tank, 0 to {profile.crown:.4g} m")
    return _Pose(_cylindrical(float(profile.radius_at(height)) - distance, azimuth, height), azimuth, 0.0)


def _over_waste(at: GoalPlace, tank: Tank) -> _Pose:
    azimuth, radius, height = _figures(at, _NEEDS[WASTE])
    point, bed = _cylindrical(radius, azimuth, height), make_bed(tank)
    point[2] += tank.waste.level if bed is None else bed.height_at(point[0], point[1])
    out = point - _mast(tank)
    heading = float(np.arctan2(out[1], out[0])) if np.hypot(*out[:2]) > 1e-6 else azimuth
    return _Pose(point, heading, _DOWN)


def _beside(at: GoalPlace, item: Thing, tank: Tank) -> _Pose:
    _require(at, _BESIDE, ("azimuth",))
    height, distance = (float(getattr(at, name)) for name in _BESIDE)
    profile = make_profile(tank.shell)
    axis = _cylindrical(item.radius, item.azimuth, height)
    if isinstance(item, Equipment):
        low, high = cylinder_axis(item, profile)
        axis[:2] = low[:2] + (high - low)[:2] * np.clip((height - low[2]) / (high - low)[2], 0.0, 1.0)
    back = _mast(tank) - axis
    side = float(np.arctan2(back[1], back[0])) if at.azimuth is None else at.azimuth
    if isinstance(item, Equipment):
        away = item.diameter / 2 + distance
    else:
        away = _leave(find_footprint(item, profile) - axis[:2], side, distance)
    return _Pose(axis + _cylindrical(away, side, 0.0), side + np.pi, 0.0)


def _leave(corners: Array, side: float, distance: float) -> float:
    """How far along an azimuth from the origin a point is at a distance from a convex outline, shape (K, 2), m."""
    ahead = np.array([np.cos(side), np.sin(side)])
    low, high = 0.0, float(np.linalg.norm(corners, axis=1).max()) + distance
    ends, across = np.roll(corners, -1, axis=0), np.roll(corners, -1, axis=0) - corners
    while high - low > _CLOSE:
        point = (low + high) / 2 * ahead
        out = (across[:, 1] * (point - corners)[:, 0] - across[:, 0] * (point - corners)[:, 1]).max() > 0
        near = segment_distance(
            *(np.append(p, np.zeros((len(p), 1)), axis=1) for p in (point[None], point[None], corners, ends))
        )
        low, high = (low, (low + high) / 2) if out and near[0].min() > distance else ((low + high) / 2, high)
    return high


def _after(at: GoalPlace, goal: Goal) -> _Pose:
    _require(at, _AFTER)
    x, y, z = goal.direction
    point = np.array(goal.position) + tool_frame(goal.direction) @ np.array(at.offset)
    return _Pose(point, float(np.arctan2(y, x)), float(np.arcsin(np.clip(z, -1.0, 1.0))))


def _mast(tank: Tank) -> Array:
    """A point of the axis of the arm's riser, shape (3,), m."""
    return np.array([*tank.arm_riser.place, 0.0])


def _cylindrical(radius: float, azimuth: float, height: float) -> Array:
    return np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), height])
