"""What an arm can carry and where it can reach: the capacity map as CSV and drawn, a sample of the workspace drawn."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vgtsim.kinematics import NEAR_SINGULAR, Workspace
from vgtsim.output.figure import WIDTH, save_figure, styled
from vgtsim.replacing import replacing
from vgtsim.statics import CapacityMap

_GRID = 45  # cells across a panel of the workspace


def write_capacity(found: CapacityMap, title: str, folder: Path) -> tuple[Path, Path]:
    """Write `capacity.csv` and `capacity.png`."""
    table, picture = folder / "capacity.csv", folder / "capacity.png"
    with replacing(table) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        bends = [f"{what}_{i + 1}_deg" for i in range(found.bends.shape[1]) for what in ("bend", "azimuth")]
        sag = f"sag_with_{found.reference:.0f}_kg_m"
        writer.writerow(["radius_m", "depth_m", "payload_kg", "governing_member", "governing_limit", sag, *bends])
        shapes = np.degrees(np.stack([found.bends, found.azimuths], axis=-1)).reshape(len(found.radius), -1)
        for i, shape in enumerate(shapes):
            place = [f"{found.radius[i]:.3f}", f"{found.depth[i]:.3f}", f"{found.payload[i]:.1f}"]
            angles = [f"{value:.2f}" for value in shape]
            writer.writerow([*place, found.member[i], found.limit[i], f"{found.sag[i]:.4f}", *angles])
    with styled():
        save_figure(plot_capacity(found, title), picture, 150)
    return table, picture


def plot_capacity(found: CapacityMap, title: str) -> Figure:
    """Draw allowable payload and sag over radius and depth, side by side."""
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    values = (
        (np.maximum(found.payload, 0.0), "allowable payload, kg", "viridis"),
        (found.sag, f"sag with {found.reference:.0f} kg, m", "magma_r"),
    )
    for place, (value, label, colours) in zip(axes, values, strict=True):
        # what hangs straight down carries ten times what reaches out
        norm = "log" if place is axes[0] and value.min() > 0 else "linear"
        top = float(np.quantile(value, 0.97))
        shown = np.minimum(value, top)
        dots = place.scatter(found.radius, found.depth, c=shown, marker="s", s=46, cmap=colours, norm=norm)
        figure.colorbar(dots, ax=place, label=label)
        place.set(xlabel="radius, m", aspect="equal")
    axes[0].set_ylabel("depth below the pivot, m")
    axes[0].invert_yaxis()
    figure.suptitle(title, parse_math=False)
    return figure


def plot_workspace(found: Workspace, title: str) -> Figure:
    """Draw a sample of the workspace in the frame of the base face.

    The panels show greatest tilt and greatest dexterity by distance from the axis and height, tool points from along the
    axis with the least singular value, and the spread of tilt.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 8.4), layout="constrained", facecolor="#ffffff")
        axes = figure.subplots(2, 2)
        x, y, height = found.tool.T
        radius = np.hypot(x, y)
        side = ("distance from the axis, m", "along the axis of the base, m")
        panels = (
            (axes[0, 0], (radius, height, np.degrees(found.tilt)), np.max, "greatest tilt of the tool, degrees", side),
            (axes[0, 1], (radius, height, found.dexterity), np.max, "greatest dexterity", side),
            (axes[1, 0], (x, y, found.singular), np.min, "least singular value of a module", ("x, m", "y, m")),
        )
        for panel, columns, pick, name, labels in panels:
            hexes = panel.hexbin(*columns, gridsize=_GRID, reduce_C_function=pick, mincnt=1, linewidths=0.1)
            figure.colorbar(hexes, ax=panel, label=name, shrink=0.85)
            panel.set(xlabel=labels[0], ylabel=labels[1], aspect="equal", axisbelow=True)
        axes[1, 1].hist(np.degrees(found.tilt), bins=60, color="#4573b0")
        axes[1, 1].set(xlabel="tilt of the tool, degrees", ylabel="configurations")
        figure.suptitle(
            f"{title}: {len(found.tool)} configurations over the strokes\nreach {found.reach:.2f} m, volume at least "
            f"{found.volume:.3g} m³, {100 * found.near_singular:.2g} % with a singular value below {NEAR_SINGULAR}",
            fontsize=10,
            parse_math=False,
        )
    return figure
