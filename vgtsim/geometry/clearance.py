"""How near the arm comes to the tank, to what stands in it, and to itself: signed distances, exact and over any batch."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index
from vgtsim.description import Tank
from vgtsim.errors import DescriptionError
from vgtsim.geometry import gaps
from vgtsim.geometry.bed import Bed, make_bed
from vgtsim.geometry.blocks import Blocks, make_blocks, to_block
from vgtsim.geometry.pairs import MemberPairs
from vgtsim.geometry.profile import Profile, make_profile
from vgtsim.geometry.things import cylinder_axis, find_hulls

SHELL, RISER, WASTE = "shell", "riser", "waste"
_CLOSED = np.array([0.0, np.inf, 0.0, 0.0, 0.0, 1.0])  # a mouth that no point is below or above


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
    return gaps.Walls(
        curve=profile.figures,
        mouth=find_mouth(tank, profile),
        axes=np.array(around.axes),
        thick=np.array(around.radii),
        level=around.waste_level,
        bed=heights,
        ground=ground,
        blocks=around.solids,
    )


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
    """Least distance, shape (...), m, between the two members of a pair, and which two, shape (..., 2), in frame G.

    Nodes have shape (..., N, 3), m. Without a pair the distance is infinite and the members are -1. A ball is a member with one
    node twice: append the tool point to the nodes to count the payload.
    """
    nodes = np.asarray(nodes, float)
    batch, flat = nodes.shape[:-2], np.array(nodes.reshape(-1, *nodes.shape[-2:]), order="C")
    distance, pair = np.empty(len(flat)), np.empty((len(flat), 2), np.intp)
    gaps.measure_pairs(pairs, flat, distance, pair)
    return distance.reshape(batch), pair.reshape(*batch, 2)


def interior_distance(profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance, m, positive inside, to the tank's inner surface, risers closed, of points in frame G, (..., 3).

    The second result is its gradient, shape (..., 3): the unit inward direction from the nearest point, or from one of
    them. The nearest point lies in the meridian plane of the point. Each piece there has a foot for the points of its
    sector. The tank is convex and smooth, so the least of these signed distances is the distance, on either side.
    """
    return _measure(profile, _CLOSED, points)


def enclosure_distance(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance, m, positive inside, and its gradient, (..., 3), for the tank opened into the bore of the arm riser.

    Points are in frame G, shape (..., 3), m. The bore is a cylinder from the rim, where it meets the dome, upward
    without end: equipment on the riser's flange is not described. The distance is exact inside, and outside tank and
    bore both.

    Raises:
        DescriptionError: The arm's riser does not stand on the dome.
    """
    return _measure(profile, find_mouth(tank, profile), points)


def find_mouth(tank: Tank, profile: Profile) -> Array:
    """The arm riser's mouth on the dome, shape (6,), m, see `gaps`.

    Raises:
        DescriptionError: The riser's pipe does not stand on the dome: it meets its edge or the haunch.
    """
    riser, dome = tank.arm_riser, profile.pieces[-1]
    bore, edge = riser.bore / 2, dome.start[0]
    pipe = bore + riser.wall
    if riser.radius + pipe > edge:
        found = f"{riser.radius:.4g} m, a pipe that comes {riser.radius + pipe:.4g} m from the tank's axis"
        raise DescriptionError(
            None, f"{riser.name}.radius", found, f"at most {edge - pipe:.4g} m: the arm's riser stands on the dome"
        )
    return np.array([bore, profile.rim(bore, riser.radius), dome.centre[1], *riser.place, dome.radius])


def _measure(profile: Profile, mouth: Array, points: ArrayLike) -> tuple[Array, Array]:
    points = np.asarray(points, float)
    flat = np.array(points.reshape(-1, 3), order="C")
    distance, inward = np.empty(len(flat)), np.empty(flat.shape)
    gaps.measure_enclosure(profile.figures, mouth, flat, distance, inward)
    return distance.reshape(points.shape[:-1]), inward.reshape(points.shape)


def segment_distance(a0: ArrayLike, a1: ArrayLike, b0: ArrayLike, b1: ArrayLike) -> tuple[Array, Array, Array]:
    """Least distance between segments a0 a1 and b0 b1, shapes (..., 3), m, which broadcast.

    Returns distances, shape (...), m, and the parameters s, t in [0, 1] of the closest points a0 + s (a1 - a0) and b0 +
    t (b1 - b0). With the unit vector n from the second to the first, the gradient is (1 - s) n, s n, -(1 - t) n, -t n
    by a0, a1, b0, b1.

    The squared distance is a convex quadratic on the unit square. The free minimum is clipped in s, t is the best for
    that s, clipped, and s the best for that t. Parallel segments and segments of no length need no case of their own.

    Source: C. Ericson, Real-Time Collision Detection, section 5.1.9.
    """
    ends = np.broadcast_arrays(*(np.asarray(point, float) for point in (a0, a1, b0, b1)))
    batch, found = ends[0].shape[:-1], np.empty((ends[0].size // 3, 3))
    first, last, other_first, other_last = (np.array(point.reshape(-1, 3), order="C") for point in ends)
    gaps.measure_segments(first, last, other_first, other_last, found)
    distance, s, t = found.T.reshape(3, *batch)
    return distance, s, t
