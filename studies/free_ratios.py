"""Coupled modules whose ratios are variables of their own: fifteen inputs become thirteen (section 7.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.positioning.reduction import Reduction, coupled_inputs

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class FreeRatios(Reduction):
    """A linear reduction with free ratios appended to its variables: q_i = c_i + k (q_j - c_j) for coupled inputs.

    Attributes:
        free: For each ratio the inputs that follow and the inputs that they follow.
    """

    free: tuple[tuple[Index, Index], ...]

    @property
    def order(self) -> int:
        """Number of variables, ratios included."""
        return self.matrix.shape[1] + len(self.free)

    def inputs(self, z: Array) -> Array:
        """Inputs, shape (..., n), of variables of shape (..., order)."""
        linear = self.matrix.shape[1]
        q = z[..., :linear] @ self.matrix.T + self.offset
        for r, (follower, leader) in enumerate(self.free):
            ratio = z[..., linear + r, None]
            q[..., follower] = self.offset[follower] + ratio * (q[..., leader] - self.offset[leader])
        return q

    def slope(self, z: Array) -> Array:
        """Derivative of the inputs by the variables, shape (..., n, order)."""
        linear = self.matrix.shape[1]
        q = z[..., :linear] @ self.matrix.T + self.offset
        T = np.zeros((*z.shape[:-1], len(self.offset), self.order))
        T[..., :linear] = self.matrix
        for r, (follower, leader) in enumerate(self.free):
            T[..., follower, :linear] = z[..., linear + r, None, None] * self.matrix[leader]
            T[..., follower, linear + r] = q[..., leader] - self.offset[leader]
        return T

    def variables(self, q: Array) -> Array:
        """Variables whose inputs are nearest to given ones, followers left out of account, shape (..., order)."""
        keep = np.ones(len(self.offset), bool)
        for follower, _ in self.free:
            keep[follower] = False
        away = q - self.offset
        z = away[..., keep] @ np.linalg.pinv(self.matrix[keep]).T
        ratios = []
        for follower, leader in self.free:
            size = np.sum(away[..., leader] ** 2, axis=-1)
            with np.errstate(invalid="ignore", divide="ignore"):
                ratio = np.sum(away[..., leader] * away[..., follower], axis=-1) / size
            ratios.append(np.where(size > 1e-12, ratio, 1.0))
        return np.concatenate([z, *(ratio[..., None] for ratio in ratios)], axis=-1)


def couple_freely(reference: ArrayLike, pairs: tuple[tuple[int, int], ...]) -> FreeRatios:
    """Tie modules of three inputs together as `couple` does, each pair with a free ratio."""
    zero = np.asarray(reference, float)
    module = np.repeat(np.arange(zero.size // 3), 3)
    free = tuple(coupled_inputs(module, pairs))
    C = np.eye(zero.size)
    for follow, _ in free:
        C[follow] = 0.0
    return FreeRatios(C[:, ~np.isin(module, [follower for follower, _ in pairs])], zero, free)
