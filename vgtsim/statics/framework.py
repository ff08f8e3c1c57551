"""Pin-jointed frameworks: nodes, bars, supports. An arm is one; so is any plane or space truss."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import DescriptionError
from vgtsim.kinematics.truss import Truss

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Framework:
    """Bars that join nodes by ball joints; N nodes, B bars.

    Attributes:
        nodes: Names.
        bars: Names.
        ends: Node indices of each bar, shape (B, 2).
        free: Whether a node may move along each axis; where it may not, a support holds it, shape (N, 3).
        group: Number of each node's group, shape (N,): the bars of a group, those that join its nodes to one another
            or to groups before it, hold its nodes on those groups. Alike for all nodes where nothing is known.
    """

    nodes: tuple[str, ...]
    bars: tuple[str, ...]
    ends: Indices
    free: NDArray[np.bool_]
    group: Indices

    @property
    def equations(self) -> tuple[Indices, Indices]:
        """Node and axis of each equation of equilibrium, shapes (F,)."""
        node, axis = np.nonzero(self.free)
        return node, axis

    def directions(self, nodes: Array) -> Array:
        """Unit vectors of the bars from their first to their second ends, shape (..., B, 3)."""
        span = nodes[..., self.ends[:, 1], :] - nodes[..., self.ends[:, 0], :]
        return span / np.linalg.norm(span, axis=-1, keepdims=True)

    @property
    def incidence(self) -> Array:
        """1 where a bar starts, -1 where it ends, shape (N, B): pulls of bars at their nodes."""
        index = np.arange(len(self.nodes))[:, None]
        return (index == self.ends[:, 0]).astype(float) - (index == self.ends[:, 1])


def make_framework(names: Sequence[str], bars: Sequence[tuple[str, str]], supports: Mapping[str, str]) -> Framework:
    """Name the parts of a framework.

    Args:
        names: Of the nodes.
        bars: Names of the two nodes of each; a bar is called after them, `A-B`.
        supports: Axes along which nodes are held, for example `{"A": "xyz", "B": "yz"}`.

    Returns:
        The framework, as one group.

    Raises:
        DescriptionError: A support is on no node, or a bar ends at none.
    """
    place = {name: index for index, name in enumerate(names)}
    named = [("supports", tuple(supports)), *((f"bars.{i}", bar) for i, bar in enumerate(bars))]
    for key, wanted in named:
        if unknown := [name for name in wanted if name not in place]:
            raise DescriptionError(None, key, f"node {unknown[0]}", f"one of {', '.join(names)}")
    free = np.array([[axis not in supports.get(name, "") for axis in "xyz"] for name in names])
    ends = np.array([[place[first], place[second]] for first, second in bars], dtype=np.intp)
    return Framework(tuple(names), tuple("-".join(bar) for bar in bars), ends, free, np.ones(len(names), dtype=np.intp))


def framework_of(truss: Truss) -> Framework:
    """An arm as a framework: its bars, see `Truss.bars`, and every node that they hold; the mast flange is held."""
    free = np.repeat(truss.group[:, None] > 0, 3, axis=1)
    return Framework(truss.nodes, truss.bar_names, truss.bars, free, truss.group)


def equilibrium_matrix(frame: Framework, nodes: ArrayLike) -> Array:
    """Forces at the free nodes per unit tension in each bar.

    Args:
        frame: The framework.
        nodes: Shape (..., N, 3), m.

    Returns:
        Shape (..., F, B), rows in the order of `Framework.equations`.
    """
    unit = frame.directions(np.asarray(nodes, float))
    node, axis = frame.equations
    return frame.incidence[node] * np.swapaxes(unit[..., axis], -1, -2)
