"""The capacity map as CSV and as a plot."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vgtsim.output.figure import styled
from vgtsim.replacing import replacing
from vgtsim.statics import CapacityMap


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
    with styled(), replacing(picture) as partial:
        plot_capacity(found, title).savefig(partial, dpi=150)
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
