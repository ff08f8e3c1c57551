"""The truss at one instant, in its tank, coloured by axial force."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vgtsim.kinematics import Truss
from vgtsim.output.colours import HOLD, REST, force_colours, scale_end
from vgtsim.output.figure import WIDTH
from vgtsim.output.quantities import MINUS
from vgtsim.output.tank_plot import draw_tank_side, draw_tank_top
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Pose:
    """The arm at one record: nodes, shape (N, 3), m, axial forces, shape (M,), N, and the index of the worst member."""

    truss: Truss
    nodes: Array
    axial: Array
    worst: int


def worst_instant(site: Site, log: RunLog, report: Report) -> tuple[int, int]:
    """Indices of the record and of the member that is used most; without utilisation, of the greatest axial force."""
    rank = np.asarray(report.series.get("utilisation", np.abs(log.axial(site.truss.ends))))
    record, member = np.unravel_index(int(np.nanargmax(rank)), rank.shape)
    return int(record), int(member)


def plot_truss(site: Site, log: RunLog, report: Report) -> Figure:
    """Draw the arm at its worst instant: from the side in the tool's plane, from above, and close up.

    Colours are on one symmetric scale, compression red, tension blue.
    """
    record, worst = worst_instant(site, log, report)
    axial = log.axial(site.truss.ends)[record]
    now = _Pose(truss=site.truss, nodes=log.nodes[record], axial=axial, worst=worst)
    x, y, _ = log.tool_position[record]
    azimuth = float(np.arctan2(y, x))
    side = np.array([[np.cos(azimuth), np.sin(azimuth), 0], [0, 0, 1]])
    top = np.eye(3)[:2]
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.05))
    tall, left, right = (figure.add_subplot(cell) for cell in (grid[0, :], grid[1, 0], grid[1, 1]))
    draw_tank_side(tall, site.tank, azimuth)
    draw_tank_top(left, site.tank)
    for axes, view in ((tall, side), (left, top)):
        _draw_goals(axes, site, view)
        _draw_arm(axes, now, view, 1.0)
    _draw_arm(right, now, _best_plane(now.nodes), 1.7)
    tall.set(xlabel=f"along azimuth {np.degrees(azimuth):.0f}°, m", ylabel="z, m", title="side, in the tool's plane")
    left.set(xlabel="x, m", ylabel="y, m", title="top")
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


def _draw_arm(axes: Axes, now: _Pose, view: Array, scale: float) -> None:
    """Draw members far to near and point out the worst; view (2, 3) projects, scale widens the lines."""
    truss = now.truss
    ends = now.nodes[truss.ends]
    order = np.argsort(ends.mean(axis=1) @ np.cross(view[0], view[1]))
    widths = scale * np.array([2.6 if member.role == "actuator" else 1.5 for member in truss.members])
    colours = force_colours(now.axial, scale_end(now.axial))
    lines = LineCollection(list((ends @ view.T)[order]), colors=list(colours[order]), linewidths=list(widths[order]))
    axes.add_collection(lines)
    axes.fill(*(now.nodes[truss.tip] @ view.T).T, color=REST, linewidth=1.5)
    axes.plot(*(now.nodes[truss.base] @ view.T)[[0, 1, 2, 0]].T, color=REST, linewidth=2.0)
    worst = truss.members[now.worst]
    middle = now.nodes[list(worst.ends)].mean(axis=0) @ view.T
    line = {"arrowstyle": "-", "linewidth": 0.8, "color": mpl.rcParams["text.color"]}
    axes.annotate(worst.name, middle, (22, 22), textcoords="offset points", fontsize=8, arrowprops=line)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _draw_goals(axes: Axes, site: Site, view: Array) -> None:
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
