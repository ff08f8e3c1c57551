"""How a figure looks in the report, and how it becomes SVG that follows the page's light or dark ground."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from vgtsim.arrays import Array
from vgtsim.output.colours import HOLD, LIMIT
from vgtsim.replacing import replacing
from vgtsim.verification import JudgedRun, goal_name

WIDTH = 9.6  # inches; the page shows it at full column width
_FEW = 2  # points of a line that only marks a limit or a place
_TOLD = 300  # points of a line that a page can tell values of: one a pixel or two
_INK = "#010203"  # stands for the page's text colour until the SVG is written

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "vgtsim",
    "font.family": ["sans-serif"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    **{f"{part}color": _INK for part in ("axes.edge", "axes.label", "axes.title", "text.", "xtick.", "ytick.")},
    "axes.grid": True,
    "grid.color": "#8a8f98",
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    **{f"{part}.facecolor": "none" for part in ("figure", "axes", "savefig")},
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}


@contextmanager
def styled() -> Iterator[None]:
    """Apply the report's style to every figure made inside."""
    with mpl.rc_context(_STYLE):
        yield


def panels(rows: int, columns: int, height: float) -> tuple[Figure, list[Axes]]:
    """Make a figure of equal panels over one time axis; its height is in inches."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    return figure, list(axes.ravel())


_ANONYMOUS: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None},
    "png": {"Software": None},
}


def save_figure(figure: Figure, path: Path, dpi: float | None = None) -> None:
    """Write a figure on its own ground as an image, whole or not at all; the same figure gives the same file.

    The suffix of the path tells the format; without one it is PNG.
    """
    kind, ground = path.suffix[1:].lower() or "png", figure.get_facecolor()
    with styled(), replacing(path) as whole:
        figure.savefig(whole, format=kind, dpi=dpi or "figure", facecolor=ground, metadata=_ANONYMOUS.get(kind))


def to_svg(figure: Figure, prefix: str, label: str) -> str:
    """Write a figure made under `styled` as an `svg` element for an HTML page, whose text colour its text and axes take.

    The prefix stands before its identifiers, so that those of several figures differ. The label tells readers who do not
    see the figure its content.
    """
    text = io.StringIO()
    with styled():
        # `savefig` would draw twice: once for the layout alone, which a drawing finds by itself
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\sxmlns(:xlink)?="[^"]*"', "", svg).replace("xlink:href", "href").replace(_INK, "currentColor")
    used = set(re.findall(r"(?:url\(#|href=\"#)([^)\"]+)", svg))
    svg = re.sub(r'\sid="([^"]*)"', lambda hit: f' id="{prefix}-{hit[1]}"' if hit[1] in used else "", svg)
    svg = re.sub(r'(url\(#|href="#)', rf"\g<1>{prefix}-", svg)
    svg = re.sub(r'\s(width|height)="[\d.]+pt"', "", svg, count=2)
    told = escape(json.dumps([_describe_axes(figure, axes) for axes in figure.axes if axes.lines]), quote=True)
    return svg.replace("<svg", f'<svg role="img" aria-label="{label}" data-axes="{told}"', 1).strip()


def _describe_axes(figure: Figure, axes: Axes) -> dict[str, Any]:
    """Where axes stand in the drawing, in points from its top left corner, and the lines that a reader may ask values of."""
    wide, high = 72 * figure.get_size_inches()
    box = axes.get_position()
    read = [(str(line.get_label()), *np.asarray(line.get_xydata(), float).T) for line in axes.lines]
    named = ((label, x, y) for label, x, y in read if not label.startswith("_") or len(x) > _FEW)
    return {
        "box": [round(float(v), 2) for v in (box.x0 * wide, (1 - box.y1) * high, box.x1 * wide, (1 - box.y0) * high)],
        "x": [float(f"{edge:.6g}") for edge in axes.get_xlim()],
        "lines": [_describe_line(axes.get_ylabel() if label.startswith("_") else label, x, y) for label, x, y in named],
    }


def _describe_line(name: str, x: Array, y: Array) -> dict[str, Any]:
    every = max(len(x) // _TOLD, 1)
    return {
        "name": name,
        "x": [float(f"{value:.6g}") for value in x[::every]],
        "y": [float(f"{value:.4g}") if np.isfinite(value) else None for value in y[::every]],
    }


def draw_limit(axes: Axes, value: float, label: str) -> None:
    """Draw a limit as a dashed line with its name at the right end."""
    axes.axhline(value, color=LIMIT, linewidth=1.1, linestyle=(0, (5, 2)))
    place = axes.get_yaxis_transform()
    axes.text(0.995, value, label, color=LIMIT, fontsize=7.5, ha="right", va="bottom", transform=place)


def finish_axes(axes: Axes, run: JudgedRun, *, named: bool = False, abscissa: bool = True) -> None:
    """Shade the settled stays over time, with the goals' names if `named`; label the time axis if `abscissa`."""
    for hold in run.holds:
        axes.axvspan(hold.start, hold.end, color=HOLD, alpha=0.12, linewidth=0)
        if named:
            middle, place = (hold.start + hold.end) / 2, axes.get_xaxis_transform()
            name = goal_name(run.site, hold.goal)
            axes.text(middle, 1.02, name, fontsize=7.5, color=HOLD, ha="center", va="bottom", transform=place)
    begin, end = run.log.time[[0, -1]].tolist()
    if end > begin:
        axes.set_xlim(begin, end)
    if abscissa:
        axes.set_xlabel("time, s")
