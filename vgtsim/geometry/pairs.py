"""Pairs of an arm's members that may meet: which of them are near one another in a configuration.

Members are compared in two steps. A ball about each module rules out most pairs of modules; a ball about each member
rules out most pairs that are left. What depends on the members alone is tabulated once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.geometry.distance import segment_distance

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_ROUNDING = 1e-9  # m


@dataclass(frozen=True)
class MemberPairs:
    """Pairs of members whose modules are far enough apart along the arm to meet.

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
    """Tabulate the pairs of M members, ends of shape (M, 2), whose modules, shape (M,), differ by at least `apart`."""
    ends = np.asarray(ends, np.intp)
    thick = np.broadcast_to(np.asarray(radii, float), (len(ends),))
    names, row = np.unique(np.asarray(module), return_inverse=True)
    members = [np.flatnonzero(row == k) for k in range(len(names))]
    points = [np.unique(ends[own]) for own in members]
    widest = max(len(own) for own in points)
    corners = np.array([np.resize(own, widest) for own in points])
    low, high = np.nonzero(names[None, :] - names[:, None] >= apart)
    first = [np.repeat(members[k], len(members[m])) for k, m in zip(low, high, strict=True)]
    second = [np.tile(members[m], len(members[k])) for k, m in zip(low, high, strict=True)]
    none = np.zeros(0, np.intp)
    return MemberPairs(
        ends=ends,
        radii=thick,
        corners=corners,
        thick=np.array([thick[own].max() for own in members]),
        modules=np.stack([low, high]),
        members=np.stack([np.concatenate([none, *first]), np.concatenate([none, *second])]),
        begin=np.cumsum([0, *(len(own) for own in first)]),
    )


@dataclass(frozen=True)
class MemberBalls:
    """First and second ends and middles of members, shape (W, M, 3), m, and half their lengths, shape (W, M), m."""

    first: Array
    last: Array
    middle: Array
    half: Array


def member_balls(ends: Index, points: Array) -> MemberBalls:
    """Balls about members, from points of shape (W, N, 3), m."""
    first, last = np.take(points, ends[:, 0], axis=1), np.take(points, ends[:, 1], axis=1)
    return MemberBalls(first, last, (first + last) / 2, _norm(last - first) / 2)


def near_members(pairs: MemberPairs, points: Array, balls: MemberBalls, reach: float) -> tuple[Index, Index]:
    """Pairs that may be nearer than a reach, m: configurations, shape (R,), and members, shape (2, R); none is missing."""
    config, members, lower = _pairs_of_modules(pairs, balls, _module_gaps(pairs, points) < reach)
    near = np.flatnonzero(lower < reach)
    return config[near], members[:, near]


def _pairs_of_modules(pairs: MemberPairs, balls: MemberBalls, chosen: Mask) -> tuple[Index, Index, Array]:
    """Pairs of members of chosen pairs of modules, shape (W, Q), as `near_members`, and the distance of their balls."""
    config, pair = np.nonzero(chosen)
    count = np.diff(pairs.begin)[pair]
    # the members of all chosen pairs of modules, one pair of modules after the other
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    members = pairs.members[:, np.repeat(pairs.begin[pair], count) + within]
    config = np.repeat(config, count)
    first, second = members
    size = balls.half + pairs.radii
    away = _norm(balls.middle[config, first] - balls.middle[config, second])
    return config, members, away - size[config, first] - size[config, second]


def nearest_members(pairs: MemberPairs, points: Array) -> tuple[Array, Index]:
    """Least distance between members of each configuration, shape (W,), m, and the two members, shape (W, 2).

    Of the two nearest modules, the two members whose balls are nearest are measured. Their distance is a bound: only
    pairs whose balls are as near are measured too.
    """
    count = len(points)
    if not pairs.members.size:
        return np.full(count, np.inf), np.full((count, 2), -1)
    balls, every, gaps = member_balls(pairs.ends, points), np.arange(count), _module_gaps(pairs, points)
    likely = np.zeros(gaps.shape, bool)
    likely[every, gaps.argmin(axis=1)] = True
    config, members, lower = _pairs_of_modules(pairs, balls, likely)
    likely_pair = np.lexsort((lower, config))[_starts(config)]
    # a little more: the pair that gives the bound must not be lost by rounding
    bound = _measure(pairs, balls, every, members[:, likely_pair]) + _ROUNDING
    config, members, lower = _pairs_of_modules(pairs, balls, gaps <= bound[:, None])
    near = np.flatnonzero(lower <= bound[config])
    config, members = config[near], members[:, near]
    gap = _measure(pairs, balls, config, members)
    best = np.lexsort((members[1], members[0], gap, config))[_starts(config)]
    return gap[best], members[:, best].T


def _starts(config: Index) -> Index:
    """Where each configuration begins in a list that holds them in order."""
    return np.flatnonzero(np.diff(config, prepend=-1))


def _measure(pairs: MemberPairs, balls: MemberBalls, config: Index, members: Index) -> Array:
    """Distance between the surfaces of pairs of members, shape (R,), m."""
    first, second = members
    ends = (side[config, member] for member in (first, second) for side in (balls.first, balls.last))
    return segment_distance(*ends)[0] - pairs.radii[first] - pairs.radii[second]


def _module_gaps(pairs: MemberPairs, points: Array) -> Array:
    """Distance between the balls about the modules of each pair, a lower bound, shape (W, Q), m."""
    own = points[:, pairs.corners]
    centre = (own.min(axis=2) + own.max(axis=2)) / 2
    size = _norm(own - centre[:, :, None]).max(axis=2) + pairs.thick
    low, high = pairs.modules
    return _norm(centre[:, low] - centre[:, high]) - size[:, low] - size[:, high]


def _norm(vectors: Array) -> Array:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
