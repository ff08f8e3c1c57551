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
    """Signed distance, m, positive inside, to the tank's inner surface, risers closed, of points in frame G, (..., 3).

    The second result is its gradient, shape (..., 3): the unit inward direction from the nearest point, or from one of
    them. The nearest point lies in the meridian plane of the point. Each piece there has a foot for the points of its
    sector. The tank is convex and smooth, so the least of these signed distances is the distance, on either side.
    """
    points = np.asarray(points, float)
    rho, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    feet = _to_pieces(profile, rho, z)
    piece = feet.argmin(axis=0)
    distance = np.take_along_axis(feet, piece[None], axis=0)[0]
    return distance, _in_space(_inward(profile, rho, z, piece), points, rho)


def enclosure_distance(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance, m, positive inside, and its gradient, (..., 3), for the tank opened into the bore of the arm riser.

    Points are in frame G, shape (..., 3), m. The bore is a cylinder from the rim, where it meets the dome, upward
    without end: equipment on the riser's flange is not described. The distance is exact inside, and outside tank and
    bore both.
    """
    points = np.asarray(points, float)
    found = _enclose(tank, profile, points)
    rho, z, (bore, rim) = found.rho, points[..., 2], found.mouth_circle
    gradient = _inward(profile, rho, z, found.piece)
    to_rim = np.stack([rho - bore, z - rim], axis=-1)
    reach = np.where(found.reach > 0, found.reach, 1.0)
    gradient = np.where(found.at_rim[..., None], to_rim / reach[..., None], gradient)
    gradient = np.where(found.in_bore[..., None], [-1.0, 0.0], gradient)
    return found.distance, _in_space(gradient, points, rho)


def enclosure_depth(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """`enclosure_distance` without its gradient, and whether the riser's rim or bore is the nearest surface, (...)."""
    found = _enclose(tank, profile, np.asarray(points, float))
    return found.distance, found.at_rim | found.in_bore


@dataclass(frozen=True)
class _Enclosed:
    """Where points are in the tank and its riser, all of shape (...).

    `rho` is the distance from the axis, m; `piece` is the nearest piece of the profile of those that count; `reach` is
    the distance from the riser's rim, m, whose radius and height, m, are `mouth_circle`.
    """

    distance: Array
    rho: Array
    piece: NDArray[np.intp]
    reach: Array
    at_rim: NDArray[np.bool_]
    in_bore: NDArray[np.bool_]
    mouth_circle: tuple[float, float]


def _enclose(tank: Tank, profile: Profile, points: Array) -> _Enclosed:
    rho, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    bore = tank.arm_riser.bore / 2
    rim, dome = profile.rim(bore), profile.pieces[-1].centre
    feet = _to_pieces(profile, rho, z)
    closed = feet.min(axis=0)
    reach = np.hypot(rho - bore, z - rim)
    # below the rim, points whose foot on the dome would fall into the opening
    below = (z < rim) & (rho * (rim - dome[1]) < bore * (z - dome[1]))
    above = (z >= rim) & ((rho < bore) | (bore - rho > closed))
    feet[-1:][below[None]] = np.inf  # the dome ends at the rim
    piece = feet.argmin(axis=0)
    others = feet.min(axis=0)
    distance = np.where(above, bore - rho, np.where(below, np.minimum(reach, others), closed))
    return _Enclosed(
        distance=distance,
        rho=rho,
        piece=piece,
        reach=reach,
        at_rim=below & (reach < others),
        in_bore=above,
        mouth_circle=(bore, rim),
    )


def segment_distance(a0: ArrayLike, a1: ArrayLike, b0: ArrayLike, b1: ArrayLike) -> tuple[Array, Array, Array]:
    """Least distance between segments a0 a1 and b0 b1, shapes (..., 3), m, which broadcast.

    Returns distances, shape (...), m, and the parameters s, t in [0, 1] of the closest points a0 + s (a1 - a0) and b0 +
    t (b1 - b0). With the unit vector n from the second to the first, the gradient is (1 - s) n, s n, -(1 - t) n, -t n
    by a0, a1, b0, b1.

    The squared distance is a convex quadratic on the unit square. The free minimum is clipped in s, t is the best for
    that s, clipped, and s the best for that t. Parallel segments and segments of no length need no case of their own.

    Source: C. Ericson, Real-Time Collision Detection, section 5.1.9.
    """
    a0, a1, b0, b1 = (np.asarray(point, float) for point in (a0, a1, b0, b1))
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw = _dot(u, w), _dot(v, w)
    s = _ratio(uv * vw - vv * uw, uu * vv - uv * uv)
    t = _ratio(uv * s + vw, vv)
    s = _ratio(uv * t - uw, uu)
    gap = w + s[..., None] * u - t[..., None] * v
    return np.sqrt(_dot(gap, gap)), s, t


def _in_space(gradient: Array, points: Array, rho: Array) -> Array:
    """A gradient (r, z) of the meridian plane as a vector (x, y, z); outward is along x on the axis."""
    off = rho > 0
    scale = gradient[..., 0] / np.where(off, rho, 1.0)
    x, y = np.where(off, scale * points[..., 0], gradient[..., 0]), scale * points[..., 1]
    return np.stack([x, y, gradient[..., 1]], axis=-1)


def _to_pieces(profile: Profile, rho: Array, z: Array) -> Array:
    """Signed distance to each of the P pieces, shape (P, ...); infinite outside a piece's sector."""
    table = profile.table(rho.ndim)
    r, h = rho - table.start[0], z - table.start[1]
    x, y = r * table.along[0] + h * table.along[1], h * table.along[0] - r * table.along[1]
    k = table.curvature
    # from the centre, in units of the radius; stays finite when the piece is straight
    reach = np.hypot(k * x, 1 - k * y)
    distance = (2 * y - k * (x * x + y * y)) / (1 + reach)
    past = (rho - table.end[0]) * table.leaving[0] + (z - table.end[1]) * table.leaving[1]
    distance[(x < -_SECTOR_SLACK) | (past > _SECTOR_SLACK)] = np.inf
    return distance


def _inward(profile: Profile, rho: Array, z: Array, piece: NDArray[np.intp]) -> Array:
    """Unit direction (r, z) from the nearest point of a piece, shape (..., 2)."""
    table = profile.table(0)
    along_r, along_z, k = table.along[0][piece], table.along[1][piece], table.curvature[piece]
    r, h = rho - table.start[0][piece], z - table.start[1][piece]
    turn_x, turn_y = k * (r * along_r + h * along_z), 1 - k * (h * along_r - r * along_z)
    reach = np.hypot(turn_x, turn_y)
    scale = np.where(reach > 0, reach, 1.0)
    lean, rise = -turn_x / scale, np.where(reach > 0, turn_y / scale, 1.0)
    return np.stack([lean * along_r - rise * along_z, lean * along_z + rise * along_r], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Quotient clipped to [0, 1]; zero where the denominator vanishes."""
    # an infinite divisor makes the quotient zero: one array fewer than two masks
    return np.minimum(np.maximum(numerator / np.where(denominator > 0, denominator, np.inf), 0.0), 1.0)
