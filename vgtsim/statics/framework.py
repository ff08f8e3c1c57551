"""Pin-jointed frameworks: nodes, bars, supports, and whether they are mechanisms or carry self-stress. An arm is one.

The method of joints solves any statically determinate one, group by group of nodes, over a batch of instants.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import by_rows, compiled
from vgtsim.errors import TrussError
from vgtsim.kinematics import POOR, SINGULAR, Truss, find_sine, invert_in_place, order_down, warn_poor

_SINGULAR = 1e-9  # singular value, dimensionless: rounding leaves 1e-15, the weakest sound arm has 1e-3
_SHARE = 0.3  # part of the largest component above which a member or node is named


@dataclass(frozen=True, eq=False)
class Framework:
    """Named bars that join named nodes by ball joints; N nodes, B bars.

    Attributes:
        ends: Node indices of each bar, shape (B, 2).
        free: Whether a node may move along each axis, or a support holds it there, shape (N, 3).
        group: Number of each node's group, shape (N,): the bars of a group, those that join its nodes to one another
            or to groups before it, hold its nodes on those groups. Alike for all nodes where nothing is known.
    """

    nodes: tuple[str, ...]
    bars: tuple[str, ...]
    ends: Index
    free: Mask
    group: Index

    @cached_property
    def equations(self) -> tuple[Index, Index]:
        """Node and axis of each equation of equilibrium, shapes (F,)."""
        node, axis = np.nonzero(self.free)
        return node, axis

    def directions(self, nodes: Array) -> Array:
        """Unit vectors of the bars from their first to their second ends, shape (..., B, 3)."""
        flat, unit = by_rows(nodes.reshape(-1, *nodes.shape[-2:])), np.empty((*nodes.shape[:-2], len(self.ends), 3))
        _fill_directions(self.own_ends, flat, unit.reshape(-1, len(self.ends), 3))
        return unit

    @cached_property
    def own_ends(self) -> Index:
        """A copy of `ends`, as compiled functions take it."""
        return np.array(self.ends, np.intp)

    @cached_property
    def incidence(self) -> Array:
        """1 where a bar starts, -1 where it ends, shape (N, B): pulls of bars at their nodes."""
        index = np.arange(len(self.nodes))[:, None]
        return (index == self.ends[:, 0]).astype(float) - (index == self.ends[:, 1])

    @cached_property
    def elimination(self) -> tuple[Index, Index] | None:
        """Bars, and nodes and axes of the equations that give their forces, shape (3, B), and where each group begins.

        Groups of nodes are solved one after the other, the first one last; None where they cannot be.
        """
        node, axis = self.equations
        last, numbers = self.group[self.ends].max(axis=1), np.unique(self.group[node])[::-1]
        bars, rows = ([np.flatnonzero(which == k) for k in numbers] for which in (last, self.group[node]))
        sizes = [len(item) for item in bars]
        if len(last) != len(node) or sizes != [len(item) for item in rows]:
            return None
        order, row = (np.concatenate([np.empty(0, np.intp), *parts]) for parts in (bars, rows))
        return np.stack([order, node[row], axis[row]]), np.cumsum([0, *sizes])


@compiled
def _fill_directions(ends: Index, nodes: Array, unit: Array) -> None:
    for t in range(len(nodes)):
        for b in range(len(ends)):
            square = 0.0
            for k in range(3):
                unit[t, b, k] = nodes[t, ends[b, 1], k] - nodes[t, ends[b, 0], k]
                square += unit[t, b, k] * unit[t, b, k]
            length = np.sqrt(square)
            for k in range(3):
                unit[t, b, k] /= length


@lru_cache(maxsize=64)
def framework_of(truss: Truss) -> Framework:
    """An arm as a framework: its bars, see `Truss.bars`, and every node that they hold; the mast flange is held."""
    free = np.repeat(truss.group[:, None] > 0, 3, axis=1)
    return Framework(truss.nodes, truss.bar_names, truss.bars, free, truss.group)


def equilibrium_matrix(frame: Framework, nodes: ArrayLike) -> Array:
    """Forces in `Framework.equations` per unit tension in each bar, shape (..., F, B), for nodes of shape (..., N, 3), m."""
    unit = frame.directions(np.asarray(nodes, float))
    node, axis = frame.equations
    return frame.incidence[node] * np.swapaxes(unit[..., axis], -1, -2)


def diagnose(truss: Truss | Framework, nodes: ArrayLike) -> float:
    """Smallest singular value, a pure number, of the equilibrium matrix of an isostatic truss; nodes have shape (N, 3), m.

    Raises:
        TrussError: There is a mechanism (members at the nodes that move most are named) or a self-stress
            (members that carry most of it are named).

    Source: S. Pellegrino and C. R. Calladine, International Journal of Solids and Structures 22 (1986), 409-428.
    """
    value, fault, _ = find_fault(truss, nodes)
    if fault is not None:
        raise fault
    return value


def find_fault(truss: Truss | Framework, nodes: ArrayLike) -> tuple[float, TrussError | None, bool]:
    """As `diagnose`: the singular value, what is wrong, and whether it is a mechanism, whatever the members' stiffness."""
    frame = truss if isinstance(truss, Framework) else framework_of(truss)
    matrix = equilibrium_matrix(frame, nodes)
    if not np.all(np.isfinite(matrix)):
        lost = [frame.bars[i] for i in np.flatnonzero(~np.isfinite(matrix).all(axis=0))]
        return 0.0, TrussError(0, tuple(lost), "bars without a direction: their ends coincide, or are no number"), True
    left, size, right = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(size > _SINGULAR))
    rows, columns = matrix.shape
    found = []
    members: list[str] = []
    if rank < rows:
        moving = np.zeros(frame.free.shape)
        moving[frame.free] = np.linalg.norm(left[:, rank:], axis=1)  # of all mechanisms: their mix is chance
        moved = np.linalg.norm(moving, axis=-1)
        nodes_moving = np.flatnonzero(moved > _SHARE * moved.max())
        members += [frame.bars[i] for i in np.flatnonzero(np.isin(frame.ends, nodes_moving).any(axis=1))]
        at = ", ".join(frame.nodes[i] for i in nodes_moving[:3])
        found.append(f"{rows - rank} mechanism{'s' if rows - rank > 1 else ''}, which move {at}")
    if rank < columns:
        stress = np.linalg.norm(right[rank:], axis=0)
        strained = [frame.bars[i] for i in order_down(stress) if stress[i] > _SHARE * stress.max()]
        members = strained + [name for name in members if name not in strained]
        found.append(f"{columns - rank} self-stress{'es' if columns - rank > 1 else ''}")
    if found:
        least = f"smallest singular value {size[-1]:.2g}, sound from {_SINGULAR:.0e}" if len(size) else "no bars"
        if rank == min(rows, columns):  # by the count of bars alone
            least = f"{columns} bars for {rows} equations"
        return 0.0, TrussError(rank, tuple(members), f"{' and '.join(found)}; {least}"), rank < rows
    return float(size[-1]), None, False


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
    if frame.elimination is None:
        diagnose(frame, nodes[0])
        raise TrussError(len(frame.ends), (), "isostatic, but not group by group of nodes")
    order, begin = frame.elimination
    total, found = np.array(force, float, order="C"), np.empty((len(force), *unit.shape[:-1]))
    sine = np.empty((len(unit), len(begin) - 1))
    _substitute(by_rows(unit), frame.own_ends, order, begin, total, found, sine)
    if sine.size and sine.min() < POOR:
        least = sine.min(axis=1)
        worst = int(np.argmax(least < SINGULAR) if least.min() < SINGULAR else np.argmin(least))
        group = int(np.argmin(sine[worst]))
        bars = order[0, begin[group] : begin[group + 1]]
        if least[worst] < SINGULAR:
            _refuse(frame, bars, nodes[worst], start + worst, float(least[worst]))
        names = ", ".join(frame.bars[i] for i in bars[:3])
        warn_poor(f"instant {start + worst}: smallest sine between bars {names}, ...", float(least[worst]), POOR)
    return found, total


@compiled
def _substitute(unit: Array, ends: Index, order: Index, begin: Index, total: Array, found: Array, sine: Array) -> None:
    """Solve the groups, see `Framework.elimination`; loads in `total` are replaced by what the bars leave of them.

    `sine` gets the smallest sine between a bar and the span of the others of its group, shape (T, G), see `find_sine`.
    """
    bars, node, axis, most = order[0], order[1], order[2], 0
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


def _refuse(frame: Framework, bars: Index, nodes: Array, instant: int, sine: float) -> NoReturn:
    """Name the mechanism at an instant, in a group of bars whose smallest sine is too small."""
    figure = f"smallest sine between bars {sine:.2g}, sound from {SINGULAR:.0e}"
    try:
        diagnose(frame, nodes)
    except TrussError as error:
        raise TrussError(error.rank, error.members, f"instant {instant}: {error.detail}; {figure}") from None
    detail = f"instant {instant}: so near a mechanism that forces have no digits; {figure}"
    raise TrussError(len(frame.ends), tuple(frame.bars[i] for i in bars), detail)
