"""Pairs of an arm's members that may meet.

Members are compared in two steps. A ball about each module rules out most pairs of modules; a ball about each member
rules out most pairs that are left. What depends on the members alone is tabulated once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index


class MemberPairs(NamedTuple):
    """Pairs of members whose modules are far enough apart along the arm to meet; compiled functions take it as it is.

    Attributes:
        ends: Points of each of M members by index, shape (M, 2); a ball has the same point twice.
        radii: Shape (M,), m.
        corners: Points of each of L modules that have members, shape (L, P); short rows repeat a point.
        thick: Greatest radius in each of those modules, shape (L,), m.
        modules: Pairs of rows of `corners`, shape (2, Q).
        members: Pairs of members, those of a pair of modules in a row, shape (2, R).
        begin: Where the members of each pair of modules begin, shape (Q + 1,).
    """

    ends: Index
    radii: Array
    corners: Index
    thick: Array
    modules: Index
    members: Index
    begin: Index


def pair_members(ends: NDArray[np.integer], radii: ArrayLike, module: NDArray[np.integer], apart: int) -> MemberPairs:
    """Tabulate the pairs of M members, ends of shape (M, 2), whose modules, shape (M,), differ by at least `apart`.

    Members that meet in a point are no pair.
    """
    ends = np.array(ends, np.intp)
    thick = np.broadcast_to(np.asarray(radii, float), (len(ends),))
    names, row = np.unique(np.asarray(module), return_inverse=True)
    members = [np.flatnonzero(row == k) for k in range(len(names))]
    points = [np.unique(ends[own]) for own in members]
    widest = max(len(own) for own in points)
    corners = np.array([np.resize(own, widest) for own in points])
    low, high = np.nonzero(names[None, :] - names[:, None] >= apart)
    first = [np.repeat(members[k], len(members[m])) for k, m in zip(low, high, strict=True)]
    second = [np.tile(members[m], len(members[k])) for k, m in zip(low, high, strict=True)]
    for k, (one, other) in enumerate(zip(first, second, strict=True)):  # a hinge keeps hubs of one section in the next
        free = (ends[one, :, None] != ends[other, None, :]).all(axis=(1, 2))
        first[k], second[k] = one[free], other[free]
    none = np.zeros(0, np.intp)
    return MemberPairs(
        ends=ends,
        radii=np.array(thick),
        corners=corners,
        thick=np.array([thick[own].max() for own in members]),
        modules=np.stack([low, high]),
        members=np.stack([np.concatenate([none, *first]), np.concatenate([none, *second])]),
        begin=np.cumsum([0, *(len(own) for own in first)]),
    )
