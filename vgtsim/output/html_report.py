"""The report for people: one HTML file with its plots inside."""

from __future__ import annotations

import base64
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module, resources
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from vgtsim.errors import MissingLibraryError
from vgtsim.output import html_tables as tables
from vgtsim.output import run_plots as draw
from vgtsim.output.calculation import make_sheet
from vgtsim.output.figure import styled, to_svg
from vgtsim.output.folders import HTML, RESULTS, VIDEO
from vgtsim.output.quantities import format_quantity
from vgtsim.output.truss_plot import plot_truss, worst_instant
from vgtsim.replacing import replacing
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, Report, describe_removed


@dataclass(frozen=True)
class ReportPlot:
    """One plot of the report, drawn of its run when called; it `needs` some series of the report."""

    name: str
    title: str
    caption: str
    needs: tuple[str, ...]
    plot: Callable[[JudgedRun], Figure]


def list_plots(run: JudgedRun) -> list[ReportPlot]:
    """List the plots of the report in order; nothing is drawn yet."""
    record, member = worst_instant(run)
    force = run.shown.axial[record, member]
    worst = f"t = {run.log.time[record]:.2f} s: {run.shown.names[member]} carries {format_quantity(force, 'N')}"
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
    errors, clear = ("tool_position_error", "tool_angle_error"), ("clearance", "clearance_time")
    plots = [
        ReportPlot("truss", "The truss at its worst instant", coloured, (), plot_truss),
        ReportPlot("tool", "Tool error", tool, errors, draw.plot_tool_error),
        ReportPlot("clearance", "Clearance along the run", near, clear, draw.plot_clearance),
        ReportPlot(
            "utilisation",
            "Member utilisation",
            used,
            ("utilisation",),
            draw.plot_utilisation,
        ),
        ReportPlot("axial", "Axial force in the members", axial, (), draw.plot_axial_forces),
        ReportPlot("forces", "Actuator forces", drive, (), draw.plot_actuator_forces),
        ReportPlot("lengths", "Actuator lengths", length, (), draw.plot_actuator_lengths),
        ReportPlot("mast", "Mast reaction", mast, (), lambda run: draw.plot_reaction(run, run.log.mast_reaction)),
        ReportPlot(
            "riser", "Load on the riser", riser, (), lambda run: draw.plot_reaction(run, run.shown.riser_reaction)
        ),
        ReportPlot("closure", "Closure", gap, ("closure",), draw.plot_closure),
    ]
    if run.log.removed.size:
        waste = f"{describe_removed(run.shown)}. Below: the force of the waste on the tool, upward."
        plots.insert(2, ReportPlot("waste", "Waste removed", waste, (), draw.plot_waste))
    return plots


def write_page(page: Mapping[str, Any], path: str | Path) -> None:
    """Write the page of a run that was described, whole or not at all; it needs no network.

    It has verdict, picture, goals, checks, plots, calculation and settings. A plot without its series says so.
    A film and other results that lie beside it are shown and linked; without them it is whole too.
    """
    with replacing(path) as partial:
        partial.write_text(_render(page, Path(path).parent), encoding="utf-8")


def write_report_pdf(run: JudgedRun, path: str | Path) -> None:
    """Write the report as PDF, whole or not at all: the same page with every check open and without the film.

    Raises:
        MissingLibraryError: WeasyPrint or the system library Pango is not there.
    """
    try:
        weasyprint = import_module("weasyprint")  # of an extra, which few installations have
    except ImportError:
        raise MissingLibraryError("WeasyPrint", "pip install vgtsim[pdf]") from None
    except OSError as error:
        raise MissingLibraryError(f"Pango ({error})", "apt-get install libpango-1.0-0 libpangoft2-1.0-0") from None
    with replacing(path) as partial:
        weasyprint.HTML(string=_render(describe_run(run), None)).write_pdf(partial)


def describe_run(run: JudgedRun) -> dict[str, Any]:
    """All that a page says of a run, by the names of its template; the plots are drawn here, and take seconds.

    A plot without its series says so.
    """
    return _describe(run.site, run.report) | {
        "title": run.site.task.title,
        "notices": tables.list_notices(run.log, run.report),
        "phases": [],
        "plots": [_draw(plot, run) for plot in list_plots(run)],
        "goals": tables.list_goal_rows(run),
        "members": tables.list_members(run),
        "sheet": make_sheet(run),
        "reactions": tables.list_reactions(run),
    }


def describe_mission(runs: Sequence[JudgedRun], report: Report) -> dict[str, Any]:
    """All that a page says of a mission in phases, whose own pages have the plots and tables."""
    absent = {"plots": [], "goals": [], "members": [], "sheet": None, "reactions": []}
    return (
        absent
        | _describe(runs[0].site, report)
        | {
            "title": runs[0].site.task.title.rpartition(":")[0],
            "notices": [f"Note: {note}" for note in report.notes],
            "phases": tables.list_phase_rows(runs),
        }
    )


def _describe(site: Site, report: Report) -> dict[str, Any]:
    """What the pages of runs and missions have in common."""
    return {
        "passed": report.passed,
        "verdict": "PASSED" if report.passed else "FAILED",
        "summary": tables.summarise(report),
        "checks": tables.group_checks(report),
        "settings": tables.list_settings(site),
        "performance": tables.list_costs(report.performance),
        "versions": report.versions.items(),
    }


def _render(page: Mapping[str, Any], folder: Path | None) -> str:
    """The page of a run; without a folder of results it shows and links nothing that lies beside it."""
    beside = [name for name in RESULTS if folder and name != HTML and (folder / name).exists()]
    drawn: dict[str, Any] = {"phase_figures": list(tables.PHASE_FIGURES.values())}
    drawn |= {"style": _read_page("report.css"), "script": _read_page("plots.js")}
    return (
        _load_pages()
        .get_template("report.html")
        .render(page, film=folder and _find_film(folder), beside=beside, **drawn)
    )


@lru_cache(maxsize=1)
def _load_pages() -> Environment:
    pages = PackageLoader("vgtsim.output", "pages")
    return Environment(loader=pages, autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)


def _read_page(name: str) -> str:
    return resources.files("vgtsim.output").joinpath("pages", name).read_text(encoding="utf-8").strip()


def _find_film(folder: Path) -> dict[str, str] | None:
    """The film in a folder with its first frame as a data address, if there is one."""
    if not (folder / VIDEO).is_file():
        return None
    import imageio_ffmpeg

    still = ["-frames:v", "1", "-f", "image2pipe", "-c:v", "mjpeg", "-q:v", "4", "-"]  # 4 of 31: little is lost
    try:
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(folder / VIDEO), *still]
        picture = subprocess.run(command, capture_output=True, check=True).stdout
    except (RuntimeError, OSError, subprocess.CalledProcessError):  # no decoder, or a film that it cannot read
        return {"file": VIDEO, "poster": ""}
    return {"file": VIDEO, "poster": f"data:image/jpeg;base64,{base64.b64encode(picture).decode()}"}


def _draw(plot: ReportPlot, run: JudgedRun) -> dict[str, Any]:
    shown = {"name": plot.name, "title": plot.title, "caption": plot.caption}
    lacking = [name for name in plot.needs if not np.isfinite(run.report.series.get(name, np.nan)).any()]
    if lacking:
        return shown | {"lacking": lacking}
    with styled():
        return shown | {"lacking": [], "svg": to_svg(plot.plot(run), plot.name, plot.title)}
