"""Signed distances to the tank's inner surface and distances between segments, exact and over any batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description import Tank
from vgtsim.errors import DescriptionError
from vgtsim.geometry import gaps
from vgtsim.geometry.profile import Profile

Array = NDArray[np.float64]

_CLOSED = np.array([0.0, np.inf, 0.0, 0.0, 0.0, 1.0])  # a mouth that no point is below or above


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
