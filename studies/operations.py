"""Floating-point operations of an iteration: the dissertation's count and this implementation's."""

from __future__ import annotations

from dataclasses import dataclass

ITERATION = 1.25  # an iteration over its singular value decomposition (section 6.4)
BENCHMARK = 3121e3  # operations a second of the 66 MHz 486 of section 6.4
SUSTAINED = 4  # iterations allowed for in table 6.1


@dataclass(frozen=True)
class Count:
    """Operations for an arm of n inputs.

    Attributes:
        inputs: n.
        decomposition: Singular value decomposition (6.64).
        iteration: One iteration of the dissertation.
        four: Four of them.
        ours: One iteration of `newton`.
        rate: Solutions a second on the dissertation's computer at four iterations.
    """

    inputs: int
    decomposition: float
    iteration: float
    four: float
    ours: float
    rate: float


def svd_operations(m: int, n: int) -> float:
    """Singular value decomposition of an m by n matrix: 2 m² n + 11 n³ (6.64)."""
    return 2.0 * m**2 * n + 11.0 * n**3


def newton_operations(m: int, n: int, modules: int) -> float:
    """One iteration of `newton`, evaluation included.

    Cholesky's factorisation of the curvature, its solution for m + 1 right sides, the m by m Schur complement, its
    eigenvalues, and 3 x 3 transforms, velocities and lengths of the modules; without the further steps that the factors
    may serve, each a solution for one right side and an evaluation.

    Args:
        m: Goal rows.
        n: Inputs.
        modules: Active modules.

    Returns:
        Multiplications and additions, each counted.
    """
    factor = n**3 / 3
    solutions = 2.0 * n**2 * (m + 1)
    schur = 2.0 * m**2 * n + 9.0 * m**3 + 6.0 * m * n
    return factor + solutions + schur + 900.0 * modules


def count(n: int, m: int = 6) -> Count:
    """A row of table 6.1.

    Args:
        n: Inputs, three a module.
        m: Goal rows; six in the table.

    Returns:
        The row.
    """
    decomposition = svd_operations(m, n)
    iteration = ITERATION * decomposition
    four = SUSTAINED * iteration
    return Count(
        inputs=n,
        decomposition=decomposition,
        iteration=iteration,
        four=four,
        ours=newton_operations(m, n, -(-n // 3)),
        rate=BENCHMARK / four,
    )
