"""Frameworks that may be statically indeterminate: deflection by direct stiffness, and stiffness under load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.statics.banded_solve import solve_poses
from vgtsim.statics.framework import Framework
from vgtsim.statics.stiffness_matrix import Pattern, add_blocks, assemble, geometric_blocks, make_pattern, unfold

Array = NDArray[np.float64]


def deflect_framework(frame: Framework, nodes: ArrayLike, spring: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Find displacements and bar forces of a framework that may be statically indeterminate.

    Args:
        nodes: Shape (N, 3), m.
        spring: Axial stiffness of each bar, shape (B,), N/m.
        force: Loads on the nodes, shape (N, 3), N.

    Returns:
        Displacements, shape (N, 3), m, and bar forces, tension positive, shape (B,), N.

    Raises:
        TrussError: A mechanism, or bars without stiffness; they are named.
    """
    n, stiffness = np.asarray(nodes, float), np.asarray(spring, float)
    pattern, grow = _framework_pattern(frame), _framework_growth(frame, n)
    matrices = assemble(pattern, grow[None], stiffness[None])
    moved = solve_poses(frame, n[None], matrices, np.asarray(force, float)[frame.free][None, :, None])
    shift = np.zeros(n.shape)
    shift[frame.free] = moved[0, :, 0]
    return shift, matrices.bar(moved)[0, :, 0]


def tangent_stiffness(frame: Framework, nodes: ArrayLike, spring: ArrayLike, bar: ArrayLike) -> Array:
    """Stiffness of a loaded framework at its deformed pose: a zero eigenvalue is where it buckles.

    Args:
        nodes: Deformed, shape (N, 3), m.
        spring: Change of each bar's force per change of its length, shape (B,), N/m.
        bar: Bar forces there, tension positive, shape (B,), N.

    Returns:
        Symmetric, shape (F, F), N/m, in the order of `Framework.equations`.
    """
    n = np.asarray(nodes, float)
    pattern, grow = _framework_pattern(frame), _framework_growth(frame, n)
    difference = np.broadcast_to(np.hstack([-np.eye(3), np.eye(3)]), (len(frame.ends), 3, 6))
    blocks = geometric_blocks(n[frame.ends[:, 1]] - n[frame.ends[:, 0]], np.asarray(bar, float), difference)
    elastic = unfold(assemble(pattern, grow[None], np.asarray(spring, float)[None]).upper[0])
    return elastic + add_blocks(pattern, blocks)


def _framework_pattern(frame: Framework) -> Pattern:
    unknowns = np.full(frame.free.shape, -1, dtype=np.intp)
    unknowns[frame.free] = np.arange(int(frame.free.sum()))
    ends = tuple((int(first), int(second)) for first, second in frame.ends)
    return make_pattern(tuple(tuple(row) for row in unknowns), ends)


def _framework_growth(frame: Framework, nodes: Array) -> Array:
    unit = frame.directions(nodes)
    return np.concatenate([-unit, unit], axis=-1)
