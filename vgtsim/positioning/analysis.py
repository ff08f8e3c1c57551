"""How well conditioned a configuration is, and which goal directions it has lost (section 6.2)."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CONDITION_LIMIT = 1e5  # section 6.2.1: past it the smallest singular values are given up


def condition_numbers(jacobian: ArrayLike) -> Array:
    """Greatest over least singular value (6.32), shape (...), of Jacobians (..., m, n); infinite below rank m."""
    values = np.linalg.svd(np.asarray(jacobian, float), compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(values[..., -1] > 0, values[..., 0] / values[..., -1], inf)


def lost_directions(jacobian: ArrayLike, names: tuple[str, ...], limit: float = CONDITION_LIMIT) -> tuple[str, ...]:
    """Goal directions that a configuration cannot follow, from a Jacobian of shape (m, n) and the names of its rows.

    Singular values below the greatest over `limit` are given up; each direction is named by the rows that it consists
    of.
    """
    U, values, _ = np.linalg.svd(np.asarray(jacobian, float))
    rank = int(np.sum(values > values[0] / limit))
    return tuple(_name(column, names) for column in U[:, rank:].T)


def _name(direction: Array, labels: tuple[str, ...]) -> str:
    """The rows that a direction consists of, the greatest part first."""
    order = np.argsort(-np.abs(direction), kind="stable")
    parts = [(direction[i], labels[i]) for i in order if abs(direction[i]) >= 0.1]
    if len(parts) == 1:
        return parts[0][1]
    return " ".join(f"{share:+.2f} {label}" for share, label in parts)
