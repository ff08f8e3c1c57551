"""Stiffness matrices in band storage, for any framework: assembled through index tables made once.

A node's displacement depends on w of the unknowns: its own three, or the six of a rigid body that it is fixed to.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Pattern:
    """Where each bar's stiffness goes in the banded matrix; made once for a truss of `size` unknowns.

    Attributes:
        band: Number of diagonals above the main one.
        dof: Unknowns that the two ends of each bar depend on, shape (B, 2 w); -1 where there is none.
        pairs: Pairs of those that land in the upper triangle, rows bar, first and second, shape (3, P).
        place: Where in flattened band storage each pair goes, shape (P,).
        alike: First of the unknowns that share a node and a unit with each, shape (n,).
    """

    size: int
    band: int
    dof: Indices
    pairs: Indices
    place: Indices
    alike: Indices

    @cached_property
    def _groups(self) -> tuple[Indices, Indices]:
        """First unknown of each group, and the group of each unknown."""
        starts, group = np.unique(self.alike, return_inverse=True)
        return starts, group

    def scale(self, diagonal: Array) -> Array:
        """Sizes of the unknowns, shape (..., n), by a matrix's diagonal: of a node, the root of its greatest entry."""
        starts, group = self._groups
        greatest = np.maximum.reduceat(np.maximum(diagonal, 0.0), starts, axis=-1)
        return np.sqrt(greatest[..., group])


@lru_cache(maxsize=16)
def make_pattern(unknowns: tuple[tuple[int, ...], ...], ends: tuple[tuple[int, int], ...]) -> Pattern:
    """Lay the band out for w unknowns of each node, -1 where there is none, and node indices of each bar's ends."""
    of_node = np.array(unknowns, dtype=np.intp)
    dof = of_node[np.array(ends, dtype=np.intp)].reshape(len(ends), -1)
    size = int(of_node.max(initial=-1)) + 1
    first, second = dof[:, :, None], dof[:, None, :]
    pairs = np.array(np.nonzero((first >= 0) & (second >= 0) & (first <= second)), dtype=np.intp)
    i, j = dof[pairs[0], pairs[1]], dof[pairs[0], pairs[2]]
    band = int((j - i).max(initial=0))
    alike = np.arange(size)
    for triple in of_node.reshape(-1, 3):
        own = triple[triple >= 0]
        alike[own] = own.min(initial=size)
    return Pattern(size=size, band=band, dof=dof, pairs=pairs, place=(band + i - j) * size + j, alike=alike)


@dataclass(frozen=True)
class Stiffness:
    """Stiffness matrices of a truss in a batch of poses, and what they are made of.

    Attributes:
        grow: Elongation of each bar per unit of each of its unknowns, shape (T, B, 2 w).
        spring: Stiffnesses of the bars, shape (T, B), N/m.
        upper: The matrices in upper band storage, shape (T, band + 1, n).
    """

    pattern: Pattern
    grow: Array
    spring: Array
    upper: Array

    def bar(self, moved: Array) -> Array:
        """Bar forces, shape (T, B, R), N, by unknowns, shape (T, n, R)."""
        taken = np.where(self.pattern.dof[..., None] >= 0, moved[:, self.pattern.dof], 0.0)
        return self.spring[..., None] * np.einsum("tmk,tmkr->tmr", self.grow, taken)


def assemble(pattern: Pattern, grow: Array, spring: Array) -> Stiffness:
    """Add the bars up: elongations per unknown, shape (T, B, 2 w), and stiffnesses, shape (T, B), N/m."""
    bar, first, second = pattern.pairs
    value = (spring[..., None] * grow)[:, bar, first] * grow[:, bar, second]
    room = (pattern.band + 1) * pattern.size
    place = pattern.place + room * np.arange(len(grow))[:, None]
    matrix = np.asarray(np.bincount(place.ravel(), value.ravel(), room * len(grow)), float)
    return Stiffness(pattern, grow, spring, matrix.reshape(len(grow), pattern.band + 1, pattern.size))


def unfold(upper: Array) -> Array:
    """Upper band storage, shape (band + 1, n), as a full symmetric matrix, shape (n, n)."""
    band, size = upper.shape[0] - 1, upper.shape[1]
    full = np.zeros((size, size))
    for above in range(band + 1):
        i = np.arange(size - above)
        full[i, i + above] = full[i + above, i] = upper[band - above, above:]
    return full


def geometric_blocks(span: Array, bar: Array, difference: Array) -> Array:
    """What bar forces add to the stiffness, symmetric, shape (B, 2 w, 2 w): a pulled bar resists turning by force over length.

    Args:
        span: From the first to the second end of each bar, shape (B, 3), m.
        bar: Forces, tension positive, shape (B,), N.
        difference: Displacement of the second end less that of the first per unit unknown, shape (B, 3, 2 w).
    """
    length = np.linalg.norm(span, axis=-1)
    unit = span / length[:, None]
    across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    return np.einsum("mki,mkl,mlj->mij", difference, across * (bar / length)[:, None, None], difference)


def add_blocks(pattern: Pattern, blocks: Array) -> Array:
    """Add blocks of the bars, shape (B, 2 w, 2 w), into a matrix of the unknowns, shape (n, n)."""
    dof = np.where(pattern.dof < 0, pattern.size, pattern.dof)
    total = np.zeros((pattern.size + 1, pattern.size + 1))
    np.add.at(total, (dof[:, :, None], dof[:, None, :]), blocks)
    return total[:-1, :-1]
