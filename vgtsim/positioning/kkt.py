"""The quadratic model about a point, and how well its goal rows are conditioned."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CONDITION_LIMIT = 1e5  # section 6.2.1: past it the smallest singular values are given up


@dataclass(frozen=True)
class Quadratic:
    """Goal rows and objective about a batch of points.

    Attributes:
        inside: Whether a point is inside all hard limits, shape (b,); of a point outside nothing else counts.
        error: Shape (b, m), in units of the rows.
        J: Derivative of the error, shape (b, m, k).
        value: Objective, shape (b,).
        slope: Shape (b, k).
        curve: Known curvature, positive semidefinite, shape (b, k, k).
        rough: Part of the slope whose curvature is to be learned from its changes, shape (b, k), or absent.
        by_length: Derivative of the objective by the actuator lengths, shape (b, J), or absent.
    """

    inside: NDArray[np.bool_]
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array | None = None
    by_length: Array | None = None

    @property
    def parts(self) -> tuple[NDArray[Any], ...]:
        """All of it as compiled functions take it; what is absent has no columns."""
        own = (getattr(self, item.name) for item in fields(self))
        return tuple(np.empty((len(self.error), 0)) if part is None else stored(part) for part in own)


def stored(array: NDArray[Any]) -> NDArray[Any]:
    """The array, or a copy of it that is stored by rows and may be written to."""
    return array if array.flags.c_contiguous and array.flags.writeable else np.array(array, order="C")


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
    return tuple(name_direction(column, names) for column in U[:, rank:].T)


def name_direction(direction: Array, labels: tuple[str, ...]) -> str:
    """The rows that a direction consists of, the greatest part first."""
    order = np.argsort(-np.abs(direction), kind="stable")
    parts = [(direction[i], labels[i]) for i in order if abs(direction[i]) >= 0.1]
    if len(parts) == 1:
        return parts[0][1]
    return " ".join(f"{share:+.2f} {label}" for share, label in parts)
