"""The method of joints for any statically determinate framework, group by group of nodes, over a batch of instants."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import by_rows, compiled
from vgtsim.errors import TrussError
from vgtsim.kinematics import POOR, SINGULAR, find_sine, invert_in_place, warn_poor
from vgtsim.statics.framework import Framework, diagnose

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
    if (order := frame.elimination) is None:
        diagnose(frame, nodes[0])
        raise TrussError(len(frame.ends), (), "isostatic, but not group by group of nodes")
    total, found = np.array(force, float, order="C"), np.empty((len(force), *unit.shape[:-1]))
    sine = np.empty((len(unit), len(order.begin) - 1))
    _substitute(by_rows(unit), order.ends, order.bars, order.node, order.axis, order.begin, total, found, sine)
    if sine.size and sine.min() < POOR:
        least = sine.min(axis=1)
        worst = int(np.argmax(least < SINGULAR) if least.min() < SINGULAR else np.argmin(least))
        group = int(np.argmin(sine[worst]))
        bars = order.bars[order.begin[group] : order.begin[group + 1]]
        if least[worst] < SINGULAR:
            _refuse(frame, bars, nodes[worst], start + worst, float(least[worst]))
        names = ", ".join(frame.bars[i] for i in bars[:3])
        warn_poor(f"instant {start + worst}: smallest sine between bars {names}, ...", float(least[worst]), POOR)
    return found, total


@compiled
def _substitute(
    unit: Array,
    ends: Indices,
    bars: Indices,
    node: Indices,
    axis: Indices,
    begin: Indices,
    total: Array,
    found: Array,
    sine: Array,
) -> None:
    """Solve the groups, see `Elimination`; loads in `total` are replaced by what the bars leave of them.

    `sine` gets the smallest sine between a bar and the span of the others of its group, shape (T, G), see `find_sine`.
    """
    most = 0
    for g in range(len(begin) - 1):
        most = max(most, begin[g + 1] - begin[g])
    work, rows, length, pull = np.empty((most, most)), np.empty(most, np.intp), np.empty(most), np.empty(most)
    for t in range(len(unit)):
        for g in range(len(begin) - 1):
            first, count = begin[g], begin[g + 1] - begin[g]
            for j in range(count):
                bar, length[j] = bars[first + j], 0.0
                for i in range(count):
                    value = unit[t, bar, axis[first + i]]
                    if ends[bar, 1] == node[first + i]:
                        value = -value
                    elif ends[bar, 0] != node[first + i]:
                        value = 0.0
                    work[i, j] = value
                    length[j] += value * value
                length[j] = max(length[j], 1.0)
            sine[t, g] = find_sine(length, work, count) if invert_in_place(work, rows, count) else 0.0
            for load in range(len(total)):
                for j in range(count):
                    pull[j] = 0.0
                    for i in range(count):
                        pull[j] -= work[j, i] * total[load, t, node[first + i], axis[first + i]]
                for j in range(count):
                    bar = bars[first + j]
                    found[load, t, bar] = pull[j]
                    for k in range(3):
                        total[load, t, ends[bar, 0], k] += pull[j] * unit[t, bar, k]
                        total[load, t, ends[bar, 1], k] -= pull[j] * unit[t, bar, k]


def _refuse(frame: Framework, bars: Indices, nodes: Array, instant: int, sine: float) -> NoReturn:
    """Name the mechanism at an instant, in a group of bars whose smallest sine is too small."""
    figure = f"smallest sine between bars {sine:.2g}, sound from {SINGULAR:.0e}"
    try:
        diagnose(frame, nodes)
    except TrussError as error:
        raise TrussError(error.rank, error.members, f"instant {instant}: {error.detail}; {figure}") from None
    detail = f"instant {instant}: so near a mechanism that forces have no digits; {figure}"
    raise TrussError(len(frame.ends), tuple(frame.bars[i] for i in bars), detail)
