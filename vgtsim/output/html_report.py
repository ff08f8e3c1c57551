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

from vgtsim.description import Scene
from vgtsim.kinematics import Truss
from vgtsim.output import html_facts as facts
from vgtsim.output import html_tables as tables
from vgtsim.output.figure import styled, to_svg
from vgtsim.output.html_loads import member_rows, reaction_rows
from vgtsim.output.member_plots import (
    plot_actuator_forces,
    plot_actuator_lengths,
    plot_axial_forces,
    plot_utilisation,
)
from vgtsim.output.quantities import format_quantity
from vgtsim.output.run_plots import plot_clearance, plot_closure, plot_reaction, plot_tool_error
from vgtsim.output.truss_plot import plot_truss, worst_instant
from vgtsim.replacing import replacing
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification.report import Report
from vgtsim.verification.supports import find_riser_reaction


@dataclass(frozen=True)
class Section:
    """One plot of the report.

    Attributes:
        name: Short, for identifiers.
        title: Its heading.
        caption: What to look for.
        needs: Series of the report that it cannot do without.
        plot: Draws it.
    """

    name: str
    title: str
    caption: str
    needs: tuple[str, ...]
    plot: Callable[[], Figure]


def list_sections(scene: Scene, log: RunLog, report: Report, truss: Truss) -> list[Section]:
    """List the plots of the report in order.

    Args:
        scene: The scene.
        log: The run.
        report: With series.
        truss: The arm's truss.

    Returns:
        One section for each plot; nothing is drawn yet.
    """
    record, member = worst_instant(log, truss, report)
    force = log.axial(truss.ends)[record, member]
    worst = f"t = {log.time[record]:.2f} s: {truss.members[member].name} carries {format_quantity(force, 'N')}"
    tool = ("tool_position_error", "tool_angle_error")
    return [
        Section(
            "truss",
            "The truss at its worst instant",
            f"{worst}. Members coloured by axial force; actuators drawn thick; goals in green.",
            (),
            lambda: plot_truss(scene, log, truss, report),
        ),
        Section(
            "tool",
            "Tool error",
            "Distance and angle from the goal being approached; the limits hold while settled.",
            tool,
            lambda: plot_tool_error(scene, log, report),
        ),
        Section(
            "clearance",
            "Clearance along the run",
            "Least distance of the arm from tank, riser, equipment and itself.",
            ("clearance", "clearance_time"),
            lambda: plot_clearance(scene, log, report),
        ),
        Section(
            "utilisation",
            "Member utilisation",
            "Demand over capacity: yield in tension, column strength in compression, cylinder ratings.",
            ("utilisation",),
            lambda: plot_utilisation(scene, log, truss, report),
        ),
        Section(
            "axial",
            "Axial force in the members",
            "The members that carry most, by name, and the envelope of the others.",
            (),
            lambda: plot_axial_forces(scene, log, truss),
        ),
        Section(
            "forces",
            "Actuator forces",
            "Pull positive; dashed: pressure on the annulus (pull) and on the full bore (push).",
            (),
            lambda: plot_actuator_forces(scene, log, truss),
        ),
        Section(
            "lengths",
            "Actuator lengths",
            "Pin to pin; dashed: retracted and extended.",
            (),
            lambda: plot_actuator_lengths(scene, log, truss),
        ),
        Section(
            "mast",
            "Mast reaction",
            "Force and moment of the mast on the arm at the pivot, in frame G.",
            (),
            lambda: plot_reaction(scene, log, log.mast_reaction),
        ),
        Section(
            "riser",
            "Load on the riser",
            "Force and moment of arm and mast on the riser at the crown, in frame G: what the dome must not carry.",
            (),
            lambda: plot_reaction(scene, log, find_riser_reaction(Site(scene), log)),
        ),
        Section(
            "closure",
            "Closure",
            "Greatest gap between a member's end and its hub.",
            ("closure",),
            lambda: plot_closure(scene, log, report),
        ),
    ]


def write_report_html(scene: Scene, log: RunLog, report: Report, truss: Truss, path: str | Path) -> None:
    """Write `report.html`: verdict, checks, goals, plots, settings; it needs no other file and no network.

    Args:
        scene: The scene.
        log: The run.
        report: Its verdicts, with series for the plots; a plot without its series says so.
        truss: The arm's truss.
        path: File to write, whole or not at all.

    Raises:
        OSError: The folder cannot be written.
    """
    template = Template(resources.files("vgtsim.output").joinpath("report.html").read_text(encoding="utf-8"))
    page = template.substitute(
        title=escape(scene.task.title),
        verdict="PASSED" if report.passed else "FAILED",
        verdict_class="pass" if report.passed else "fail",
        summary=escape(tables.summarise(report)),
        notices=tables.notices(log),
        checks=tables.check_rows(report),
        goals=tables.goal_rows(scene, log, report),
        members=member_rows(log, report, truss),
        reactions=reaction_rows(scene, log),
        plots="\n".join(_draw(section, report) for section in list_sections(scene, log, report, truss)),
        settings=facts.fact_rows(facts.list_settings(scene, truss)),
        performance=facts.fact_rows(facts.list_costs(report)),
        versions=facts.fact_rows(report.versions.items()),
    )
    with replacing(path) as partial:
        partial.write_text(page, encoding="utf-8")


def _draw(section: Section, report: Report) -> str:
    heading = f'<h3 id="{section.name}">{escape(section.title)}</h3>'
    lacking = [name for name in section.needs if not np.isfinite(report.series.get(name, np.nan)).any()]
    if lacking:
        return f'<figure>{heading}<p class="notice">Not measured: {", ".join(lacking)}.</p></figure>'
    with styled():
        svg = to_svg(section.plot(), section.name, section.title)
    return f"<figure>{heading}{svg}<figcaption>{escape(section.caption)}</figcaption></figure>"
