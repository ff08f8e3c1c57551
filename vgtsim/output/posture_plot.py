"""Postures of an arm: one from the side and from above, several beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics import Chain
from vgtsim.output.figure import save_figure

_COLOURS = {"actuator": "tab:red"}
_SEVERAL = ("tab:blue", "tab:orange", "tab:green", "tab:purple")


@dataclass(frozen=True)
class Postures:
    """Some postures of an arm that meet one goal.

    Attributes:
        title: What to call the goal.
        goal: Tool point wanted, in frame G, shape (3,), m.
        q: Inputs, shape (k, n), k at most four.
        labels: Of each posture.
    """

    title: str
    goal: NDArray[np.float64]
    q: NDArray[np.float64]
    labels: tuple[str, ...]


def draw_postures(chain: Chain, panels: Sequence[Postures], path: Path) -> None:
    """Draw several postures at each of several goals, each goal seen across its vertical plane.

    Args:
        panels: One for each goal.
        path: Image file; its suffix tells the format.
    """
    figure = Figure(figsize=(4.6 * len(panels), 6.4), layout="constrained")
    for place, panel in enumerate(panels):
        view = _goal_plane(chain, panel.goal)
        axes = figure.add_subplot(1, len(panels), place + 1)
        for q, label, colour in zip(panel.q, panel.labels, _SEVERAL, strict=False):
            ends = (chain.nodes(q) @ view.T)[chain.truss.ends]
            widths = [1.6 if member.role == "actuator" else 0.7 for member in chain.truss.members]
            axes.add_collection(LineCollection(list(ends), colors=colour, linewidths=widths))
            axes.plot([], [], color=colour, label=label)
        axes.plot(*(view @ panel.goal), marker="x", color="black", markersize=9)
        axes.set_title(panel.title)
        axes.set_xlabel("outward, m")
        axes.set_ylabel("z, m")
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize="small")
    save_figure(figure, path)


def _goal_plane(chain: Chain, goal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outward and upward unit vectors of the vertical plane of a goal, shape (2, 3)."""
    reach = goal - chain.mount[:3, 3]
    azimuth = float(np.arctan2(reach[1], reach[0]))
    return np.array([[np.cos(azimuth), np.sin(azimuth), 0.0], [0.0, 0.0, 1.0]])


def draw_posture(chain: Chain, q: ArrayLike, goal: ArrayLike, path: Path) -> None:
    """Draw the truss with its goal.

    Args:
        q: Inputs, shape (n,).
        goal: Tool point wanted, in frame G, shape (3,), m.
        path: Image file; its suffix tells the format.
    """
    nodes, wanted = chain.nodes(q), np.asarray(goal, float)
    figure = Figure(figsize=(9.6, 5.0), layout="constrained")
    views: tuple[tuple[str, NDArray[np.float64], str, str], ...] = (
        ("in the goal's plane", _goal_plane(chain, wanted), "outward, m", "z, m"),
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
    save_figure(figure, path)
