"""Reachable volume, tilt, dexterity and singular regions of an arm, drawn."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from vgtsim.kinematics.workspace import NEAR_SINGULAR, Workspace
from vgtsim.output.figure import WIDTH, styled

_GRID = 45  # cells across a panel


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
            (axes[0, 0], radius, height, np.degrees(found.tilt), np.max, "greatest tilt of the tool, degrees", side),
            (axes[0, 1], radius, height, found.dexterity, np.max, "greatest dexterity", side),
            (axes[1, 0], x, y, found.singular, np.min, "least singular value of a module", ("x, m", "y, m")),
        )
        for panel, across, up, value, pick, name, labels in panels:
            hexes = panel.hexbin(across, up, value, gridsize=_GRID, reduce_C_function=pick, mincnt=1, linewidths=0.1)
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
