"""The members over time: strokes, drive forces, axial forces, utilisation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vgtsim.description.sections import Cylinder
from vgtsim.kinematics.ties import order_down
from vgtsim.output.colours import LIMIT, LINES, REST
from vgtsim.output.figure import draw_limit, finish_axes, panels
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report

Array = NDArray[np.float64]

_NAMED = 5  # members drawn by name
_BLOCKS = 400  # points of an envelope; more cannot be told apart on the page


def plot_actuator_lengths(site: Site, log: RunLog) -> Figure:
    """Draw the actuators' lengths, module by module, between the ends of their strokes."""
    cylinders = _cylinders(site)
    limits = [(part.retracted, part.extended) for part in cylinders]
    return _draw_modules(site, log, log.actual, limits, "length, m")


def plot_actuator_forces(site: Site, log: RunLog) -> Figure:
    """Draw the drives' forces, module by module, between greatest push and pull; tension positive."""
    cylinders = _cylinders(site)
    limits = [(-part.push / 1e3, part.pull / 1e3) for part in cylinders]
    return _draw_modules(site, log, log.actuator_force / 1e3, limits, "force, kN")


def _cylinders(site: Site) -> list[Cylinder]:
    """The first cylinder of every active module."""
    owner = site.truss.module[site.truss.actuated]
    first = [site.truss.actuated[owner == site.arm.modules.index(m)][0] for m in site.arm.active]
    return [site.arm.cylinders[site.truss.members[i].section] for i in first]


def _draw_modules(site: Site, log: RunLog, values: Array, limits: list[tuple[float, float]], label: str) -> Figure:
    """Draw one panel for each active module; values (T, J), limits of each module's first cylinder."""
    columns = 3 if len(limits) > 2 else len(limits)
    rows = -(-len(limits) // columns)
    figure, panel = panels(rows, columns, 0.5 + 1.75 * rows)
    owner = site.truss.module[site.truss.actuated]
    for index, (module, ends) in enumerate(zip(site.arm.active, limits, strict=True)):
        axes = panel[index]
        own = owner == site.arm.modules.index(module)
        for line, (colour, value) in enumerate(zip(LINES, values[:, own].T, strict=False)):
            axes.plot(log.time, value, color=colour, linewidth=1.1, label=f"actuator {line + 1}")
        for end in ends:
            axes.axhline(end, color=LIMIT, linewidth=1.1, linestyle=(0, (5, 2)))
        axes.set_title(f"{module.name} ({site.truss.members[site.truss.actuated[own][0]].section})")
        if index % columns == 0:
            axes.set_ylabel(label)
        finish_axes(axes, site, log, abscissa=index + columns >= len(limits))
    for axes in panel[len(limits) :]:
        axes.set_axis_off()
    _draw_key(panel, len(limits), columns)
    return figure


def _draw_key(panel: list[Axes], used: int, columns: int) -> None:
    """Put the legend into the first empty panel, or where there is room in the first used one."""
    handles, labels = panel[0].get_legend_handles_labels()
    limit = panel[0].lines[-1]
    full = used == len(panel)
    spare = panel[0] if full else panel[used]
    spare.legend([*handles, limit], [*labels, "limit"], loc="best" if full else "center")
    for index in range(used, len(panel)):
        panel[index - columns].xaxis.set_tick_params(labelbottom=True)


def plot_axial_forces(site: Site, log: RunLog) -> Figure:
    """Draw the members' axial forces: the greatest by name, the others as their envelope."""
    axial = log.axial(site.truss.ends) / 1e3
    figure, (axes,) = panels(1, 1, 3.2)
    _draw_members(axes, site, log, axial)
    axes.axhline(0.0, color=REST, linewidth=0.8)
    axes.set_ylabel("axial force, kN (tension +)")
    finish_axes(axes, site, log, named=True)
    return figure


def plot_utilisation(site: Site, log: RunLog, report: Report) -> Figure:
    """Draw the members' utilisation: the greatest by name, the others as their envelope.

    Args:
        report: With the series `utilisation`.
    """
    utilisation = report.series["utilisation"]
    figure, (axes,) = panels(1, 1, 3.0)
    _draw_members(axes, site, log, utilisation)
    draw_limit(axes, site.task.limits.member_utilisation, "limit")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("demand over capacity")
    finish_axes(axes, site, log, named=True)
    return figure


def _draw_members(axes: Axes, site: Site, log: RunLog, values: Array) -> None:
    """Draw values (T, M); the members with the greatest magnitudes get lines and names."""
    order = order_down(np.nanmax(np.abs(values), axis=0))
    named, others = order[:_NAMED], order[_NAMED:]
    if len(others):
        time, low, high = _envelope(log.time, values[:, others])
        axes.fill_between(time, low, high, color=REST, alpha=0.35, linewidth=0, label=f"{len(others)} others, envelope")
    for colour, member in zip(LINES, named, strict=False):
        axes.plot(log.time, values[:, member], color=colour, label=site.truss.members[member].name)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _envelope(time: Array, values: Array) -> tuple[Array, Array, Array]:
    """Least and greatest of values (T, K), over blocks of records when there are many."""
    low, high = np.nanmin(values, axis=1), np.nanmax(values, axis=1)
    size = -(-len(time) // _BLOCKS)
    starts = np.arange(0, len(time), size)
    return time[starts], np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
