"""How near the arm comes to the tank, to what stands in it, and to itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry import gaps
from vgtsim.geometry.bed import Bed, make_bed
from vgtsim.geometry.distance import find_mouth
from vgtsim.geometry.pairs import MemberPairs, pair_members
from vgtsim.geometry.profile import Profile, make_profile

Array = NDArray[np.float64]
Index = NDArray[np.intp]

SHELL, RISER, WASTE = "shell", "riser", "waste"


@dataclass(frozen=True)
class Obstacles:
    """K cylinders in the tank, the height of the waste, m, and its bed where it is not level.

    Axes in frame G, lower ends first, have shape (K, 2, 3), m; radii have shape (K,), m.
    """

    names: tuple[str, ...]
    axes: Array
    radii: Array
    waste_level: float
    bed: Bed | None = None

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
    for item in tank.standing:
        x, y = item.radius * np.cos(item.azimuth), item.radius * np.sin(item.azimuth)
        top = float(profile.ceiling_at(item.radius)) if item.top is None else item.top
        axes.append([[x, y, item.bottom], [x, y, top]])
    names, radii = tuple(item.name for item in tank.standing), [item.diameter / 2 for item in tank.standing]
    return Obstacles(
        names, np.reshape(np.array(axes, float), (-1, 2, 3)), np.array(radii, float), tank.waste.level, make_bed(tank)
    )


def make_walls(tank: Tank, profile: Profile, around: Obstacles) -> gaps.Walls:
    """The tank, its obstacles and its waste, for compiled functions."""
    bed = around.bed
    heights, ground = (np.empty((0, 0)), np.zeros(4)) if bed is None else (bed.heights, bed.ground)
    figures = profile.figures, find_mouth(tank, profile), np.array(around.axes), np.array(around.radii)
    return *figures, around.waste_level, heights, ground


def arm_clearance(
    nodes: ArrayLike,
    ends: NDArray[np.integer],
    radii: ArrayLike,
    hub_radius: ArrayLike,
    tank: Tank,
    profile: Profile,
    around: Obstacles,
    payload: tuple[ArrayLike, float] | None = None,
    together: bool = False,
) -> Clearance:
    """Least distance of an arm, nodes in frame G of shape (..., N, 3), m, from everything in the tank.

    Members, ends of shape (M, 2) and radii of shape (M,), m, are capsules. Nodes, of one radius or of shape (N,), m, and
    payload, a tool point of shape (..., 3) and a radius, m, are balls. The tank is convex, so a member is nearest to the
    shell at one of its ends; only members that begin or end where the riser's mouth is nearest are searched along their
    length. Equipment is rounded at its ends by its radius, which makes the result a lower bound there.
    If only the least distance of the whole batch counts, `together`, others may be given as infinite or too great.
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
    thick = np.concatenate([np.broadcast_to(np.asarray(radii, float), (len(ends),)), ball_radii])
    walls = make_walls(tank, profile, around)
    gaps.measure_arm(walls, np.array(flat, order="C"), np.array(ends, np.intp), thick, distance, body, together)
    return Clearance(places, distance.reshape(*batch, -1), body.reshape(*batch, -1))


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
    batch, flat = nodes.shape[:-2], np.array(nodes.reshape(-1, *nodes.shape[-2:]), order="C")
    distance, pair = np.empty(len(flat)), np.empty((len(flat), 2), np.intp)
    gaps.measure_pairs(pairs, flat, distance, pair)
    return distance.reshape(batch), pair.reshape(*batch, 2)
