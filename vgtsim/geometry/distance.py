"""Signed distances to the tank's inner surface and distances between segments, exact and over any batch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry.profile import Profile

Array = NDArray[np.float64]

# m; a point on the border of two sectors must not fall between them. The distance to the wrong one of two
# tangent arcs is off by the square of this.
_SECTOR_SLACK = 1e-9


def interior_distance(profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance to the inner surface of the tank, its riser openings taken as closed.

    The nearest point of a surface of revolution lies in the meridian plane of the point. In that plane each
    piece has a foot for the points of its own sector; the tank is convex and smooth, so that the least of
    these signed distances is the distance itself, on either side.

    Args:
        profile: The tank.
        points: In frame G, shape (..., 3), m.

    Returns:
        Distance, shape (...), m, positive inside; and its gradient, the unit inward direction from the
        nearest point of the surface, shape (..., 3). Where several points of the surface are nearest, one is
        taken.
    """
    rho, z, outward, shape = _meridian(points)
    distances = _to_pieces(profile, rho, z)
    nearest = distances.argmin(axis=0)
    gradient = _in_space(_piece_gradient(profile, rho, z, nearest), outward)
    return distances.min(axis=0).reshape(shape), gradient.reshape(*shape, 3)


def enclosure_distance(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance to the surface around the arm: the tank opened into the bore of the arm riser.

    The bore is a cylinder from the rim, where it meets the dome, upward without end: what stands on the
    riser's flange is not described. The distance is exact inside the tank and the bore, and outside both of
    them.

    Args:
        tank: Its arm riser is read.
        profile: Its profile.
        points: In frame G, shape (..., 3), m.

    Returns:
        Distance, shape (...), m, positive inside either; and its gradient, unit vectors of shape (..., 3).
    """
    rho, z, outward, shape = _meridian(points)
    near = _find_nearest(tank, profile, rho, z)
    gradient = _piece_gradient(profile, rho, z, near.piece)
    to_rim = np.stack([rho, z], -1) - near.rim
    reach = np.hypot(to_rim[:, 0], to_rim[:, 1])
    gradient = np.where(near.at_rim[:, None], to_rim / np.where(reach > 0, reach, 1.0)[:, None], gradient)
    gradient[near.in_bore] = [-1.0, 0.0]
    return near.distance.reshape(shape), _in_space(gradient, outward).reshape(*shape, 3)


def mouth_distance(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """The distance of `enclosure_distance`, and whether the nearest surface is the riser's rim or bore.

    Args:
        tank: Its arm riser is read.
        profile: Its profile.
        points: In frame G, shape (..., 3), m.

    Returns:
        Distance, shape (...), m; true where the riser is nearest, shape (...).
    """
    rho, z, _, shape = _meridian(points)
    near = _find_nearest(tank, profile, rho, z)
    return near.distance.reshape(shape), (near.at_rim | near.in_bore).reshape(shape)


@dataclass(frozen=True)
class _Nearest:
    """Nearest surface of the opened tank to n points of the meridian plane.

    Attributes:
        distance: Signed, shape (n,), m.
        piece: Index of the nearest piece of the profile, shape (n,); of no meaning where the riser is nearest.
        at_rim: Where the riser's rim is nearest, shape (n,).
        in_bore: Where the riser's bore is nearest, shape (n,).
        rim: The rim (r, z), shape (2,), m.
    """

    distance: Array
    piece: NDArray[np.intp]
    at_rim: NDArray[np.bool_]
    in_bore: NDArray[np.bool_]
    rim: Array


def _find_nearest(tank: Tank, profile: Profile, rho: Array, z: Array) -> _Nearest:
    bore = tank.arm_riser.bore / 2
    rim, dome = float(profile.ceiling_at(bore)), profile.piece("dome")
    distances = _to_pieces(profile, rho, z)
    piece, distance = distances.argmin(axis=0), distances.min(axis=0)
    in_bore = (z >= rim) & ((rho < bore) | (bore - rho > distance))
    # below the rim, points whose foot on the dome would fall into the opening
    below = (z < rim) & (rho * (rim - dome.centre[1]) < bore * (z - dome.centre[1]))
    at_rim = np.zeros(rho.shape, dtype=bool)
    if below.any():
        others = distances[:-1, below]  # all pieces but the dome
        least, reach = others.min(axis=0), np.hypot(rho[below] - bore, z[below] - rim)
        at_rim[below] = reach < least
        piece[below] = others.argmin(axis=0)
        distance[below] = np.minimum(reach, least)
    return _Nearest(np.where(in_bore, bore - rho, distance), piece, at_rim, in_bore, np.array([bore, rim]))


def segment_distance(a0: ArrayLike, a1: ArrayLike, b0: ArrayLike, b1: ArrayLike) -> tuple[Array, Array, Array]:
    """Least distance between segments.

    The squared distance is a convex quadratic of the two parameters on the unit square. The free minimum over s is
    clipped, then t is the best for that s, then s the best for that t: the least value on the square. Parallel segments
    and segments of no length need no case of their own.

    Args:
        a0: First ends of the first segments, shape (..., 3), m.
        a1: Their second ends.
        b0: First ends of the second segments; shapes broadcast.
        b1: Their second ends.

    Returns:
        Distance, shape (...), m, and the parameters s, t in [0, 1], shape (...), of the closest points
        a0 + s (a1 - a0) and b0 + t (b1 - b0). With the unit vector n from the second to the first, the
        gradient of the distance is (1 - s) n, s n, -(1 - t) n, -t n by a0, a1, b0, b1.

    Source: C. Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    a0, a1, b0, b1 = (np.asarray(point, float) for point in (a0, a1, b0, b1))
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv, uw, vw = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, w), _dot(v, w)
    s = _ratio(uv * vw - vv * uw, uu * vv - uv**2)
    t = _ratio(uv * s + vw, vv)
    s = _ratio(uv * t - uw, uu)
    gap = w + s[..., None] * u - t[..., None] * v
    return np.sqrt(_dot(gap, gap)), s, t


def _meridian(points: ArrayLike) -> tuple[Array, Array, Array, tuple[int, ...]]:
    """Distance from the axis and height, each (n,), outward unit vector, (n, 2), x on the axis, and the batch's shape."""
    points = np.asarray(points, float)
    flat = points.reshape(-1, 3)
    rho = np.hypot(flat[:, 0], flat[:, 1])
    outward = flat[:, :2] / np.where(rho > 0, rho, 1.0)[:, None]
    outward[rho == 0] = [1.0, 0.0]
    return rho, flat[:, 2], outward, points.shape[:-1]


def _in_space(gradient: Array, outward: Array) -> Array:
    """A gradient (r, z) of the meridian plane as a vector (x, y, z)."""
    return np.concatenate([gradient[:, :1] * outward, gradient[:, 1:]], axis=-1)


def _to_pieces(profile: Profile, rho: Array, z: Array) -> Array:
    """Signed distances of n points to all pieces, shape (5, n), m; infinite outside a piece's sector.

    A piece's distance is counted from its start, not from its centre, so it stays finite when the piece is straight.
    """
    table = profile.table
    start, end, along, after = (item.T[..., None] for item in (table.start, table.end, table.along, table.after))
    curvature = table.curvature[:, None]
    r, h = rho - start[0], z - start[1]
    x, y = r * along[0] + h * along[1], h * along[0] - r * along[1]
    reach = np.hypot(curvature * x, 1 - curvature * y)
    distance = (2 * y - curvature * (x**2 + y**2)) / (1 + reach)
    beyond = (rho - end[0]) * after[0] + (z - end[1]) * after[1] > _SECTOR_SLACK
    distance[(x < -_SECTOR_SLACK) | beyond] = np.inf
    return distance


def _piece_gradient(profile: Profile, rho: Array, z: Array, which: NDArray[np.intp]) -> Array:
    """Gradient (r, z) of the distance to one piece for each of n points, shape (n, 2)."""
    table = profile.table
    start, along, curvature = table.start[which].T, table.along[which].T, table.curvature[which]
    r, h = rho - start[0], z - start[1]
    turn_x = curvature * (r * along[0] + h * along[1])
    turn_y = 1 - curvature * (h * along[0] - r * along[1])
    reach = np.hypot(turn_x, turn_y)
    scale = np.where(reach > 0, reach, 1.0)
    lean, rise = -turn_x / scale, np.where(reach > 0, turn_y / scale, 1.0)
    return np.stack([lean * along[0] - rise * along[1], lean * along[1] + rise * along[0]], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", a, b)


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Quotient clipped to [0, 1]; zero where the denominator vanishes."""
    safe = denominator > 0
    return np.where(safe, np.clip(numerator / np.where(safe, denominator, 1.0), 0.0, 1.0), 0.0)
