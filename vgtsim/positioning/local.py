"""What Newton's iteration knows of a batch of points: goal rows and objective, to first and second order."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Which = NDArray[np.intp] | NDArray[np.bool_]


@dataclass(frozen=True)
class Local:
    """Goal rows and objective about a batch of points.

    Attributes:
        inside: Whether a point is inside all hard limits; nothing else counts where it is not, shape (b,).
        error: Shape (b, m), in units of the rows.
        J: Derivative of the error, shape (b, m, k).
        value: Objective, shape (b,).
        slope: Shape (b, k).
        curve: Known curvature, positive semidefinite, shape (b, k, k).
        rough: Part of the slope whose curvature is to be learned from its changes, shape (b, k), or absent.
        memo: What the curvature's function wants again of these points, leading dimension b, or absent.
    """

    inside: NDArray[np.bool_]
    error: Array
    J: Array
    value: Array
    slope: Array
    curve: Array
    rough: Array | None = None
    memo: Array | None = None


def stationarity(at: Local) -> Array:
    """Norm of the slope's part in the null space of J, over 1 + the norm of the slope, shape (B,)."""
    Q = np.linalg.qr(np.swapaxes(at.J, 1, 2))[0]
    rest = at.slope - (Q @ (np.swapaxes(Q, 1, 2) @ at.slope[..., None]))[..., 0]
    return np.linalg.norm(rest, axis=1) / (1 + np.linalg.norm(at.slope, axis=1))


def take(local: Local, which: Which) -> Local:
    """Some of the points, copied."""
    parts = (getattr(local, field.name) for field in fields(local))
    return Local(*(None if part is None else part[which] for part in parts))  # type: ignore[arg-type]


def put(local: Local, where: Which, source: Local, which: Which) -> None:
    """Write some points of a source to places of a batch."""
    for field in fields(local):
        part = getattr(local, field.name)
        if part is not None:
            part[where] = getattr(source, field.name)[which]
