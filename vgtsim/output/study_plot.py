"""The figures of a study over its keys, drawn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.output.colours import LIMIT
from vgtsim.output.figure import WIDTH, styled

Columns = Mapping[str, Array]

_MOST = 12  # panels high or wide: more cannot be read on one page
_DOTS = 20_000  # cases drawn: more are a black patch
_HIGH = 2.4  # inches of a panel


def plot_study(keys: Columns, figures: Columns, title: str) -> Figure:
    """Draw figures over keys; each column has shape (C,), with NaN for a case that failed.

    Two keys are a map of each figure, with crosses for failed cases; others are a panel for each figure and key, or, of
    keys that are no numbers, the spread of each figure. Columns that do not vary are left out.
    """
    across, shown = _varying(keys), _varying(figures)
    with styled():
        if not shown:
            figure = Figure(figsize=(WIDTH, 1.0), facecolor="#ffffff")
        elif len(across) == 2:
            figure = _draw_maps(across, shown)
        else:
            figure = _draw_panels(across, shown)
        figure.suptitle(title if shown else f"{title}: no figure varies", fontsize=10)
    return figure


def _varying(columns: Columns) -> dict[str, Array]:
    thinned = {name: column[:: len(column) // _DOTS + 1] for name, column in columns.items()}
    kept = [name for name, column in thinned.items() if len(np.unique(column[np.isfinite(column)])) > 1]
    return {name: thinned[name] for name in kept[:_MOST]}


def _draw_maps(keys: Columns, figures: Columns) -> Figure:
    (name_x, x), (name_y, y) = keys.items()
    high = -(-len(figures) // 2)
    figure = Figure(figsize=(WIDTH, 0.6 + 1.4 * _HIGH * high), layout="constrained", facecolor="#ffffff")
    axes = figure.subplots(high, 2, squeeze=False).ravel()
    for panel, (name, value) in zip(axes, figures.items(), strict=False):
        there = np.isfinite(value)
        dots = panel.scatter(x[there], y[there], c=value[there], marker="s", s=30, cmap="viridis")
        panel.scatter(x[~there], y[~there], marker="x", s=20, color=LIMIT, linewidths=0.8)
        figure.colorbar(dots, ax=panel)
        panel.set(title=name, xlabel=name_x, ylabel=name_y, axisbelow=True)
    for panel in axes[len(figures) :]:
        panel.remove()
    return figure


def _draw_panels(keys: Columns, figures: Columns) -> Figure:
    size = (max(WIDTH, 2.6 * len(keys)), 0.6 + _HIGH * len(figures))
    figure = Figure(figsize=size, layout="constrained", facecolor="#ffffff")
    grid: NDArray[np.object_] = figure.subplots(len(figures), max(len(keys), 1), squeeze=False)
    for row, (name, value) in zip(grid, figures.items(), strict=True):
        there = np.isfinite(value)
        for panel, (key, x) in zip(row, keys.items(), strict=False):
            panel.plot(x[there], value[there], ".", markersize=4)
            _mark_failed(panel, x[~there])
            panel.set_xlabel(key)
        if not keys:
            row[0].hist(value[there], bins=60)
        row[0].set_title(name)
    return figure


def _mark_failed(panel: Axes, x: Array) -> None:
    """Crosses at the lower edge for cases without the figure."""
    panel.plot(x, np.zeros(len(x)), "x", color=LIMIT, markersize=4, transform=panel.get_xaxis_transform())
