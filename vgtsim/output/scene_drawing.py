"""Drawings of a tank, of a scene with its arm and goals, and of a posture that is refused: from the side and from above.

Azimuths of tank, equipment and goals are angles from the x axis of the tank's frame, counter-clockwise from above. A tool
frame has its z axis along the goal's direction; x lies in the vertical plane of z, on its upper side.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.errors import PostureError
from vgtsim.geometry import tool_frame
from vgtsim.output.colours import LIMIT, LINES, REST
from vgtsim.output.figure import WIDTH, styled
from vgtsim.output.tank_drawing import draw_rose, draw_tank_side, draw_tank_top
from vgtsim.output.truss_plot import draw_goals, draw_members, view_upright
from vgtsim.planning import Collision, tell_collisions
from vgtsim.site import Site

_ABOVE = np.eye(3)[:2]
_AXIS = 0.6  # m, length of a drawn axis of a tool frame
_TOLD = 12  # collisions that are named in a picture


def draw_tank(tank: Tank) -> Figure:
    """Draw a tank cut along azimuth 0, and from above."""
    with styled():
        figure, side, top = _panels()
        draw_tank_side(side, tank, 0.0)
        draw_tank_top(top, tank)
        _finish(side, top, tank, 0.0)
    return figure


def draw_scene(site: Site, q: Array, collisions: tuple[Collision, ...] = ()) -> Figure:
    """Draw a scene with its arm at inputs of shape (n,), its goals with their tool frames, and collisions, the deepest first."""
    points = site.surroundings.points(q[None])[0]
    x, y, _ = points[-1] - site.chain.mount[:3, 3]
    azimuth = float(np.arctan2(y, x))
    with styled():
        figure, side, top = _panels()
        draw_tank_side(side, site.tank, azimuth)
        draw_tank_top(top, site.tank)
        colours = [LINES[1] if member.role == "actuator" else LINES[0] for member in site.truss.members]
        for axes, view in ((side, view_upright(azimuth)), (top, _ABOVE)):
            draw_goals(axes, site, view)
            _draw_frames(axes, site, view)
            draw_members(axes, site.truss, points[:-1], view, colours, 0.7)
            _mark(axes, view, collisions)
        _tell(side, collisions)
        _finish(side, top, site.tank, azimuth)
    return figure


def draw_refusal(error: PostureError) -> Figure:
    """Draw a posture that was refused, with its collisions."""
    assert isinstance(error.site, Site)
    return draw_scene(error.site, np.asarray(error.q), cast("tuple[Collision, ...]", error.collisions))


def _panels() -> tuple[Figure, Axes, Axes]:
    figure = Figure(figsize=(1.5 * WIDTH, 7.0), layout="constrained", facecolor="white")
    side, top = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    return figure, side, top


def _finish(side: Axes, top: Axes, tank: Tank, azimuth: float) -> None:
    """Titles, scales and the rose of azimuths."""
    draw_rose(top, tank)
    heading = "from above; azimuth from +x of the tank, counter-clockwise"
    top.set(xlabel="x, m", ylabel="y, m", title=heading, aspect="equal")
    degrees = np.degrees(azimuth) % 360
    side.set(xlabel=f"along azimuth {degrees:.0f}°, m", ylabel="z, m", title="from the side", aspect="equal")


def _draw_frames(axes: Axes, site: Site, view: Array) -> None:
    """Draw x and y of the tool frame at each goal; z is the goal's arrow."""
    for goal in site.task.motion.goals:
        frame = tool_frame(goal.direction)
        for name, axis in zip("xy", frame.T, strict=False):
            ends = np.array([goal.position, np.array(goal.position) + _AXIS * axis]) @ view.T
            axes.plot(*ends.T, color=REST, linewidth=0.8)
            axes.annotate(name, tuple(ends[1]), fontsize=6, color=REST)


def _mark(axes: Axes, view: Array, collisions: tuple[Collision, ...]) -> None:
    """Mark all collisions."""
    if collisions:
        points = np.array([item.point for item in collisions]) @ view.T
        axes.plot(*points.T, "o", markersize=5, markerfacecolor="none", color=LIMIT, linestyle="none", zorder=6)


def _tell(axes: Axes, collisions: tuple[Collision, ...]) -> None:
    """Name the deepest collisions over the drawing."""
    lines = tell_collisions(collisions)
    more = [f"and {len(lines) - _TOLD} more"] if len(lines) > _TOLD else []
    text = "\n".join([*lines[:_TOLD], *more])
    axes.text(0.0, 1.08, text, transform=axes.transAxes, va="bottom", fontsize=7, color=LIMIT)
