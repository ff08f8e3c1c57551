"""How near the arm comes to the tank, to what stands in it, and to itself."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description import Tank
from vgtsim.geometry import gaps
from vgtsim.geometry.bed import Bed, make_bed
from vgtsim.geometry.blocks import Blocks, make_blocks, to_block
from vgtsim.geometry.distance import find_mouth, segment_distance
from vgtsim.geometry.pairs import MemberPairs
from vgtsim.geometry.profile import Profile, make_profile
from vgtsim.geometry.things import cylinder_axis, find_hulls

Array = NDArray[np.float64]
Index = NDArray[np.intp]

SHELL, RISER, WASTE = "shell", "riser", "waste"


@dataclass(frozen=True)
class Obstacles:
    """K cylinders in the tank, then solids, the height of the waste, m, and its bed where it is not level.

    Axes in frame G, lower ends first, have shape (K, 2, 3), m; radii have shape (K,), m. `names` are of the cylinders and then
    of the solids' owners.
    """

    names: tuple[str, ...]
    axes: Array
    radii: Array
    waste_level: float
    bed: Bed | None = None
    solids: Blocks = field(default_factory=lambda: make_blocks(()))

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for name in ("axes", "radii"):
            frozen = np.array(getattr(self, name), float)
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    def distances(self, a: ArrayLike, b: ArrayLike) -> Array:
        """Distance of segments, ends of shape (R, 3) or (3,), m, from each of `names`, the least of all, shape (P,), m."""
        first, last = (np.array(np.atleast_2d(np.asarray(end, float)), order="C") for end in (a, b))
        away = segment_distance(first[:, None], last[:, None], self.axes[:, 0], self.axes[:, 1])[0] - self.radii
        least, slope = np.full(len(self.names), np.inf), np.empty(3)
        least[: len(self.radii)] = away.min(axis=0)
        for k, owner in enumerate(self.solids.owner + len(self.radii)):
            gaps = [to_block(self.solids, k, *ends, np.inf, slope)[0] for ends in zip(first, last, strict=True)]
            least[owner] = min(least[owner], *gaps)
        return least


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
    """Equipment and waste of a tank; equipment without a top ends at the dome above it, without a bottom on the floor."""
    profile = make_profile(tank.shell)
    axes = [cylinder_axis(item, profile) for item in tank.standing]
    hulls = [(owner, hull) for owner, item in enumerate(tank.solids) for hull in find_hulls(item, profile)]
    return Obstacles(
        names=tuple(item.name for item in tank.things),
        axes=np.reshape(np.array(axes, float), (-1, 2, 3)),
        radii=np.array([item.diameter / 2 for item in tank.standing], float),
        waste_level=tank.waste.level,
        bed=make_bed(tank),
        solids=make_blocks(hulls),
    )


def make_walls(tank: Tank, profile: Profile, around: Obstacles) -> gaps.Walls:
    """The tank, its obstacles and its waste, for compiled functions."""
    bed = around.bed
    heights, ground = (np.empty((0, 0)), np.zeros(5)) if bed is None else (bed.heights, bed.ground)
    figures = profile.figures, find_mouth(tank, profile), np.array(around.axes), np.array(around.radii)
    return *figures, around.waste_level, heights, ground, around.solids


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
    length. Cylinders are rounded at their ends by their radius, which makes the result a lower bound there.
    If only the least distance of the whole batch counts, `together`, others may be given as infinite or too great.
    """
    nodes = np.asarray(nodes, float)
    balls, ball_radii = nodes, np.full(nodes.shape[-2], hub_radius)
    if payload is not None:
        tool = np.broadcast_to(np.asarray(payload[0], float)[..., None, :], (*nodes.shape[:-2], 1, 3))
        balls, ball_radii = np.concatenate([nodes, tool], -2), np.append(ball_radii, payload[1])
    thick = np.concatenate([np.broadcast_to(np.asarray(radii, float), (len(ends),)), ball_radii])
    walls = make_walls(tank, profile, around)
    return wall_clearance(balls, np.array(ends, np.intp), thick, walls, around.names, together)


def wall_clearance(
    balls: Array, ends: Index, radii: Array, walls: gaps.Walls, names: tuple[str, ...], together: bool = False
) -> Clearance:
    """`arm_clearance` from walls of named obstacles that are made already; the payload is one more of the balls (..., N, 3), m.

    Radii are of members and then of balls, shape (M + N,), m.
    """
    batch, flat = balls.shape[:-2], np.array(balls.reshape(-1, *balls.shape[-2:]), order="C")
    places = (SHELL, RISER, *names, WASTE)
    distance = np.empty((len(flat), len(places)))
    body = np.empty((len(flat), len(places)), np.intp)
    gaps.measure_arm(walls, flat, ends, radii, distance, body, together)
    return Clearance(places, distance.reshape(*batch, -1), body.reshape(*batch, -1))


def nearest_pair(pairs: MemberPairs, nodes: ArrayLike) -> tuple[Array, Index]:
    """Least distance, shape (...), m, between two members of a pair, and the two members, (..., 2).

    Nodes in frame G have shape (..., N, 3), m. Without a pair the distance is infinite and the members are -1.
    """
    nodes = np.asarray(nodes, float)
    batch, flat = nodes.shape[:-2], np.array(nodes.reshape(-1, *nodes.shape[-2:]), order="C")
    distance, pair = np.empty(len(flat)), np.empty((len(flat), 2), np.intp)
    gaps.measure_pairs(pairs, flat, distance, pair)
    return distance.reshape(batch), pair.reshape(*batch, 2)
