"""Rank test of a truss: mechanisms and self-stress states, with the members that take part."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.errors import TrussError
from vgtsim.kinematics.truss import Truss
from vgtsim.statics.framework import Framework, equilibrium_matrix, framework_of

_SINGULAR = 1e-9  # singular value, dimensionless: rounding leaves 1e-15, the weakest sound arm has 1e-3
_SHARE = 0.3  # part of the largest component above which a member or node is named


def diagnose(truss: Truss | Framework, nodes: ArrayLike) -> float:
    """Show that a truss is isostatic: no mechanism and no self-stress.

    Args:
        truss: An arm's truss, or any framework.
        nodes: Shape (N, 3), m.

    Returns:
        Smallest singular value of the equilibrium matrix, dimensionless.

    Raises:
        TrussError: There is a mechanism (members at the nodes that move most are named) or a self-stress
            (members that carry most of it are named).

    Source: S. Pellegrino and C. R. Calladine, International Journal of Solids and Structures 22 (1986),
        409-428.
    """
    frame = truss if isinstance(truss, Framework) else framework_of(truss)
    matrix = equilibrium_matrix(frame, nodes)
    left, size, right = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(size > _SINGULAR))
    rows, columns = matrix.shape
    found = []
    members: list[str] = []
    if rank < rows:
        moving = np.zeros(frame.free.shape)
        moving[frame.free] = left[:, -1]
        moved = np.linalg.norm(moving, axis=-1)
        nodes_moving = np.flatnonzero(moved > _SHARE * moved.max())
        members += [frame.bars[i] for i in np.flatnonzero(np.isin(frame.ends, nodes_moving).any(axis=1))]
        at = ", ".join(frame.nodes[i] for i in nodes_moving[:3])
        found.append(f"{rows - rank} mechanism{'s' if rows - rank > 1 else ''}, which move {at}")
    if rank < columns:
        stress = np.abs(right[-1])
        strained = [frame.bars[i] for i in np.argsort(-stress) if stress[i] > _SHARE * stress.max()]
        members = strained + [name for name in members if name not in strained]
        found.append(f"{columns - rank} self-stress{'es' if columns - rank > 1 else ''}")
    if found:
        raise TrussError(rank, tuple(members), " and ".join(found))
    return float(size[-1])
