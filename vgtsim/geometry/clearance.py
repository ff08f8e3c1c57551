"""How near the arm comes to the tank, to what stands in it, and to itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry.distance import enclosure_depth, segment_distance
from vgtsim.geometry.pairs import MemberPairs, nearest_members, pair_members
from vgtsim.geometry.profile import Profile, make_profile

Array = NDArray[np.float64]
Index = NDArray[np.intp]

SHELL, RISER, WASTE = "shell", "riser", "waste"

_CHUNK = 64  # configurations done at a time: bounds the memory of a batch to some tens of megabytes
# Points along a member that passes the riser's mouth, and how often the best interval is cut
# again: the place of least distance is then known within 1/1024 of the member's length.
_SAMPLES, _CUTS = 17, 3


@dataclass(frozen=True)
class Obstacles:
    """K cylinders in the tank and the height of the waste, m.

    Axes in frame G, lower ends first, have shape (K, 2, 3), m; radii have shape (K,), m.
    """

    names: tuple[str, ...]
    axes: Array
    radii: Array
    waste_level: float

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("axes", "radii"):
            frozen = np.array(getattr(self, name), float)
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)


@dataclass(frozen=True)
class Clearance:
    """Least distances, shape (..., P), m, of an arm from P places: `shell`, `riser`, the obstacles, `waste`.

    A distance is negative inside a place, and infinite from the riser when no part of the arm is nearest to it. `body`
    is the nearest part of the arm, shape (..., P): a member below M, then nodes, then the payload.
    """

    places: tuple[str, ...]
    distance: Array
    body: Index

    @property
    def least(self) -> Array:
        """Least distance from anything, shape (...), m."""
        return self.distance.min(axis=-1)

    @property
    def nearest(self) -> Index:
        """Index into `places` of the nearest one, shape (...)."""
        return self.distance.argmin(axis=-1)


def obstacles(tank: Tank) -> Obstacles:
    """Equipment and waste of a tank; equipment without a top ends at the dome above its axis."""
    profile = make_profile(tank.shell)
    axes = []
    for item in tank.equipment:
        x, y = item.radius * np.cos(item.azimuth), item.radius * np.sin(item.azimuth)
        top = float(profile.ceiling_at(item.radius)) if item.top is None else item.top
        axes.append([[x, y, item.bottom], [x, y, top]])
    names, radii = tuple(item.name for item in tank.equipment), [item.diameter / 2 for item in tank.equipment]
    return Obstacles(names, np.reshape(np.array(axes, float), (-1, 2, 3)), np.array(radii, float), tank.waste.level)


def arm_clearance(
    nodes: ArrayLike,
    ends: NDArray[np.integer],
    radii: ArrayLike,
    hub_radius: float,
    tank: Tank,
    profile: Profile,
    around: Obstacles,
    payload: tuple[ArrayLike, float] | None = None,
) -> Clearance:
    """Least distance of an arm, nodes in frame G of shape (..., N, 3), m, from everything in the tank.

    Members, ends of shape (M, 2) and radii of shape (M,), m, are capsules. Nodes and payload, a tool point of shape
    (..., 3) and a radius, m, are balls. The tank is convex, so a member is nearest to the shell at one of its ends;
    only members that begin or end where the riser's mouth is nearest are searched along their length. Equipment is
    rounded at its ends by its radius, which makes the result a lower bound there.
    """
    nodes = np.asarray(nodes, float)
    batch, balls, ball_radii = nodes.shape[:-2], nodes, np.full(nodes.shape[-2], hub_radius)
    if payload is not None:
        tool = np.broadcast_to(np.asarray(payload[0], float)[..., None, :], (*batch, 1, 3))
        balls, ball_radii = np.concatenate([nodes, tool], -2), np.append(ball_radii, payload[1])
    flat = balls.reshape(-1, *balls.shape[-2:])
    places = (SHELL, RISER, *around.names, WASTE)
    distance = np.empty((len(flat), len(places)))
    body = np.empty((len(flat), len(places)), np.intp)
    radii = np.concatenate([np.broadcast_to(np.asarray(radii, float), (len(ends),)), ball_radii])
    for first in range(0, len(flat), _CHUNK):
        part = slice(first, first + _CHUNK)
        gaps = _gaps(flat[part], np.asarray(ends, np.intp), radii, tank, profile, around)
        body[part] = gaps.argmin(axis=1)
        distance[part] = gaps.min(axis=1)
    return Clearance(places, distance.reshape(*batch, -1), body.reshape(*batch, -1))


def _gaps(balls: Array, ends: Index, radii: Array, tank: Tank, profile: Profile, around: Obstacles) -> Array:
    """Distances of members and balls from each place, shape (B, M + balls, P), m."""
    a, b = balls[:, ends[:, 0]], balls[:, ends[:, 1]]
    depth, mouth = enclosure_depth(tank, profile, balls)
    inf = np.inf
    shell, riser = np.where(mouth, inf, depth), np.where(mouth, depth, inf)
    member_shell = np.minimum(shell[:, ends[:, 0]], shell[:, ends[:, 1]])
    member_riser = np.minimum(riser[:, ends[:, 0]], riser[:, ends[:, 1]])
    config, member = np.nonzero(mouth[:, ends[:, 0]] | mouth[:, ends[:, 1]])
    if len(config):
        shell_gap, riser_gap = (
            np.min(np.concatenate([at_members, at_balls], 1) - radii, axis=1)
            for at_members, at_balls in ((member_shell, shell), (member_riser, riser))
        )
        # a member that can come nearer to neither than another one is already needs no search
        first, last = a[config, member], b[config, member]
        lower = _bound(first, last, depth[config[:, None], ends[member]], tank, profile) - radii[member]
        left = np.flatnonzero(lower < np.maximum(shell_gap, riser_gap)[config])
        config, member = config[left], member[left]
        along, at_riser = _along(first[left], last[left], radii[member], (config, riser_gap), tank, profile)
        member_shell[config, member] = np.minimum(member_shell[config, member], np.where(at_riser, inf, along))
        member_riser[config, member] = np.minimum(member_riser[config, member], np.where(at_riser, along, inf))
    columns = [np.concatenate([member_shell, shell], 1), np.concatenate([member_riser, riser], 1)]
    starts, stops = np.concatenate([a, balls], 1), np.concatenate([b, balls], 1)
    for (low, high), radius in zip(around.axes, around.radii, strict=True):
        gaps = [segment_distance(first, last, low, high)[0] - radius for first, last in ((a, b), (balls, balls))]
        columns.append(np.concatenate(gaps, axis=1))
    columns.append(np.minimum(starts[..., 2], stops[..., 2]) - around.waste_level)
    return np.stack(columns, -1) - radii[:, None]


def _bound(a: Array, b: Array, depth: Array, tank: Tank, profile: Profile) -> Array:
    """Lower bound of the enclosure distance along segments, shape (n,), m, by those at their ends, shape (n, 2), and middles.

    The distance changes by no more than the way along the segment.
    """
    middle, _ = enclosure_depth(tank, profile, (a + b) / 2)
    return (depth.min(axis=1) + middle - np.linalg.norm(b - a, axis=1) / 2) / 2


def _along(
    a: Array, b: Array, radii: Array, bound: tuple[Index, Array], tank: Tank, profile: Profile
) -> tuple[Array, NDArray[np.bool_]]:
    """Least enclosure distance along segments, shape (n,), m, and whether the riser is nearest there, shape (n,).

    The distance changes by no more than the way along the segment, so samples bound it from below. The search ends for
    a member that cannot come as near to the riser as another one has already: `bound` has the configuration of each,
    shape (n,), and the gap that each configuration has from the riser, shape (B,), m.
    """
    (config, found), way = bound, np.linalg.norm(b - a, axis=1)
    low, high = np.zeros(len(a)), np.ones(len(a))
    least, at_riser = np.full(len(a), np.inf), np.zeros(len(a), bool)
    some = np.arange(len(a))
    for _ in range(_CUTS):
        t = low[some, None] + (high - low)[some, None] * np.linspace(0, 1, _SAMPLES)
        depth, mouth = enclosure_depth(tank, profile, a[some, None] + t[..., None] * (b - a)[some, None])
        rows, best = np.arange(len(some)), depth.argmin(axis=1)
        before, after = np.maximum(best - 1, 0), np.minimum(best + 1, _SAMPLES - 1)
        least[some], at_riser[some] = depth[rows, best], mouth[rows, best]
        low[some], high[some] = t[rows, before], t[rows, after]
        np.minimum.at(found, config[some], np.where(at_riser[some], least[some] - radii[some], np.inf))
        step = (t[:, 1] - t[:, 0]) * way[some]
        same = (mouth[rows, before] == mouth[rows, best]) & (mouth[rows, after] == mouth[rows, best])
        open_still = least[some] - step / 2 - radii[some] < found[config[some]]
        some = some[~(same & at_riser[some]) | open_still]
        if not len(some):
            break
    return least, at_riser


def self_clearance(
    nodes: ArrayLike, ends: NDArray[np.integer], radii: ArrayLike, module: NDArray[np.integer]
) -> tuple[Array, Index]:
    """Least distance, shape (...), m, between members of modules that differ by two or more, and the two members, (..., 2).

    Nodes in frame G have shape (..., N, 3), m; ends of shape (M, 2), radii, m, and modules of shape (M,) describe the
    members. Without such a pair the distance is infinite and the members are -1. A ball is a member with one node
    twice: append the tool point to the nodes to count the payload.
    """
    return nearest_pair(pair_members(ends, radii, module, 2), nodes)


def nearest_pair(pairs: MemberPairs, nodes: ArrayLike) -> tuple[Array, Index]:
    """`self_clearance` with pairs that are tabulated already, for nodes of shape (..., N, 3), m."""
    nodes = np.asarray(nodes, float)
    batch, flat = nodes.shape[:-2], nodes.reshape(-1, *nodes.shape[-2:])
    distance, pair = np.empty(len(flat)), np.empty((len(flat), 2), np.intp)
    for first in range(0, len(flat), _CHUNK):
        part = slice(first, first + _CHUNK)
        distance[part], pair[part] = nearest_members(pairs, flat[part])
    return distance.reshape(batch), pair.reshape(*batch, 2)
