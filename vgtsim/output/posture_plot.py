"""A posture of an arm, from the side and from above."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.output.figure import save_figure


def draw_posture(chain: Chain, q: ArrayLike, goal: ArrayLike, path: Path) -> None:
    """Draw the truss at inputs q, shape (n,), with its goal, a tool point in frame G, shape (3,), m.

    The suffix of the path tells the format.
    """
    nodes, wanted = chain.nodes(q), np.asarray(goal, float)
    figure = Figure(figsize=(9.6, 5.0), layout="constrained")
    views: tuple[tuple[str, NDArray[np.float64], str, str], ...] = (
        ("in the goal's plane", goal_plane(chain, wanted), "outward, m", "z, m"),
        ("from above", np.eye(3)[:2], "x, m", "y, m"),
    )
    colours = ["tab:red" if member.role == "actuator" else "0.4" for member in chain.truss.members]
    for place, (title, view, across, up) in enumerate(views):
        axes = figure.add_subplot(1, 2, place + 1)
        ends = (nodes @ view.T)[chain.truss.ends]
        axes.add_collection(LineCollection(list(ends), colors=colours, linewidths=1.0))
        axes.plot(*(view @ wanted), marker="x", color="tab:blue", markersize=9)
        axes.set(title=title, xlabel=across, ylabel=up, aspect="equal")
        axes.autoscale_view()
    save_figure(figure, path)


def goal_plane(chain: Chain, goal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outward and upward unit vectors of the vertical plane of a goal in frame G, shape (2, 3)."""
    reach = goal - chain.mount[:3, 3]
    azimuth = float(np.arctan2(reach[1], reach[0]))
    return np.array([[np.cos(azimuth), np.sin(azimuth), 0.0], [0.0, 0.0, 1.0]])
