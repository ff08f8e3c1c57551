"""The way to a goal by successive anchoring: stage by stage, with few modules moving and the others held (section 7.2)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.errors import PathError
from vgtsim.kinematics import Subspace
from vgtsim.planning.path import Path, plan_path
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import ANCHOR_FREE

_MOST_WINDOWS = 5  # whose orders are all looked at: 120; of more windows those from the mast and from the tool
_TRIED = 4  # orders that are planned


def plan_stages(corridor: Corridor, first: Array, last: Array, leg: str, owner: Index | None = None) -> list[Path]:
    """Find clear paths, one after the other, between two configurations, shape (n,), on each of which few modules move.

    A window of modules goes to its place at the end while all others are held. The order of the windows whose corners
    keep farthest from everything is tried first. `owner` is the module of each input, shape (n,), or its group of coupled
    modules, which move as one; the layout's where absent.

    Raises:
        PathError: No order is clear.
    """
    owner = corridor.box.chain.layout.owner if owner is None else owner
    count = int(owner.max()) + 1
    windows = [np.arange(k, min(k + ANCHOR_FREE, count)) for k in range(0, count, ANCHOR_FREE)]
    moving = [window for window in windows if np.any((first != last)[np.isin(owner, window)])] or windows[:1]
    orders = [moving, moving[::-1]] if len(moving) > _MOST_WINDOWS else list(permutations(moving))
    ranked = []
    for order in orders:
        corners = [first]
        for window in order:
            corners.append(np.where(np.isin(owner, window), last, corners[-1]))
        clearance, places = corridor.surroundings.clearance(np.array(corners))
        worst = int(np.argmin(clearance))
        ranked.append((float(clearance[worst]), places[worst], order, corners))
    ranked.sort(key=lambda item: -item[0])
    failed = PathError(leg, *ranked[0][:2])
    for clearance, _, order, corners in ranked[:_TRIED]:
        if clearance < corridor.clearance:
            break
        try:
            return [
                plan_path(_anchor(corridor, begin, np.isin(owner, window)), begin, end, leg)
                for window, (begin, end) in zip(order, pairwise(corners), strict=True)
            ]
        except PathError as error:
            failed = error
    raise failed


def _anchor(corridor: Corridor, q: Array, free: Mask) -> Corridor:
    """The corridor in which only some inputs move and the others stay as in inputs of shape (n,)."""
    space = corridor.space
    rows = np.concatenate([space.rows.reshape(-1, len(q)), np.eye(len(q))[~free]])
    return replace(corridor, subspace=Subspace(space.chain, rows, np.concatenate([space.values, q[~free]])))
