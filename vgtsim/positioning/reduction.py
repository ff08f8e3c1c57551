"""Order reduction: fewer inputs than the arm has, by anchoring and by coupling (sections 7.2 and 7.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index


@dataclass(frozen=True)
class Reduction:
    """Inputs as a linear function of fewer variables: q = C z + c, C of shape (n, k), c of shape (n,)."""

    matrix: Array
    offset: Array

    @property
    def order(self) -> int:
        """Number of variables that are left."""
        return self.matrix.shape[1]

    def inputs(self, z: Array) -> Array:
        """Inputs, shape (..., n), of variables of shape (..., k)."""
        return z @ self.matrix.T + self.offset

    def slope(self, z: Array) -> Array:
        """Derivative of the inputs by the variables, shape (..., n, k)."""
        return np.broadcast_to(self.matrix, (*z.shape[:-1], *self.matrix.shape))

    @property
    def rows(self) -> tuple[Array, Array]:
        """What all its inputs have in common: A q = b with orthonormal rows A, shape (n - k, n), and b."""
        left = np.linalg.svd(self.matrix)[0]
        across = left[:, self.order :].T
        return across, across @ self.offset

    def gather(self, owner: Index) -> Index:
        """Number of the group of each input's module, shape (n,): modules that share variables are one group.

        `owner` is the module of each input. Groups are counted from the mast by their first modules.
        """
        first = np.array([owner[column != 0].min() for column in self.matrix.T])
        return np.unique(first[np.abs(self.matrix).argmax(axis=1)], return_inverse=True)[1]

    def variables(self, q: Array) -> Array:
        """Variables, shape (..., k), whose inputs are nearest to given ones, shape (..., n)."""
        return (q - self.offset) @ np.linalg.pinv(self.matrix).T


def anchor(inputs: ArrayLike, fixed: ArrayLike, coupling: Reduction | None = None) -> Reduction:
    """Hold some inputs where they are (section 7.2): present inputs and which of them are held, shape (n,) each.

    With a coupling, which the present inputs keep, whole groups of coupled modules are held.
    """
    held, now = np.asarray(fixed, bool), np.asarray(inputs, float)
    matrix, offset = (np.eye(len(now)), 0.0) if coupling is None else (coupling.matrix, coupling.offset)
    free = matrix[:, np.any(matrix[~held] != 0, axis=0)]
    return Reduction(free, np.where(held, now, offset))


def couple(reference: ArrayLike, pairs: tuple[tuple[int, int], ...], owner: Index | None = None) -> Reduction:
    """Tie active modules together: tau_first = tau_second, as deviations from reference inputs of shape (n,).

    Each pair names the module that follows and the module it follows, counted from 0. `owner` is the active module of
    each input, shape (n,); three inputs for each module when absent.

    Raises:
        ValueError: A module follows twice, follows itself or leads and follows, or the two have unlike inputs.

    Source: section 7.3 and equation 8.7. Differs: the ratio is 1, and of the deviation from a reference; a ratio of
    mid-plane distances would change the arm's length. Other and free ratios are in the studies.
    """
    zero = np.asarray(reference, float)
    module = np.repeat(np.arange(zero.size // 3), 3) if owner is None else owner
    C = np.eye(zero.size)
    for follow, lead in coupled_inputs(module, pairs):
        C[follow] = 0.0
        C[follow, lead] = 1.0
    # q - reference = C (z - reference of z): z are inputs of the leading and the uncoupled modules
    return Reduction(C[:, ~np.isin(module, [follower for follower, _ in pairs])], zero)


def coupled_inputs(module: Index, pairs: tuple[tuple[int, int], ...]) -> list[tuple[Index, Index]]:
    """For each pair of modules the inputs that follow and the inputs that they follow; refuses pairs as `couple`."""
    followers, leaders = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    if len(set(followers)) < len(followers) or set(followers) & set(leaders):
        raise ValueError(f"pairs {pairs}: a module may follow once, and may not lead as well")
    found = [(np.flatnonzero(module == follower), np.flatnonzero(module == leader)) for follower, leader in pairs]
    if any(len(follow) != len(lead) for follow, lead in found):
        raise ValueError(f"pairs {pairs}: modules of different kinds cannot be coupled")
    return found
