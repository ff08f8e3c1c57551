"""What a Jacobian says about a configuration: rank, range, null space, conditioning (section 6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from vgtsim.positioning.newton import CONDITION_LIMIT, lost_directions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bases:
    """Bases of the range and of the null space by one factorisation.

    Attributes:
        rank: Number of independent goal directions.
        range: Orthonormal columns that span what the inputs can do to the goal rows, shape (m, rank).
        null: Orthonormal columns that leave the goal rows alone, shape (n, n - rank).
        left: First factor as computed: Q_1 of 6.16, or U of 6.28, shape (m, m).
        right: Q_2 of 6.18, or V of 6.28, shape (n, n).
        values: Magnitude of the diagonal of R_2 in the order of pivoting, or the singular values, shape (min(m, n),).
    """

    rank: int
    range: Array
    null: Array
    left: Array
    right: Array
    values: Array

    @property
    def nullity(self) -> int:
        """Columns less rank (6.15)."""
        return self.right.shape[0] - self.rank


@dataclass(frozen=True)
class Analysis:
    """A Jacobian by singular values, those past the condition limit given up.

    Attributes:
        bases: Range and null space of what is kept.
        condition: Greatest over least singular value of the whole Jacobian, infinite when one is zero.
        kept_condition: The same over the values that are kept (6.32).
        inverse: Pseudo-inverse of what is kept (6.35), shape (n, m).
        lost: Goal directions given up, unit columns, shape (m, m - rank).
        lost_names: One name for each: the goal rows it consists of, greatest part first.
    """

    bases: Bases
    condition: float
    kept_condition: float
    inverse: Array
    lost: Array
    lost_names: tuple[str, ...]

    def step(self, change: ArrayLike) -> tuple[Array, Array]:
        """Least step of the inputs for a change of the goal rows, and the part of the change that is refused.

        Args:
            change: Wanted change, shape (m,).

        Returns:
            Step, shape (n,), at most |change| over the least singular value kept; and the part of the change along lost
            directions, shape (m,).

        Source: equation 6.36 and section 6.2.1.
        """
        wanted = np.asarray(change, float)
        return self.inverse @ wanted, self.lost @ (self.lost.T @ wanted)


def bases_by_svd(jacobian: ArrayLike, limit: float = CONDITION_LIMIT) -> Bases:
    """Range and null space by singular value decomposition.

    Args:
        jacobian: Shape (m, n), augmented by zero rows or not.
        limit: Ratio of the greatest to the least singular value that still counts.

    Returns:
        The bases.

    Source: equations 6.28 to 6.32.
    """
    J = np.asarray(jacobian, float)
    U, values, Vt = np.linalg.svd(J)
    rank = int(np.sum(values > values[0] / limit)) if values[0] > 0 else 0
    return Bases(rank=rank, range=U[:, :rank], null=Vt[rank:].T, left=U, right=Vt.T, values=values)


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
    return Bases(rank=rank, range=Q1[:, :same], null=Q2[:, rank:], left=Q1, right=Q2, values=second)


def analyse(jacobian: ArrayLike, names: tuple[str, ...] | None = None, limit: float = CONDITION_LIMIT) -> Analysis:
    """Analyse a Jacobian.

    Args:
        jacobian: Shape (m, n); rows that are all zero (augmentation) are no goal rows and must be left out.
        names: Of the goal rows, for the lost directions.
        limit: Condition number past which singular values are given up.

    Returns:
        The analysis.

    Raises:
        ValueError: The Jacobian is not finite, or the names do not match its rows.

    Source: section 6.2.1.
    """
    J = np.asarray(jacobian, float)
    if not np.all(np.isfinite(J)):
        raise ValueError("the Jacobian holds values that are not finite")
    labels = names or tuple(f"row {i + 1}" for i in range(len(J)))
    if len(labels) != len(J):
        raise ValueError(f"{len(labels)} names for {len(J)} goal rows")
    bases = bases_by_svd(J, limit)
    values, rank = bases.values, bases.rank
    least = values[-1] if len(J) <= J.shape[1] else 0.0
    kept = values[:rank]
    inverse = bases.right[:, :rank] / kept @ bases.left[:, :rank].T
    lost = bases.left[:, rank:]
    return Analysis(
        bases=bases,
        condition=float(values[0] / least) if least > 0 else inf,
        kept_condition=float(kept[0] / kept[-1]) if rank else inf,
        inverse=inverse,
        lost=lost,
        lost_names=lost_directions(J, labels, limit),
    )
