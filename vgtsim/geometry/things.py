"""Where the things in a tank stand or hang: axes of cylinders, and corners of boxes and of the parts of meshes."""

from __future__ import annotations

from itertools import product
from math import cos, sin

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Box, Equipment, MeshThing, Thing
from vgtsim.geometry.profile import Profile


def cylinder_axis(item: Equipment, profile: Profile) -> Array:
    """Lower and upper end of a cylinder's axis in frame G, shape (2, 3), m."""
    (radius, azimuth), (high_radius, high_azimuth) = item.ends
    low, high = _find_span(item.bottom, item.top, radius, high_radius, profile)
    return np.array(
        [
            [radius * np.cos(azimuth), radius * np.sin(azimuth), low],
            [high_radius * np.cos(high_azimuth), high_radius * np.sin(high_azimuth), high],
        ]
    )


def find_span(item: Thing, profile: Profile) -> tuple[float, float]:
    """Lowest and highest height of a thing, m; of a cylinder, of its axis."""
    if isinstance(item, Equipment):
        axis = cylinder_axis(item, profile)
        return float(axis[0, 2]), float(axis[1, 2])
    corners = np.concatenate(find_hulls(item, profile))
    return float(corners[:, 2].min()), float(corners[:, 2].max())


def find_hulls(item: Box | MeshThing, profile: Profile) -> list[Array]:
    """Corners of the convex parts of a box or mesh in frame G, each of shape (K, 3), m."""
    heading = item.azimuth if item.heading is None else item.heading
    c, s = cos(heading), sin(heading)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    place = np.array([item.radius * cos(item.azimuth), item.radius * sin(item.azimuth), 0.0])
    if isinstance(item, Box):
        x, y = item.length / 2, item.width / 2
        flat = np.array(list(product((-x, x), (-y, y), (0.0, 1.0)))) @ turn.T + place
        out = np.hypot(flat[:, 0], flat[:, 1])
        low, high = _find_span(item.bottom, item.top, float(out.max()), float(out.min()), profile)
        flat[:, 2] = np.where(flat[:, 2] > 0, high, low)
        return [flat]
    hulls = [np.array(part) @ turn.T + place for part in item.parts]
    if item.height is None:
        lowest = min(float(hull[:, 2].min()) for hull in hulls)
        lift = float(profile.floor_at(min(item.radius, profile.inner_radius))) - lowest
    else:
        lift = item.height
    return [hull + [0.0, 0.0, lift] for hull in hulls]


def find_footprint(item: Box | MeshThing, profile: Profile) -> Array:
    """Corners of a box or mesh seen from above, in their order around it, shape (K, 2), m."""
    from scipy.spatial import ConvexHull

    flat = np.concatenate(find_hulls(item, profile))[:, :2]
    return flat[ConvexHull(flat).vertices]


def _find_span(
    bottom: float | None, top: float | None, low_radius: float, high_radius: float, profile: Profile
) -> tuple[float, float]:
    """Heights of both ends, m: on the floor and at the dome where none is given."""
    low = float(profile.floor_at(low_radius)) if bottom is None else bottom
    high = float(profile.ceiling_at(high_radius)) if top is None else top
    return low, high
