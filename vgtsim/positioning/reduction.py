"""Order reduction: fewer inputs than the arm has, by anchoring and by coupling (sections 7.2 and 7.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reduction:
    """Inputs as a function of fewer variables: q = C z + c, with free ratios appended to z.

    With free ratios, q_i = c_i + k (q_j - c_j) for the coupled pairs: bilinear in z, linear when k is fixed.

    Attributes:
        matrix: C, shape (n, k0).
        offset: c, shape (n,).
        free: For each free ratio the inputs that follow and the inputs they follow, shape (2, r) each, flat indices.
    """

    matrix: Array
    offset: Array
    free: tuple[NDArray[np.intp], ...] = ()

    @property
    def order(self) -> int:
        """Number of variables that are left."""
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
        """Variables whose inputs are nearest to given ones, followers of free ratios left out of account.

        Args:
            q: Shape (..., n).

        Returns:
            Shape (..., order).
        """
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


def whole(count: int) -> Reduction:
    """No reduction of `count` inputs."""
    return Reduction(np.eye(count), np.zeros(count))


def anchor(inputs: ArrayLike, fixed: ArrayLike) -> Reduction:
    """Hold some inputs where they are (section 7.2).

    Args:
        inputs: Present inputs, shape (n,).
        fixed: Which are held, bool, of the same shape.

    Returns:
        The reduction.
    """
    held, now = np.asarray(fixed, bool), np.asarray(inputs, float)
    return Reduction(np.eye(len(now))[:, ~held], np.where(held, now, 0.0))


def couple(
    reference: ArrayLike,
    pairs: tuple[tuple[int, int], ...],
    ratio: float | None = 1.0,
    owner: NDArray[np.intp] | None = None,
) -> Reduction:
    """Tie active modules together: tau_first = k tau_second (section 7.3).

    Args:
        reference: Inputs that count as zero, shape (n,); zeros for the printed form.
        pairs: For each pair the module that follows and the module it follows, counted from 0.
        ratio: k, or absent for a free ratio of each pair, which becomes a variable.
        owner: Active module of each input, shape (n,); absent for three inputs each.

    Returns:
        The reduction: the inputs of a module fewer for each pair, and one more for each free ratio.

    Raises:
        ValueError: A module follows twice, follows itself or leads and follows, or the two have unlike inputs.

    Source: section 7.3 and equation 8.7. Differs: ratios are of the deviation from a reference, because a ratio of
    mid-plane distances would change the arm's length.
    """
    zero = np.asarray(reference, float)
    followers, leaders = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    if len(set(followers)) < len(followers) or set(followers) & set(leaders):
        raise ValueError(f"pairs {pairs}: a module may follow once, and may not lead as well")
    module = np.repeat(np.arange(zero.size // 3), 3) if owner is None else owner
    own = [np.flatnonzero(module == a) for a in range(int(module.max()) + 1)]
    if any(len(own[follower]) != len(own[leader]) for follower, leader in pairs):
        raise ValueError(f"pairs {pairs}: modules of different kinds cannot be coupled")
    count = zero.size
    C = np.eye(count)
    free = []
    for follower, leader in pairs:
        lead, follow = own[leader], own[follower]
        C[follow] = 0.0
        if ratio is None:
            free.append(np.array([follow, lead]))
        else:
            C[follow, lead] = ratio
    keep = np.flatnonzero(~np.isin(module, followers))
    # q - reference = C (z - reference of z): z are inputs of the leading and the uncoupled modules
    matrix = C[:, keep]
    if ratio is None:
        return Reduction(matrix, zero, tuple(free))
    return Reduction(matrix, zero)
