"""Signed distances to the tank's inner surface and distances between segments, exact and over any batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.tank import Tank
from vgtsim.geometry.profile import Piece, Profile

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
    rho, z, outward = _meridian(points)
    distance, gradient = _least([_to_piece(piece, rho, z) for piece in profile.pieces])
    return distance, _in_space(gradient, outward)


def enclosure_distance(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, Array]:
    """Signed distance to the surface around the arm: the tank opened into the bore of the arm riser.

    The bore is a cylinder from the rim, where it meets the dome, upward without end: what stands on the
    riser's flange is not described. The distance is exact inside the tank and the bore, and outside both of
    them.

    Args:
        tank: The tank; its arm riser is read.
        profile: Its profile.
        points: In frame G, shape (..., 3), m.

    Returns:
        Distance, shape (...), m, positive inside either; and its gradient, unit vectors of shape (..., 3).
    """
    distance, gradient, _ = enclosure_parts(tank, profile, points)
    return distance, gradient


def enclosure_parts(tank: Tank, profile: Profile, points: ArrayLike) -> tuple[Array, Array, NDArray[np.bool_]]:
    """`enclosure_distance`, and whether the nearest surface is the riser's rim or bore.

    Args:
        tank: The tank; its arm riser is read.
        profile: Its profile.
        points: In frame G, shape (..., 3), m.

    Returns:
        Distance, shape (...), m; gradient, shape (..., 3); true where the riser is nearest, shape (...).
    """
    rho, z, outward = _meridian(points)
    bore = tank.arm_riser.bore / 2
    rim = float(profile.ceiling_at(bore))
    dome = profile.piece("dome")
    candidates = [_to_piece(piece, rho, z) for piece in profile.pieces]
    closed, closed_gradient = _least(candidates)
    to_rim = np.stack([rho - bore, z - rim], -1)
    reach = np.linalg.norm(to_rim, axis=-1)
    rim_gradient = to_rim / np.where(reach > 0, reach, 1.0)[..., None]
    # below the rim, points whose foot on the dome would fall into the opening
    below = (z < rim) & (rho * (rim - dome.centre[1]) < bore * (z - dome.centre[1]))
    others, others_gradient = _least(candidates[:-1])
    above = (z >= rim) & ((rho < bore) | (bore - rho > closed))
    mouth = (below & (reach < others)) | above
    distance = np.where(above, bore - rho, np.where(below, np.minimum(reach, others), closed))
    flat = np.broadcast_to([-1.0, 0.0], closed_gradient.shape)
    open_gradient = np.where((reach < others)[..., None], rim_gradient, others_gradient)
    gradient = np.where(above[..., None], flat, np.where(below[..., None], open_gradient, closed_gradient))
    return distance, _in_space(gradient, outward), mouth


def segment_distance(a0: ArrayLike, a1: ArrayLike, b0: ArrayLike, b1: ArrayLike) -> tuple[Array, Array, Array]:
    """Least distance between segments.

    The squared distance is a convex quadratic of the two parameters on the unit square, so that its least
    value is at the free minimum or on one of the four edges; all five are formed and the least is taken.
    Parallel segments and segments of no length need no case of their own.

    Args:
        a0: First ends of the first segments, shape (..., 3), m.
        a1: Their second ends.
        b0: First ends of the second segments; shapes broadcast.
        b1: Their second ends.

    Returns:
        Distance, shape (...), m, and the parameters s, t in [0, 1], shape (...), of the closest points
        a0 + s (a1 - a0) and b0 + t (b1 - b0). With the unit vector n from the second to the first, the
        gradient of the distance is (1 - s) n, s n, -(1 - t) n, -t n by a0, a1, b0, b1.
    """
    a0, a1, b0, b1 = (np.asarray(point, float) for point in (a0, a1, b0, b1))
    u, v, w = np.broadcast_arrays(a1 - a0, b1 - b0, a0 - b0)
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw = _dot(u, w), _dot(v, w)
    zero = np.zeros_like(uu)
    s = _ratio(uv * vw - vv * uw, uu * vv - uv**2)
    choices = [(s, _ratio(uv * s + vw, vv))]
    choices += [(end, _ratio(uv * end + vw, vv)) for end in (zero, zero + 1)]
    choices += [(_ratio(uv * end - uw, uu), end) for end in (zero, zero + 1)]
    best_s, best_t = choices[0]
    least = _square(u, v, w, best_s, best_t)
    for s, t in choices[1:]:
        square = _square(u, v, w, s, t)
        nearer = square < least
        least, best_s, best_t = (np.where(nearer, *pair) for pair in ((square, least), (s, best_s), (t, best_t)))
    return np.sqrt(least), best_s, best_t


def _meridian(points: ArrayLike) -> tuple[Array, Array, Array]:
    """Distance from the axis, height, and the outward unit vector (..., 2); x on the axis."""
    points = np.asarray(points, float)
    rho = np.hypot(points[..., 0], points[..., 1])
    outward = points[..., :2] / np.where(rho > 0, rho, 1.0)[..., None]
    return rho, points[..., 2], np.where((rho > 0)[..., None], outward, [1.0, 0.0])


def _in_space(gradient: Array, outward: Array) -> Array:
    """A gradient (r, z) of the meridian plane as a vector (x, y, z)."""
    return np.concatenate([gradient[..., :1] * outward, gradient[..., 1:]], axis=-1)


def _to_piece(piece: Piece, rho: Array, z: Array) -> tuple[Array, Array]:
    """Signed distance and gradient to one piece; infinite outside its sector."""
    along = np.array([np.cos(piece.heading), np.sin(piece.heading)])
    inward = np.array([-along[1], along[0]])
    r, h = rho - piece.start[0], z - piece.start[1]
    x, y = r * along[0] + h * along[1], r * inward[0] + h * inward[1]
    k = piece.curvature
    # from the centre, in units of the radius; stays finite when the piece is straight
    turn_x, turn_y = k * x, 1 - k * y
    reach = np.hypot(turn_x, turn_y)
    distance = (2 * y - k * (x**2 + y**2)) / (1 + reach)
    end = piece.end
    heading = piece.heading + piece.turn
    before_end = (rho - end[0]) * np.cos(heading) + (z - end[1]) * np.sin(heading) <= _SECTOR_SLACK
    scale = np.where(reach > 0, reach, 1.0)
    lean, rise = -turn_x / scale, np.where(reach > 0, turn_y / scale, 1.0)
    gradient = lean[..., None] * along + rise[..., None] * inward
    return np.where((x >= -_SECTOR_SLACK) & before_end, distance, np.inf), gradient


def _least(candidates: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    distance, gradient = candidates[0]
    for other, other_gradient in candidates[1:]:
        nearer = other < distance
        distance = np.where(nearer, other, distance)
        gradient = np.where(nearer[..., None], other_gradient, gradient)
    return distance, gradient


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", a, b)


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Quotient clipped to [0, 1]; zero where the denominator vanishes."""
    safe = denominator > 0
    return np.where(safe, np.clip(numerator / np.where(safe, denominator, 1.0), 0.0, 1.0), 0.0)


def _square(u: Array, v: Array, w: Array, s: Array, t: Array) -> Array:
    gap = w + s[..., None] * u - t[..., None] * v
    return _dot(gap, gap)
