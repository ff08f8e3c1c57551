"""A problem about a batch of points: goal rows to first order, the objective to second."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Which = NDArray[np.intp] | NDArray[np.bool_] | slice


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

    def take(self, which: Which) -> Quadratic:
        """Some of the points, copied."""
        parts = (getattr(self, field.name) for field in fields(self))
        return Quadratic(*(None if part is None else part[which] for part in parts))  # type: ignore[arg-type]

    def put(self, where: Which, source: Quadratic, which: Which) -> None:
        """Write some points of a source to places of this batch."""
        for field in fields(self):
            part = getattr(self, field.name)
            if part is not None:
                part[where] = getattr(source, field.name)[which]


def stationarity(at: Quadratic) -> Array:
    """Norm of the slope's part in the null space of J, over 1 + the norm of the slope, shape (b,)."""
    Q = np.linalg.qr(np.swapaxes(at.J, 1, 2))[0]
    rest = at.slope - (Q @ (np.swapaxes(Q, 1, 2) @ at.slope[..., None]))[..., 0]
    return np.linalg.norm(rest, axis=1) / (1 + np.linalg.norm(at.slope, axis=1))
