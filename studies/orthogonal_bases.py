"""Range and null space by orthogonal factorisation, the other way of section 6.2."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from vgtsim.positioning.analysis import CONDITION_LIMIT, Bases

Array = NDArray[np.float64]


def bases_by_qr(jacobian: ArrayLike, limit: float = CONDITION_LIMIT) -> Bases:
    """Range and null space by orthogonal factorisation of the Jacobian and of its transpose.

    Args:
        jacobian: Shape (m, n).
        limit: Ratio of the greatest to the least diagonal entry that still counts.

    Returns:
        The bases.

    Source: equations 6.16 to 6.18. Differs: columns are exchanged so that the diagonal falls (pivoting); without it a
    zero can appear on the diagonal before the rank is spent.
    """
    J = np.asarray(jacobian, float)
    Q1, R1, _ = cast(tuple[Array, Array, Array], qr(J, pivoting=True))
    Q2, R2, _ = cast(tuple[Array, Array, Array], qr(J.T, pivoting=True))
    first, second = np.abs(np.diag(R1)), np.abs(np.diag(R2))
    rank = int(np.sum(second > second[0] / limit)) if second[0] > 0 else 0
    same = int(np.sum(first > first[0] / limit)) if first[0] > 0 else 0
    return Bases(rank, Q1[:, :same], Q2[:, rank:], Q1, Q2, second)
