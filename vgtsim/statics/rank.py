"""Rank test of a truss: mechanisms and self-stress states, with the members that take part."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import TrussError
from vgtsim.kinematics.truss import Truss

Array = NDArray[np.float64]

_SINGULAR = 1e-9  # singular value, dimensionless: rounding leaves 1e-15, the weakest sound arm has 1e-3
_SHARE = 0.3  # part of the largest component above which a member or node is named


def equilibrium_matrix(truss: Truss, nodes: ArrayLike) -> Array:
    """Forces at the free nodes per unit tension in each bar.

    Args:
        truss: Nodes and members.
        nodes: Shape (N, 3), m.

    Returns:
        Shape (3 F, B): rows by node and axis, the mast flange's nodes and the middles of joint blocks left out;
        columns the bars of the truss.
    """
    n = np.asarray(nodes, float)
    ends = truss.bars
    span = n[ends[:, 1]] - n[ends[:, 0]]
    unit = span / np.linalg.norm(span, axis=-1, keepdims=True)
    matrix = np.zeros((*n.shape, len(ends)))
    column = np.arange(len(ends))
    matrix[ends[:, 0], :, column] += unit
    matrix[ends[:, 1], :, column] -= unit
    return matrix[truss.group > 0].reshape(-1, len(ends))


def diagnose(truss: Truss, nodes: ArrayLike) -> float:
    """Show that a truss is isostatic: no mechanism and no self-stress.

    Args:
        truss: Nodes and members.
        nodes: Shape (N, 3), m.

    Returns:
        Smallest singular value of the equilibrium matrix, dimensionless.

    Raises:
        TrussError: There is a mechanism (members at the nodes that move most are named) or a self-stress
            (members that carry most of it are named).

    Source: S. Pellegrino and C. R. Calladine, International Journal of Solids and Structures 22 (1986),
        409-428.
    """
    matrix = equilibrium_matrix(truss, nodes)
    left, size, right = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(size > _SINGULAR))
    rows, columns = matrix.shape
    names, free = truss.bar_names, np.flatnonzero(truss.group > 0)
    found = []
    members: list[str] = []
    if rank < rows:
        moving = np.linalg.norm(left[:, -1].reshape(-1, 3), axis=-1)
        nodes_moving = set(free[moving > _SHARE * moving.max()].tolist())
        members += [member.name for member in truss.members if nodes_moving & set(member.ends)]
        at = ", ".join(truss.nodes[i] for i in sorted(nodes_moving)[:3])
        found.append(f"{rows - rank} mechanism{'s' if rows - rank > 1 else ''}, which move {at}")
    if rank < columns:
        stress = np.abs(right[-1])
        strained = [names[i] for i in np.argsort(-stress) if stress[i] > _SHARE * stress.max()]
        members = strained + [name for name in members if name not in strained]
        found.append(f"{columns - rank} self-stress{'es' if columns - rank > 1 else ''}")
    if found:
        raise TrussError(rank, tuple(members), " and ".join(found))
    return float(size[-1])
