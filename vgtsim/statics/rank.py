"""Rank test of a truss: mechanisms and self-stress states, with the members that take part."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.errors import TrussError
from vgtsim.kinematics import Truss
from vgtsim.kinematics.ties import order_down
from vgtsim.statics.framework import Framework, equilibrium_matrix, framework_of

_SINGULAR = 1e-9  # singular value, dimensionless: rounding leaves 1e-15, the weakest sound arm has 1e-3
_SHARE = 0.3  # part of the largest component above which a member or node is named


def diagnose(truss: Truss | Framework, nodes: ArrayLike) -> float:
    """Smallest singular value, a pure number, of the equilibrium matrix of an isostatic truss; nodes have shape (N, 3), m.

    Raises:
        TrussError: There is a mechanism (members at the nodes that move most are named) or a self-stress
            (members that carry most of it are named).

    Source: S. Pellegrino and C. R. Calladine, International Journal of Solids and Structures 22 (1986), 409-428.
    """
    value, fault, _ = _find_fault(truss, nodes)
    if fault is not None:
        raise fault
    return value


def find_mechanism(truss: Truss | Framework, nodes: ArrayLike) -> TrussError | None:
    """The error of `diagnose` where a truss is a mechanism by its shape alone, whatever its members' stiffness; else None."""
    _, fault, loose = _find_fault(truss, nodes)
    return fault if loose else None


def _find_fault(truss: Truss | Framework, nodes: ArrayLike) -> tuple[float, TrussError | None, bool]:
    """Smallest singular value, what is wrong, and whether there is a mechanism in it."""
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
