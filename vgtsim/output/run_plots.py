"""A run over time: closure, tool error, clearance, reactions; strokes, forces and utilisation of the members."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vgtsim.arrays import Array, Mask
from vgtsim.kinematics import order_down
from vgtsim.output.colours import HOLD, LIMIT, LINES, REST
from vgtsim.output.figure import draw_limit, finish_axes, panels
from vgtsim.site import Site
from vgtsim.verification import JudgedRun

_LEAST_GAP = 1e-15  # m; a logarithmic axis has no zero
_NAMED = 5  # members drawn by name; `LINES` has six colours
_BLOCKS = 400  # points of an envelope; more cannot be told apart on the page


def plot_closure(run: JudgedRun) -> Figure:
    """Draw the greatest gap between a member's end and its hub: the report's series `closure`."""
    figure, (axes,) = panels(1, 1, 2.4)
    gap, limit = run.report.series["closure"], run.site.task.limits.closure
    axes.semilogy(run.log.time, np.maximum(gap, _LEAST_GAP), color=LINES[0])
    draw_limit(axes, limit, "limit")
    axes.set_ylim(top=2.5 * max(limit, float(np.nanmax(gap))))
    axes.set_ylabel("greatest gap, m")
    finish_axes(axes, run, named=True)
    return figure


def plot_tool_error(run: JudgedRun) -> Figure:
    """Draw the tool's distance and angle from its goal: the report's `tool_position_error` and `tool_angle_error`."""
    figure, (place, turn) = panels(2, 1, 3.9)
    limits = run.site.task.limits
    rows = (
        (place, run.report.series["tool_position_error"], 1e3, limits.tracking_position, "position error, mm"),
        (turn, run.report.series["tool_angle_error"], 180 / np.pi, limits.tracking_angle, "angle error, °"),
    )
    for axes, error, factor, limit, label in rows:
        shown = np.maximum(error, limit * 1e-6) * factor  # six decades below the limit are enough
        axes.semilogy(run.log.time, shown, color=REST, linewidth=1.0, label="on the way")
        axes.semilogy(
            run.log.time, np.where(run.log.settled, shown, np.nan), color=HOLD, linewidth=3.0, label="settled"
        )
        draw_limit(axes, limit * factor, "limit when settled")
        axes.set_ylabel(label)
        finish_axes(axes, run, named=axes is place, abscissa=axes is turn)
    turn.legend(loc="lower left", ncols=2)
    return figure


def plot_clearance(run: JudgedRun) -> Figure:
    """Draw the least distance from the arm to anything: the report's `clearance` over `clearance_time`."""
    figure, (axes,) = panels(1, 1, 2.4)
    time, clearance = run.report.series["clearance_time"], np.asarray(run.report.series["clearance"]) * 1e3
    axes.plot(time, clearance, color=LINES[0])
    worst = int(np.nanargmin(clearance))
    axes.plot(time[worst], clearance[worst], "o", markersize=5, color=LINES[1])
    draw_limit(axes, run.site.task.limits.clearance * 1e3, "limit")
    axes.set_ylim(bottom=min(0.0, 1.1 * float(clearance[worst])))
    axes.set_ylabel("clearance, mm")
    finish_axes(axes, run, named=True)
    return figure


def plot_waste(run: JudgedRun) -> Figure:
    """Draw the waste removed, with its mass, and the push of the tool."""
    figure, (volume, push) = panels(2, 1, 3.9)
    volume.plot(run.log.time, 1e3 * run.log.removed, color=LINES[0])
    volume.set_ylabel("waste removed, l")
    density = run.site.tank.waste.density / 1e3  # kg/l
    mass = volume.secondary_yaxis(
        "right", functions=(lambda v: np.multiply(v, density), lambda m: np.divide(m, density))
    )
    mass.set_ylabel("kg")
    push.plot(run.log.time, np.linalg.norm(run.log.tool_force, axis=1), color=LINES[1])
    push.set_ylabel("push of the tool, N")
    finish_axes(volume, run, named=True, abscissa=False)
    finish_axes(push, run)
    return figure


def plot_reaction(run: JudgedRun, wrench: Array) -> Figure:
    """Draw the history of a support's force and moment in frame G, shape (T, 6), N and N·m."""
    figure, (force, moment) = panels(2, 1, 3.9)
    for axes, first, label in ((force, 0, "force, kN"), (moment, 3, "moment, kN·m")):
        part = wrench[:, first : first + 3] / 1e3
        for axis, name in enumerate("xyz"):
            axes.plot(run.log.time, part[:, axis], color=LINES[axis], label=name)
        size = np.linalg.norm(part, axis=-1)
        axes.plot(run.log.time, size, color=REST, linewidth=0.9, linestyle=":", label="magnitude")
        axes.set_ylabel(label)
        finish_axes(axes, run, named=axes is force, abscissa=axes is moment)
    force.legend(loc="center right", bbox_to_anchor=(1.0, 0.28), ncols=4)  # clear of zero and of the weight
    return figure


def plot_actuator_lengths(run: JudgedRun) -> Figure:
    """Draw the actuators' lengths, module by module, between the ends of their strokes."""
    parts = [run.site.arm.cylinders[name] for name in _first_cylinders(run.site)]
    return _draw_modules(run, run.log.actual, [(part.retracted, part.extended) for part in parts], "length, m")


def plot_actuator_forces(run: JudgedRun) -> Figure:
    """Draw the drives' forces, module by module, between greatest push and pull; tension positive."""
    parts = [run.site.arm.cylinders[name] for name in _first_cylinders(run.site)]
    limits = [(-part.push / 1e3, part.pull / 1e3) for part in parts]
    return _draw_modules(run, run.log.actuator_force / 1e3, limits, "force, kN")


def _owned(site: Site) -> list[Mask]:
    """Tell of every active module its actuators, shape (J,)."""
    owner = site.truss.module[site.truss.actuated]
    return [owner == site.arm.modules.index(module) for module in site.arm.active]


def _first_cylinders(site: Site) -> list[str]:
    """Name the first cylinder of every active module."""
    return [site.truss.members[site.truss.actuated[own][0]].section for own in _owned(site)]


def _draw_modules(run: JudgedRun, values: Array, limits: list[tuple[float, float]], label: str) -> Figure:
    """Draw one panel for each active module; values (T, J), limits of each module's first cylinder."""
    site, columns = run.site, min(len(limits), 3)
    rows = -(-len(limits) // columns)
    figure, panel = panels(rows, columns, 0.5 + 1.75 * rows)
    modules = zip(panel, site.arm.active, _owned(site), _first_cylinders(site), limits, strict=False)
    for index, (axes, module, own, cylinder, ends) in enumerate(modules):
        for line, (colour, value) in enumerate(zip(LINES, values[:, own].T, strict=False)):
            axes.plot(run.log.time, value, color=colour, linewidth=1.1, label=f"actuator {line + 1}")
        for end in ends:
            axes.axhline(end, color=LIMIT, linewidth=1.1, linestyle=(0, (5, 2)))
        axes.set_title(f"{module.name} ({cylinder})")
        if index % columns == 0:
            axes.set_ylabel(label)
        finish_axes(axes, run, abscissa=index + columns >= len(limits))
    for axes in panel[len(limits) :]:
        axes.set_axis_off()
    _draw_key(panel, len(limits), columns)
    return figure


def _draw_key(panel: list[Axes], used: int, columns: int) -> None:
    """Put the legend into the first empty panel, or where there is room in the first used one."""
    handles, labels = panel[0].get_legend_handles_labels()
    full = used == len(panel)
    spare = panel[0] if full else panel[used]
    spare.legend([*handles, panel[0].lines[-1]], [*labels, "limit"], loc="best" if full else "center")
    for index in range(used, len(panel)):
        panel[index - columns].xaxis.set_tick_params(labelbottom=True)


def plot_axial_forces(run: JudgedRun) -> Figure:
    """Draw the members' axial forces: the greatest by name, the others as their envelope."""
    figure, (axes,) = panels(1, 1, 3.2)
    _draw_members(axes, run, run.shown.axial / 1e3)
    axes.axhline(0.0, color=REST, linewidth=0.8)
    axes.set_ylabel("axial force, kN (tension +)")
    finish_axes(axes, run, named=True)
    return figure


def plot_utilisation(run: JudgedRun) -> Figure:
    """Draw the report's series `utilisation`: the greatest by name, the others as their envelope."""
    figure, (axes,) = panels(1, 1, 3.0)
    _draw_members(axes, run, run.report.series["utilisation"])
    draw_limit(axes, run.site.task.limits.member_utilisation, "limit")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("demand over capacity")
    finish_axes(axes, run, named=True)
    return figure


def _draw_members(axes: Axes, run: JudgedRun, values: Array) -> None:
    """Draw values (T, M); the members with the greatest magnitudes get lines and names."""
    order = order_down(np.nanmax(np.abs(values), axis=0))
    named, others = order[:_NAMED], order[_NAMED:]
    if len(others):
        low, high = np.nanmin(values[:, others], axis=1), np.nanmax(values[:, others], axis=1)
        starts = np.arange(0, len(run.log.time), -(-len(run.log.time) // _BLOCKS))
        low, high = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        label = f"{len(others)} others, envelope"
        axes.fill_between(run.log.time[starts], low, high, color=REST, alpha=0.35, linewidth=0, label=label)
    for colour, member in zip(LINES, named, strict=False):
        axes.plot(run.log.time, values[:, member], color=colour, label=run.shown.names[member])
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
