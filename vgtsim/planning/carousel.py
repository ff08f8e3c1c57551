"""Shapes in which an arm swings about its mast past what stands in the tank, and the ways between them.

What stands in a tank is upright, and the arm hangs on the tank's axis. So most long ways are three: out of the place where the
arm is, round, and into the place where it shall be. A carousel is a net of the shapes that swing farthest, found once for a
corridor; a search then has to find the way to the net alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.kinematics import bend_all, can_swing, swing
from vgtsim.planning.sampling import SEED, Ground, search, shorten_way

if TYPE_CHECKING:
    from scipy.sparse import csr_array


_TURNS = 36  # azimuths of a shape: 10 degrees apart, the width of an arm some 6 m out
_SHAPES, _LOOKED, _KEPT = 1000, 80, 12  # shapes drawn, those looked at closely, and those kept
_GLANCE = 9  # azimuths at which a shape that was drawn is looked at first
_BEND, _UNLIKE = np.radians(45.0), np.radians(25.0)  # greatest bend that is drawn; least distance of kept shapes
_LINK, _LINKING = 4_000, 20_000  # motions of a search between parts of the net, and of all of them
_DIRECT, _OUT, _LAST = 1_000, 5_000, 12_000  # motions of searches: direct, to the net, and the last one, direct again
# Motions of the last search where an end does not come to the net, or both come to parts that the net's own searches, with many
# more motions, did not join.
_LOCKED, _PARTED = 5_000, 1_000
_CALLS = 40  # stations of the net that a way may lead to


@dataclass(frozen=True)
class Net:
    """K stations: clear configurations, shape (K, n), with the clear motions between them.

    `lengths` are those of the motions, m, between stations of shape (2, E).
    """

    stations: Array
    motions: Index
    lengths: Array

    def number(self, q: Array) -> int:
        """Number of the station that a configuration, shape (n,), is but for rounding."""
        return _nearest(self.stations, q)

    def way(self, first: int, last: int) -> Array | None:
        """Configurations from one station to another, shape (W, n), the shortest way; none where there is none."""
        if first == last:
            return self.stations[[first]]
        from scipy.sparse.csgraph import dijkstra  # slow to load, and only a search needs it

        graph = _graph(len(self.stations), self.motions, self.lengths)
        before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)[1]
        at, found = last, [last]
        while at != first:
            at = int(before[at])
            if at < 0:
                return None
            found.append(at)
        return self.stations[found[::-1]]


@dataclass(frozen=True)
class Carousel:
    """Searches for ways on a ground; its net is made when the first search needs it."""

    ground: Ground

    def ways(self, first: Array, last: Array) -> Iterator[Array]:
        """Corners of clear ways between two clear configurations, shape (W, n) each: direct, by the net, direct with patience."""
        way = search(self.ground, first[None], last[None], _DIRECT)
        if way is not None:
            yield way
        way, patience = self._go_round(first, last)
        if way is not None:
            yield way
        way = search(self.ground, first[None], last[None], patience)
        if way is not None:
            yield way

    def _go_round(self, first: Array, last: Array) -> tuple[Array | None, int]:
        """A way by the net, if there is one, and the motions that a last search is worth."""
        net = self.net
        if net is None:
            return None, _LAST
        out = search(self.ground, first[None], net.stations[self._near(first)], _OUT)
        if out is None:
            return None, _LOCKED
        back = search(self.ground, last[None], net.stations[self._near(last)], _OUT)
        if back is None:
            return None, _LOCKED
        between = net.way(net.number(out[-1]), net.number(back[-1]))
        if between is None:
            return None, _PARTED
        return shorten_way(self.ground, np.concatenate([out[:-1], between, back[-2::-1]])), _LAST

    @cached_property
    def net(self) -> Net | None:
        """None where the arm does not swing, or no shape of those that were drawn is clear anywhere."""
        chain = self.ground.corridor.box.chain
        if not can_swing(chain):
            return None
        bends, free = self._choose(np.random.default_rng(SEED))
        if not free.any():
            return None
        shape, turn = np.nonzero(free)
        q = bend_all(chain, bends, 0.0)
        stations = swing(chain, q[shape], turn * (2 * np.pi / _TURNS))
        number = np.full(free.shape, -1)
        number[shape, turn] = np.arange(len(shape))
        found = []
        for k in range(len(shape)):
            ahead = number[shape[k], (turn[k] + 1) % _TURNS]
            beside = [other for other in number[shape[k] + 1 :, turn[k]] if other >= 0]
            found += [(k, other) for other in ([ahead] if ahead >= 0 else []) + beside]
        joined = [pair for pair in found if self.ground.joins(stations[pair[0]], stations[pair[1]])]
        return self._connect(stations, np.array(joined, np.intp).reshape(-1, 2))

    def _connect(self, stations: Array, pairs: Index) -> Net:
        """Search for motions between the parts of a net that hang together, the greatest first.

        A part from which no motion is found is set aside; it may still be found from another one.
        """
        from scipy.sparse.csgraph import connected_components

        limit, aside = self.ground.checked + _LINKING, np.zeros(len(stations), bool)
        while self.ground.checked < limit:
            part = connected_components(_graph(len(stations), pairs.T), directed=False)[1]
            open_parts = np.bincount(part, weights=~aside)
            main = part == np.argmax(open_parts)
            if main.all() or not open_parts.any():
                break
            way = search(self.ground, stations[main], stations[~main], _LINK)
            if way is None:
                aside |= main
                continue
            ends = [_nearest(stations, q) for q in (way[0], way[-1])]
            inner = len(stations) + np.arange(len(way) - 2)
            stations = np.concatenate([stations, way[1:-1]])
            aside = np.append(aside, np.zeros(len(inner), bool))
            chain = np.array([ends[0], *inner, ends[1]])
            pairs = np.concatenate([pairs, np.stack([chain[:-1], chain[1:]], axis=1)])
        apart = (stations[pairs[:, 0]] - stations[pairs[:, 1]]) * self.ground.scale
        return Net(stations, pairs.T, np.linalg.norm(apart, axis=1))

    def _choose(self, rng: np.random.Generator) -> tuple[Array, Mask]:
        """Bends of unlike shapes that are clear at most azimuths, shape (S, A), rad, and where they are, shape (S, _TURNS)."""
        count = len(self.ground.corridor.box.chain.layout.names)
        bends = rng.uniform(-_BEND, _BEND, (_SHAPES, count))
        bends = bends[_rank(self._free(bends, _GLANCE))[:_LOOKED]]
        free = self._free(bends, _TURNS)
        kept: list[int] = []
        for k in _rank(free):
            if all(np.linalg.norm(bends[k] - bends[other]) > _UNLIKE for other in kept):
                kept.append(int(k))
            if len(kept) == _KEPT:
                break
        return bends[kept], free[kept]

    def _free(self, bends: Array, count: int) -> Mask:
        """At which of equal azimuths shapes are clear, shape (S, count)."""
        chain, turns = self.ground.corridor.box.chain, np.arange(count) * (2 * np.pi / count)
        q = bend_all(chain, bends, 0.0)
        whole = swing(chain, q[:, None], turns)
        return self.ground.clear(whole.reshape(-1, q.shape[1])).reshape(len(q), count)

    def _near(self, q: Array) -> Index:
        """The stations nearest to a configuration, shape (n,), the nearest first."""
        assert self.net is not None
        apart = np.linalg.norm((self.net.stations - q) * self.ground.scale, axis=1)
        return np.argsort(apart, kind="stable")[:_CALLS]


def _graph(count: int, motions: Index, lengths: Array | float = 1.0) -> csr_array:
    """Sparse matrix of motions between stations, shape (2, E)."""
    from scipy.sparse import csr_array

    return csr_array((np.broadcast_to(lengths, motions.shape[1]), motions), shape=(count, count))


def _nearest(stations: Array, q: Array) -> int:
    return int(np.argmin(np.abs(stations - q).max(axis=1)))


def _rank(free: Mask) -> Index:
    """Shapes, those clear at most azimuths first."""
    return np.argsort(-free.sum(axis=1), kind="stable")
