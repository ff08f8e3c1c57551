"""The arm as capsules, segments between two points with a radius, and which of them may meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.inertia import member_radii

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_APART = 3  # modules nearer than this along the arm cannot touch while their lengths are inside the strokes


@dataclass(frozen=True)
class Capsules:
    """Members, the edges of the tip plate and the payload.

    Attributes:
        ends: Points of each capsule, shape (M, 2): nodes by index, the tool point after the last node.
        radii: Shape (M,), m; of the barrel for a cylinder, over its whole length.
        module: Module of each, shape (M,).
        point_radii: Radius of a ball about each point that holds the hub and the capsules' ends, shape
            (N + 1,), m.
        pairs: Capsules that may meet one another, shape (2, P).
        module_pairs: The pairs of modules those come from, shape (2, L).
    """

    ends: Index
    radii: Array
    module: Index
    point_radii: Array
    pairs: Index
    module_pairs: Index


def make_capsules(chain: Chain, payload_radius: float) -> Capsules:
    """Wrap an arm.

    Args:
        chain: The arm.
        payload_radius: Of the ball about the tool point, m.

    Returns:
        Its capsules.
    """
    manipulator, truss = chain.manipulator, chain.truss
    tool, last = len(truss.nodes), len(manipulator.modules) - 1
    plate = [(tool - 3, tool - 2), (tool - 2, tool - 1), (tool - 1, tool - 3)]
    ends = np.array([*(member.ends for member in truss.members), *plate, (tool, tool)])
    thickness = np.full(3, manipulator.tip_plate.thickness / 2)
    radii = np.concatenate([member_radii(manipulator, truss), thickness, [payload_radius]])
    module = np.array([*(member.module for member in truss.members), *[last] * 4])
    point_radii = np.full(tool + 1, manipulator.hub.radius)
    np.maximum.at(point_radii, ends.ravel(), np.repeat(radii, 2))
    modules = np.arange(last + 1)
    return Capsules(
        ends,
        radii,
        module,
        point_radii,
        np.array(np.nonzero(module[None, :] - module[:, None] >= _APART)),
        np.array(np.nonzero(modules[None, :] - modules[:, None] >= _APART)),
    )


def near_pairs(capsules: Capsules, points: Array, reach: float) -> tuple[Index, Index, Index]:
    """Pairs of the arm's own capsules that may be nearer than a reach.

    Balls about modules are compared first, then balls about capsules.

    Args:
        capsules: The arm.
        points: Nodes and tool point, shape (W, N + 1, 3), m.
        reach: Between the surfaces, m.

    Returns:
        First and second capsule and the configuration of each pair, shape (R,) each.
    """
    count = int(capsules.module.max()) + 1
    centre, size = np.empty((len(points), count, 3)), np.empty((len(points), count))
    for k in range(count):
        mine = points[:, np.unique(capsules.ends[capsules.module == k])]
        centre[:, k] = (mine.min(axis=1) + mine.max(axis=1)) / 2
        size[:, k] = np.linalg.norm(mine - centre[:, k, None], axis=-1).max(axis=-1)
    limit = 2 * float(capsules.radii.max()) + reach
    low, high = capsules.module_pairs
    apart = np.linalg.norm(centre[:, low] - centre[:, high], axis=-1)
    config, pair = np.nonzero(apart < size[:, low] + size[:, high] + limit)
    close = np.zeros((len(points), count, count), bool)
    close[config, low[pair], high[pair]] = True
    kinds = np.unique(pair)
    first, second = capsules.pairs[:, np.isin(_code(capsules, count), low[kinds] * count + high[kinds])]
    config, chosen = np.nonzero(close[:, capsules.module[first], capsules.module[second]])
    first, second = first[chosen], second[chosen]
    a = points[config[:, None], capsules.ends[first]]
    b = points[config[:, None], capsules.ends[second]]
    half = np.linalg.norm(a[:, 1] - a[:, 0], axis=-1) + np.linalg.norm(b[:, 1] - b[:, 0], axis=-1)
    near = np.linalg.norm(a.mean(axis=1) - b.mean(axis=1), axis=-1) < half / 2 + limit
    return first[near], second[near], config[near]


def _code(capsules: Capsules, count: int) -> Index:
    """One number for the pair of modules of each pair of capsules, shape (P,)."""
    first, second = capsules.module[capsules.pairs]
    return first * count + second
