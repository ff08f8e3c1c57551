"""The truss drawn from its sides: at one instant, coloured by axial force, in the outline of its tank; and in a posture."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize, to_rgba_array
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.kinematics import Chain, Truss
from vgtsim.output.colours import HOLD, REST, force_colours, scale_end
from vgtsim.output.figure import WIDTH, save_figure
from vgtsim.output.quantities import MINUS
from vgtsim.output.tank_drawing import draw_rose, draw_tank_side, draw_tank_top
from vgtsim.site import Site
from vgtsim.verification import JudgedRun


def worst_instant(run: JudgedRun) -> tuple[int, int]:
    """Indices of the record and of the member that is used most; without utilisation, of the greatest axial force."""
    rank = np.asarray(run.report.series.get("utilisation", np.abs(run.shown.axial)))
    record, member = np.unravel_index(int(np.nanargmax(rank)), rank.shape)
    return int(record), int(member)


def plot_truss(run: JudgedRun) -> Figure:
    """Draw the arm at its worst instant: from the side in the tool's plane, from above, and close up.

    Colours are on one symmetric scale, compression red, tension blue.
    """
    site, (record, worst) = run.site, worst_instant(run)
    axial, nodes = run.shown.axial[record], run.log.nodes[record]
    x, y, _ = run.log.tool_position[record] - site.chain.mount[:3, 3]
    azimuth = float(np.arctan2(y, x))
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.05))
    tall, left, right = (figure.add_subplot(cell) for cell in (grid[0, :], grid[1, 0], grid[1, 1]))
    draw_tank_side(tall, site.tank, azimuth)
    draw_tank_top(left, site.tank)
    draw_rose(left, site.tank)
    for axes, view in ((tall, view_upright(azimuth)), (left, np.eye(3)[:2])):
        draw_goals(axes, site, view)
        _draw_arm(axes, site, nodes, axial, view)
        _point_out(axes, site, nodes, worst, view)
    view = _best_plane(nodes)
    _draw_arm(right, site, nodes, axial, view, 1.7)
    _point_out(right, site, nodes, worst, view)
    tall.set(xlabel=f"along azimuth {np.degrees(azimuth):.0f}°, m", ylabel="z, m", title="side, in the tool's plane")
    left.set(xlabel="x, m", ylabel="y, m", title="top; azimuth from +x, counter-clockwise")
    right.margins(y=0.4)
    right.set(xlabel="m", ylabel="m", title="close up, turned to show most of the arm")
    bar = figure.colorbar(_scale(scale_end(axial)), ax=[tall, left, right], shrink=0.55, aspect=30, pad=0.015)
    bar.set_label(f"axial force, kN (compression {MINUS}, tension +)")
    bar.ax.spines[:].set_visible(False)
    return figure


def _best_plane(nodes: Array) -> Array:
    """View (2, 3) in the plane in which nodes (N, 3) spread most: the steeper axis up, the tip right."""
    axes = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2][:2]
    axes = axes[np.argsort(np.abs(axes[:, 2]))]
    towards = np.array([nodes[-1] - nodes[0], [0.0, 0.0, 1.0]])
    return axes * np.where(np.sum(axes * towards, axis=1, keepdims=True) < 0, -1.0, 1.0)


def _draw_arm(axes: Axes, site: Site, nodes: Array, axial: Array, view: Array, scale: float = 1.0) -> None:
    """Draw members far to near; view (2, 3) projects, scale widens the lines."""
    truss, flat = site.truss, nodes @ view.T
    draw_members(axes, truss, nodes, view, force_colours(axial, scale_end(axial)), scale)
    axes.fill(*flat[truss.tip].T, color=REST, linewidth=1.5)
    axes.plot(*flat[truss.base][[0, 1, 2, 0]].T, color=REST, linewidth=2.0)
    axes.grid(visible=False)


def draw_members(axes: Axes, truss: Truss, nodes: Array, view: Array, colours: ArrayLike, scale: float = 1.0) -> None:
    """Draw members far to near, actuators thick, with one colour each or for all; `view` (2, 3) projects nodes (N, 3), m."""
    order = np.argsort(nodes[truss.ends].mean(axis=1) @ np.cross(view[0], view[1]))
    widths = scale * np.array([2.6 if member.role == "actuator" else 1.5 for member in truss.members])
    every = np.broadcast_to(to_rgba_array(colours), (len(order), 4))
    ends = (nodes @ view.T)[truss.ends]
    axes.add_collection(LineCollection(list(ends[order]), colors=list(every[order]), linewidths=list(widths[order])))
    axes.autoscale_view()
    axes.set_aspect("equal")


def draw_posture(chain: Chain, q: ArrayLike, goal: ArrayLike, path: Path) -> None:
    """Draw the truss at inputs q, shape (n,), with its goal, a tool point in frame G, shape (3,), m; see `save_figure`."""
    wanted = np.asarray(goal, float)
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    colours = ["tab:red" if member.role == "actuator" else "0.4" for member in chain.truss.members]
    titles = ("in the goal's plane", "from above"), ("outward, m", "x, m"), ("z, m", "y, m")
    sides = zip(figure.subplots(1, 2), (span_goal_plane(chain, wanted), np.eye(3)[:2]), *titles, strict=True)
    for axes, view, title, across, up in sides:
        draw_members(axes, chain.truss, chain.nodes(q), view, colours, 0.7)
        axes.plot(*(view @ wanted), marker="x", color="tab:blue", markersize=9)
        axes.set(title=title, xlabel=across, ylabel=up)
    save_figure(figure, path)


def span_goal_plane(chain: Chain, goal: Array) -> Array:
    """Outward and upward unit vectors of the vertical plane of a goal in frame G, shape (2, 3)."""
    x, y, _ = goal - chain.mount[:3, 3]
    return view_upright(float(np.arctan2(y, x)))


def view_upright(azimuth: float) -> Array:
    """View (2, 3) of the vertical plane at an azimuth: outward and up."""
    return np.array([[np.cos(azimuth), np.sin(azimuth), 0.0], [0.0, 0.0, 1.0]])


def _point_out(axes: Axes, site: Site, nodes: Array, member: int, view: Array) -> None:
    name, ends = site.truss.members[member].name, site.truss.ends[member]
    line = {"arrowstyle": "-", "linewidth": 0.8, "color": mpl.rcParams["text.color"]}
    middle = nodes[ends].mean(axis=0) @ view.T
    axes.annotate(name, middle, (22, 22), textcoords="offset points", fontsize=8, arrowprops=line)


def draw_goals(axes: Axes, site: Site, view: Array) -> None:
    """Draw the goals of a scene with their directions and names; `view` (2, 3) projects."""
    for goal in site.task.motion.goals:
        x, y = (float(value) for value in view @ np.array(goal.position))
        dx, dy = (1.1 * float(value) for value in view @ np.array(goal.direction))
        axes.plot(x, y, "o", markersize=5, markerfacecolor="none", color=HOLD)
        arrow = {"arrowstyle": "->", "color": HOLD, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops=arrow)
        axes.annotate(goal.name, (x, y), (5, -10), textcoords="offset points", fontsize=7.5, color=HOLD)


def _scale(end: float) -> ScalarMappable:
    colours = force_colours(np.linspace(-1, 1, 255), 1.0)
    return ScalarMappable(Normalize(-end / 1e3, end / 1e3), ListedColormap(list(colours)))
