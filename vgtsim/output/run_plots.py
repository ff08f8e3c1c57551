"""The whole arm over time: closure, tool error, clearance, mast reaction."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vgtsim.output.colours import HOLD, LINES, REST
from vgtsim.output.figure import draw_limit, finish_axes, panels
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report

Array = NDArray[np.float64]

_LEAST_GAP = 1e-15  # m; a logarithmic axis has no zero


def plot_closure(site: Site, log: RunLog, report: Report) -> Figure:
    """Draw the greatest gap between a member's end and its hub.

    Args:
        report: With the series `closure`.
    """
    figure, (axes,) = panels(1, 1, 2.4)
    axes.semilogy(log.time, np.maximum(report.series["closure"], _LEAST_GAP), color=LINES[0])
    draw_limit(axes, site.task.limits.closure, "limit")
    axes.set_ylim(top=2.5 * max(site.task.limits.closure, float(np.nanmax(report.series["closure"]))))
    axes.set_ylabel("greatest gap, m")
    finish_axes(axes, site, log, named=True)
    return figure


def plot_tool_error(site: Site, log: RunLog, report: Report) -> Figure:
    """Draw the tool's distance and angle from the goal that it goes to or holds.

    Args:
        report: With the series `tool_position_error` and `tool_angle_error`.
    """
    figure, (place, turn) = panels(2, 1, 3.9)
    limits = site.task.limits
    rows = (
        (place, report.series["tool_position_error"], 1e3, limits.tracking_position, "position error, mm"),
        (turn, report.series["tool_angle_error"], 180 / np.pi, limits.tracking_angle, "angle error, °"),
    )
    for axes, error, factor, limit, label in rows:
        shown = np.maximum(error, limit * 1e-6) * factor
        axes.semilogy(log.time, shown, color=REST, linewidth=1.0, label="on the way")
        axes.semilogy(log.time, np.where(log.settled, shown, np.nan), color=HOLD, linewidth=3.0, label="settled")
        draw_limit(axes, limit * factor, "limit when settled")
        axes.set_ylabel(label)
        finish_axes(axes, site, log, named=axes is place, abscissa=axes is turn)
    turn.legend(loc="lower left", ncols=2)
    return figure


def plot_clearance(site: Site, log: RunLog, report: Report) -> Figure:
    """Draw the least distance from the arm to anything.

    Args:
        report: With the series `clearance_time` and `clearance`.
    """
    figure, (axes,) = panels(1, 1, 2.4)
    clearance = np.asarray(report.series["clearance"]) * 1e3
    axes.plot(report.series["clearance_time"], clearance, color=LINES[0])
    worst = int(np.nanargmin(clearance))
    axes.plot(report.series["clearance_time"][worst], clearance[worst], "o", markersize=5, color=LINES[1])
    draw_limit(axes, site.task.limits.clearance * 1e3, "limit")
    axes.set_ylim(bottom=min(0.0, 1.1 * float(clearance[worst])))
    axes.set_ylabel("clearance, mm")
    finish_axes(axes, site, log, named=True)
    return figure


def plot_reaction(site: Site, log: RunLog, wrench: Array) -> Figure:
    """Draw the history of a support's force and moment.

    Args:
        wrench: In frame G, shape (T, 6), N and N·m.
    """
    figure, (force, moment) = panels(2, 1, 3.9)
    for axes, first, label in ((force, 0, "force, kN"), (moment, 3, "moment, kN·m")):
        part = wrench[:, first : first + 3] / 1e3
        for axis, name in enumerate("xyz"):
            axes.plot(log.time, part[:, axis], color=LINES[axis], label=name)
        size = np.linalg.norm(part, axis=-1)
        axes.plot(log.time, size, color=REST, linewidth=0.9, linestyle=":", label="magnitude")
        axes.set_ylabel(label)
        finish_axes(axes, site, log, named=axes is force, abscissa=axes is moment)
    force.legend(loc="center right", bbox_to_anchor=(1.0, 0.28), ncols=4)  # clear of zero and of the weight
    return figure
