"""Frameworks of the textbooks by the solvers that arms use: joints, deflection, and stiffness under load.

No run needs them: an arm is made into a framework by `vgtsim.statics.framework.framework_of`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import DescriptionError
from vgtsim.statics.framework import Framework, substitute_back
from vgtsim.statics.stiffness_matrix import (
    Pattern,
    add_blocks,
    assemble,
    geometric_blocks,
    make_pattern,
    solve_poses,
    unfold,
)

Array = NDArray[np.float64]


def make_framework(names: Sequence[str], bars: Sequence[tuple[str, str]], supports: Mapping[str, str]) -> Framework:
    """Name the parts of a framework; a bar is called after its two nodes, `A-B`.

    Args:
        names: Of the nodes.
        bars: Names of the two nodes of each.
        supports: Axes along which nodes are held, for example `{"A": "xyz", "B": "yz"}`.

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


def solve_joints(frame: Framework, nodes: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Find the force in every bar and at every support under loads on the nodes, broadcast to shape (..., N, 3), N.

    Returns:
        Bar forces, tension positive, shape (..., B), N, and forces of the supports on the nodes, zero where a node is
        free, shape (..., N, 3), N.

    Raises:
        TrussError: A mechanism, or a self-stress; bars are named.
    """
    n = np.asarray(nodes, float)
    flat = n.reshape(-1, *n.shape[-2:])
    load = np.broadcast_to(force, n.shape).reshape(flat.shape)
    (bar,), (left,) = substitute_back(frame, frame.directions(flat), load[None], flat)
    return bar.reshape(*n.shape[:-2], -1), np.where(frame.free, 0.0, -left).reshape(n.shape)


def deflect_framework(frame: Framework, nodes: ArrayLike, spring: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Find displacements and bar forces of a framework that may be statically indeterminate.

    Args:
        frame: The framework.
        nodes: Shape (N, 3), m.
        spring: Axial stiffness of each bar, shape (B,), N/m.
        force: Loads on the nodes, shape (N, 3), N.

    Returns:
        Displacements, shape (N, 3), m, and bar forces, tension positive, shape (B,), N.

    Raises:
        TrussError: A mechanism, or bars without stiffness; they are named.
    """
    n, stiffness = np.asarray(nodes, float), np.asarray(spring, float)
    matrices = assemble(_pattern(frame), _growth(frame, n)[None], stiffness[None])
    moved = solve_poses(frame, n[None], matrices, np.asarray(force, float)[frame.free][None, :, None])
    shift = np.zeros(n.shape)
    shift[frame.free] = moved[0, :, 0]
    return shift, matrices.bar(moved)[0, :, 0]


def tangent_stiffness(frame: Framework, nodes: ArrayLike, spring: ArrayLike, bar: ArrayLike) -> Array:
    """Stiffness of a loaded framework at its deformed pose: a zero eigenvalue is where it buckles.

    Args:
        frame: The framework.
        nodes: Deformed, shape (N, 3), m.
        spring: Change of each bar's force per change of its length, shape (B,), N/m.
        bar: Bar forces there, tension positive, shape (B,), N.

    Returns:
        Symmetric, shape (F, F), N/m, in the order of `Framework.equations`.
    """
    n, pattern = np.asarray(nodes, float), _pattern(frame)
    difference = np.broadcast_to(np.hstack([-np.eye(3), np.eye(3)]), (len(frame.ends), 3, 6))
    blocks = geometric_blocks(n[frame.ends[:, 1]] - n[frame.ends[:, 0]], np.asarray(bar, float), difference)
    elastic = assemble(pattern, _growth(frame, n)[None], np.asarray(spring, float)[None])
    return unfold(elastic.upper[0]) + add_blocks(pattern, blocks)


def _pattern(frame: Framework) -> Pattern:
    unknowns = np.full(frame.free.shape, -1, dtype=np.intp)
    unknowns[frame.free] = np.arange(int(frame.free.sum()))
    ends = tuple((int(first), int(second)) for first, second in frame.ends)
    return make_pattern(tuple(tuple(row) for row in unknowns), ends)


def _growth(frame: Framework, nodes: Array) -> Array:
    """Elongation of each bar per unit of its ends' displacements, shape (B, 6)."""
    unit = frame.directions(nodes)
    return np.concatenate([-unit, unit], axis=-1)
