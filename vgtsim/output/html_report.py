"""The report for people: one HTML file with its plots inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np
from matplotlib.figure import Figure

from vgtsim.output import html_tables as tables
from vgtsim.output import run_plots as runs
from vgtsim.output.figure import styled, to_svg
from vgtsim.output.quantities import format_quantity
from vgtsim.output.truss_plot import plot_truss, worst_instant
from vgtsim.replacing import replacing
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report, find_riser_reaction


@dataclass(frozen=True)
class ReportPlot:
    """One plot of the report, drawn when called; it `needs` some series of the report."""

    name: str
    title: str
    caption: str
    needs: tuple[str, ...]
    plot: Callable[[], Figure]


def list_plots(site: Site, log: RunLog, report: Report) -> list[ReportPlot]:
    """List the plots of the report in order; nothing is drawn yet."""
    record, member = worst_instant(site, log, report)
    force = log.axial(site.truss.ends)[record, member]
    worst = f"t = {log.time[record]:.2f} s: {site.truss.members[member].name} carries {format_quantity(force, 'N')}"
    coloured = f"{worst}. Members coloured by axial force; actuators drawn thick; goals in green."
    tool = "Distance and angle from the goal being approached; the limits hold while settled."
    near = "Least distance of the arm from tank, riser, equipment and itself."
    used = "Demand over capacity: yield in tension, column strength in compression, cylinder ratings."
    axial = "The members that carry most, by name, and the envelope of the others."
    drive = "Pull positive; dashed: pressure on the annulus (pull) and on the full bore (push)."
    length = "Pin to pin; dashed: retracted and extended."
    mast = "Force and moment of the mast on the arm at the pivot, in frame G."
    riser = "Force and moment of arm and mast on the riser at the crown, in frame G: what the dome must not carry."
    gap = "Greatest gap between a member's end and its hub."
    carried = find_riser_reaction(site, log)
    errors, clear = ("tool_position_error", "tool_angle_error"), ("clearance", "clearance_time")
    rows: tuple[tuple[str, str, str, tuple[str, ...], Callable[[], Figure]], ...] = (
        ("truss", "The truss at its worst instant", coloured, (), lambda: plot_truss(site, log, report)),
        ("tool", "Tool error", tool, errors, lambda: runs.plot_tool_error(site, log, report)),
        ("clearance", "Clearance along the run", near, clear, lambda: runs.plot_clearance(site, log, report)),
        ("utilisation", "Member utilisation", used, ("utilisation",), lambda: runs.plot_utilisation(site, log, report)),
        ("axial", "Axial force in the members", axial, (), lambda: runs.plot_axial_forces(site, log)),
        ("forces", "Actuator forces", drive, (), lambda: runs.plot_actuator_forces(site, log)),
        ("lengths", "Actuator lengths", length, (), lambda: runs.plot_actuator_lengths(site, log)),
        ("mast", "Mast reaction", mast, (), lambda: runs.plot_reaction(site, log, log.mast_reaction)),
        ("riser", "Load on the riser", riser, (), lambda: runs.plot_reaction(site, log, carried)),
        ("closure", "Closure", gap, ("closure",), lambda: runs.plot_closure(site, log, report)),
    )
    return [ReportPlot(*row) for row in rows]


def write_report_html(site: Site, log: RunLog, report: Report, path: str | Path) -> None:
    """Write `report.html`: verdict, checks, goals, plots, settings; it needs no other file and no network.

    The file is written whole or not at all. A plot without its series says so.
    """
    template = Template(resources.files("vgtsim.output").joinpath("report.html").read_text(encoding="utf-8"))
    page = template.substitute(
        title=escape(site.task.title),
        verdict="PASSED" if report.passed else "FAILED",
        verdict_class="pass" if report.passed else "fail",
        summary=escape(tables.summarise(report)),
        notices=tables.notices(log, report),
        checks=tables.check_rows(report),
        goals=tables.goal_rows(site, log, report),
        members=tables.member_rows(site, log, report),
        reactions=tables.reaction_rows(site, log),
        plots="\n".join(_draw(plot, report) for plot in list_plots(site, log, report)),
        settings=tables.fact_rows(tables.list_settings(site)),
        performance=tables.fact_rows(tables.list_costs(report.performance)),
        versions=tables.fact_rows(report.versions.items()),
    )
    with replacing(path) as partial:
        partial.write_text(page, encoding="utf-8")


def _draw(plot: ReportPlot, report: Report) -> str:
    heading = f'<h3 id="{plot.name}">{escape(plot.title)}</h3>'
    lacking = [name for name in plot.needs if not np.isfinite(report.series.get(name, np.nan)).any()]
    if lacking:
        return f'<figure>{heading}<p class="notice">Not measured: {", ".join(lacking)}.</p></figure>'
    with styled():
        svg = to_svg(plot.plot(), plot.name, plot.title)
    return f"<figure>{heading}{svg}<figcaption>{escape(plot.caption)}</figcaption></figure>"
