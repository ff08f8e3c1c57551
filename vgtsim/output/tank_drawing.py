"""A tank drawn from its side and from above, with all that stands or hangs in it, its waste as it lies, and its azimuths."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.geometry import Profile, cylinder_axis, find_footprint, find_hulls, make_bed, make_profile, ring_radii
from vgtsim.output.colours import REST

AZIMUTHS = np.radians(np.arange(0, 360, 30))
_WASTE = "#a9803f"
_SPACING = 0.05  # m between the points of the tank's outline
_SEEN = 0.08  # m: least radius of a cylinder from above


def draw_tank_side(axes: Axes, tank: Tank, azimuth: float) -> None:
    """Draw the tank cut by the vertical plane through its axis at an azimuth; riser and equipment are projected onto it."""
    profile = make_profile(tank.shell)
    view = np.array([[np.cos(azimuth), np.sin(azimuth), 0.0], [0.0, 0.0, 1.0]])
    _fill_waste(axes, tank, profile, azimuth)
    r, z = profile.points(_SPACING).T
    riser, top, inner = tank.arm_riser, tank.grade, tank.shell.inner_diameter / 2
    middle, bore = float(np.dot(view[0, :2], riser.place)), riser.bore / 2
    for side in (-1, 1):
        outer = np.abs(side * r - middle) >= bore
        floor = ~outer & (z < tank.shell.crown / 2)
        axes.plot(side * r[floor], z[floor], color=REST)
        axes.plot(side * np.where(outer, r, np.nan), z, color=REST, linewidth=1.4)
        wall = middle + side * bore
        axes.plot([wall] * 2, [float(profile.ceiling_at(abs(wall))), top], color=REST, linewidth=1.4)
        axes.plot([wall, side * 1.15 * inner], [top, top], color=REST, linestyle=":")
    axes.text(-inner, top + 0.1, "grade", color=REST, fontsize=7.5, va="bottom")
    for item in tank.standing:
        _fill(axes, _outline_pipe(cylinder_axis(item, profile) @ view.T, item.diameter / 2), 0.45)
    for item in tank.solids:
        for hull in find_hulls(item, profile):
            flat = hull @ view.T
            _fill(axes, flat[ConvexHull(flat).vertices], 0.45)


def draw_tank_top(axes: Axes, tank: Tank) -> None:
    """Draw the wall, the arm's riser, the equipment and the heights of uneven waste from above."""
    profile, bed = make_profile(tank.shell), make_bed(tank)
    if bed is not None:
        x, y = np.moveaxis(bed.places, -1, 0)
        inside = np.where(np.hypot(x, y) <= bed.radius, bed.heights, np.nan)
        lines = axes.contour(x, y, inside, levels=5, colors=_WASTE, linewidths=0.7, alpha=0.8)
        axes.clabel(lines, fmt="%.1f m", fontsize=6)
    axes.add_patch(Circle((0, 0), tank.shell.inner_diameter / 2, fill=False, edgecolor=REST, linewidth=1.4))
    axes.add_patch(Circle(tank.arm_riser.place, tank.arm_riser.bore / 2, fill=False, edgecolor=REST, linestyle=":"))
    for item in tank.standing:
        ends, radius = cylinder_axis(item, profile)[:, :2], max(item.diameter / 2, _SEEN)
        for end in ends if item.ends[0] != item.ends[1] else ends[:1]:
            axes.add_patch(Circle(tuple(end.tolist()), radius, facecolor=REST, alpha=0.7, linewidth=0))
        if item.ends[0] != item.ends[1]:
            _fill(axes, _outline_pipe(ends, radius), 0.5)
        _name(axes, item.name, ends[0])
    for item in tank.solids:
        outline = find_footprint(item, profile)
        _fill(axes, outline, 0.7)
        _name(axes, item.name, outline.mean(axis=0))


def draw_rose(axes: Axes, tank: Tank) -> None:
    """Draw azimuths at the wall and rings of radius, for a tank seen from above."""
    inner = tank.shell.inner_diameter / 2
    for angle in AZIMUTHS:
        direction = np.array([np.cos(angle), np.sin(angle)])
        axes.plot(*np.outer(direction, [inner, 1.04 * inner]).tolist(), color=REST, linewidth=0.8)
        name = f"{np.degrees(angle):.0f}°" + (" (+x)" if angle == 0 else "")
        axes.annotate(name, tuple(1.11 * inner * direction), ha="center", va="center", fontsize=7, color=REST)
    for radius in ring_radii(tank):
        axes.add_patch(Circle((0, 0), radius, fill=False, edgecolor=REST, linewidth=0.4, linestyle=(0, (2, 4))))
        axes.annotate(f"{radius:.0f} m", (0, -radius), ha="center", va="center", fontsize=6, color=REST)


def _fill_waste(axes: Axes, tank: Tank, profile: Profile, azimuth: float) -> None:
    """Fill the waste in the plane of an azimuth, from the floor up to its surface."""
    bed, inner = make_bed(tank), profile.inner_radius
    across = np.linspace(-inner, inner, round(2 * inner / _SPACING) | 1)
    if bed is None:
        high = np.full(across.shape, tank.waste.level)
    else:
        direction = np.array([np.cos(azimuth), np.sin(azimuth)])
        high = np.array([bed.height_at(*(x * direction)) for x in across])
    floor = profile.floor_at(np.abs(across))
    axes.fill_between(across, floor, high, where=(high > floor).tolist(), color=_WASTE, alpha=0.45, linewidth=0)


def _outline_pipe(ends: Array, radius: float) -> Array:
    """Corners of a cylinder as it is seen, shape (4, 2), m, from the ends of its axis in the picture, shape (2, 2)."""
    along = ends[1] - ends[0]
    size = float(np.linalg.norm(along))
    aside = radius * (np.array([-along[1], along[0]]) / size if size else np.array([1.0, 0.0]))
    return np.array([ends[0] - aside, ends[0] + aside, ends[1] + aside, ends[1] - aside])


def _fill(axes: Axes, corners: ArrayLike, alpha: float) -> None:
    axes.add_patch(Polygon(np.asarray(corners), closed=True, facecolor=REST, alpha=alpha, linewidth=0))


def _name(axes: Axes, name: str, place: Array) -> None:
    x, y = place.tolist()
    axes.annotate(name.replace("_", " "), (x, y), (4, 4), textcoords="offset points", fontsize=7, color=REST)
