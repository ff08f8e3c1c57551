"""The method of joints for any statically determinate framework, group by group of nodes, over a batch of instants."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import TrussError
from vgtsim.kinematics.conditioning import POOR, SINGULAR, invert, warn_poor
from vgtsim.statics.framework import Framework, Group, diagnose

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def substitute_back(frame: Framework, unit: Array, force: Array, nodes: Array, start: int = 0) -> tuple[Array, Array]:
    """Solve the groups one after the other, the last one first; `start` instants stand before these, to name which is wrong.

    Args:
        unit: Directions of the bars, shape (T, B, 3).
        force: L loads on the nodes, shape (L, T, N, 3), N; each pose is inverted once for all of them.
        nodes: Shape (T, N, 3), m, to name what is wrong.

    Returns:
        Bar forces, shape (L, T, B), N, and what is left at the nodes, shape (L, T, N, 3), N: for the supports.

    Raises:
        TrussError: A mechanism, or a self-stress; bars are named.
    """
    groups = frame.groups
    if groups is None:
        diagnose(frame, nodes[0])
        raise TrussError(len(frame.ends), (), "isostatic, but not group by group of nodes")
    inverse = _invert(frame, groups, unit, nodes, start)
    loads, poses, count = force.shape[:3]
    total, found = np.array(force.transpose(1, 2, 3, 0), order="C"), np.empty((*unit.shape[:-1], loads))
    rows, at_node = total.reshape(poses, 3 * count, loads), total.reshape(poses, count, 3 * loads)  # views
    wide = unit[..., None]
    for group, block in zip(groups, inverse, strict=True):
        found[:, group.bars] = pull = -(block @ rows[:, group.rows])
        along = pull[:, :, None] * wide[:, group.bars]
        at_node[:, group.touched] += group.pulls @ along.reshape(poses, len(group.bars), 3 * loads)
    return found.transpose(2, 0, 1), total.transpose(3, 0, 1, 2)


def _invert(frame: Framework, groups: tuple[Group, ...], unit: Array, nodes: Array, start: int) -> list[Array]:
    """Inverses of the groups' equilibrium matrices, each shape (T, k, k)."""
    inverse = [np.empty(0)] * len(groups)
    for alike in frame.blocks:
        matrix = alike.sign * unit[:, alike.bars[:, None, :], alike.axis[:, :, None]]
        blocks = _invert_blocks(frame, matrix, alike.bars, nodes, start)
        for place, which in enumerate(alike.places):
            inverse[which] = blocks[:, place]
    return inverse


def _invert_blocks(frame: Framework, matrix: Array, bars: Indices, nodes: Array, start: int) -> Array:
    """Inverse of each block, shape (T, G, n, n); refuses those so near singular that nothing is left of them."""
    inverse, sine = invert(matrix, 1.0)
    if sine is not None and sine.min() < POOR:
        least = sine.min(axis=1)
        worst = int(np.argmax(least < SINGULAR) if least.min() < SINGULAR else np.argmin(least))
        group = bars[int(np.argmin(sine[worst]))]
        if least[worst] < SINGULAR:
            _refuse(frame, group, nodes[worst], start + worst, float(least[worst]))
        names = ", ".join(frame.bars[i] for i in group[:3])
        warn_poor(f"instant {start + worst}: smallest sine between bars {names}, ...", float(least[worst]), POOR)
    return inverse


def _refuse(frame: Framework, bars: Indices, nodes: Array, instant: int, sine: float) -> NoReturn:
    """Name the mechanism at an instant, in a group of bars whose smallest sine is too small."""
    figure = f"smallest sine between bars {sine:.2g}, sound from {SINGULAR:.0e}"
    try:
        diagnose(frame, nodes)
    except TrussError as error:
        raise TrussError(error.rank, error.members, f"instant {instant}: {error.detail}; {figure}") from None
    detail = f"instant {instant}: so near a mechanism that forces have no digits; {figure}"
    raise TrussError(len(frame.ends), tuple(frame.bars[i] for i in bars), detail)
