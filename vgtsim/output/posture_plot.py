"""A posture of an arm, from the side and from above."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.chain import Chain

_COLOURS = {"actuator": "tab:red"}


def draw_posture(chain: Chain, q: ArrayLike, goal: ArrayLike, path: Path) -> None:
    """Draw the truss with its goal.

    Args:
        chain: The arm.
        q: Inputs, shape (A, 3).
        goal: Tool point wanted, in frame G, shape (3,), m.
        path: Image file; its suffix tells the format.
    """
    nodes, wanted = chain.nodes(q), np.asarray(goal, float)
    reach = wanted - chain.mount[:3, 3]
    azimuth = float(np.arctan2(reach[1], reach[0]))
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    figure = Figure(figsize=(9.6, 5.0), layout="constrained")
    views: tuple[tuple[str, NDArray[np.float64], str, str], ...] = (
        ("in the goal's plane", np.array([outward, [0, 0, 1]]), "outward, m", "z, m"),
        ("from above", np.array([[1, 0, 0], [0, 1, 0]], float), "x, m", "y, m"),
    )
    for place, (title, view, across, up) in enumerate(views):
        axes = figure.add_subplot(1, 2, place + 1)
        ends = (nodes @ view.T)[chain.truss.ends]
        colours = [_COLOURS.get(member.role, "0.4") for member in chain.truss.members]
        axes.add_collection(LineCollection(list(ends), colors=colours, linewidths=1.0))
        axes.plot(*(view @ wanted), marker="x", color="tab:blue", markersize=9)
        axes.set_title(title)
        axes.set_xlabel(across)
        axes.set_ylabel(up)
        axes.set_aspect("equal")
        axes.autoscale_view()
    figure.savefig(path)
