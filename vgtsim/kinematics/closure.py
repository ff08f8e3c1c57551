"""The closure of an octahedral cell: three nodes on circles about the edges of a triangle.

The equivalent mechanism of section 3.4.1 puts each upper node on a circle about a base edge, at an angle phi. With the
base triangle in a plane of normal w, the squared distance of the nodes of circles i and j is

    D² = a + b cos(phi_i) + g cos(phi_j) + e cos(phi_i) cos(phi_j) + f sin(phi_i) sin(phi_j),

so a cell is fifteen numbers, m²: a, b, g, e, f for each of three pairs. F = D² - edge² has to vanish (3.13, 3.33,
3.46). The closure is one array C of shape (5, 3, ...), with the squared edges already taken from a and the batch
dimensions last. Unless a function says otherwise, angles in this file have shape (3, ...), rad, for the same reason.

A face's corners come as first, second, third. Its frame has its origin at the centroid, X along first - third and Z along
(first - third) x (second - third) (equations 3.15 to 3.19), so seen from +Z the corners run counter-clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index
from vgtsim.errors import AssemblyError

LOWER = np.array([[2, 0], [0, 1], [1, 2]])  # base edge, start to end, of n4, n5, n6 (3.28)
UPPER = np.array([[0, 1], [1, 2], [2, 0]])  # edge of the mid-plane, start to end, of n7, n8, n9 (3.41)
_NEXT = np.array([1, 2, 0])


@dataclass(frozen=True)
class Circles:
    """Circles of the three upper nodes, in the frame of the base triangle.

    Attributes:
        centre: b_1 to b_3 of equation 3.6, shape (..., 3, 3), m.
        inward: v_1 to v_3: unit vectors in the base plane, normal to their edges, shape (..., 3, 3).
        radius: h_1 to h_3 of equation 3.7, shape (..., 3), m.
    """

    centre: Array
    inward: Array
    radius: Array


def make_circles(base: ArrayLike, longerons: ArrayLike, edges: Index, module: str) -> Circles:
    """Circles of the equivalent mechanism over a base triangle, corners of shape (..., 3, 3), m, in its frame.

    Longerons are three lengths to the ends of the edges, then three to their starts, shape (..., 6), m: l1 to l6 with
    edges `LOWER`, L7 to L12 with `UPPER`. The error is of the module's name.

    Raises:
        AssemblyError: Two longerons do not meet over their edge; they are named.

    Source: equations 3.5 to 3.11, 3.29 to 3.31, 3.38 to 3.40 and 3.42 to 3.44.
    """
    nodes, lengths = np.asarray(base, float), np.asarray(longerons, float)
    far, near = lengths[..., :3], lengths[..., 3:]
    side = np.linalg.norm(nodes[..., edges[:, 1], :] - nodes[..., edges[:, 0], :], axis=-1)
    side = np.broadcast_to(side, np.broadcast_shapes(side.shape, far.shape))
    gap = np.maximum(side - far - near, np.abs(far - near) - side)
    if not np.all(gap < 0):
        worst = np.unravel_index(int(np.argmax(gap)), gap.shape)
        pair = worst[-1] + 1 + (0 if edges is LOWER else 6)
        first, second = np.broadcast_to(far, gap.shape)[worst], np.broadcast_to(near, gap.shape)[worst]
        over = f"{first:.4g} m and {second:.4g} m, over an edge of {side[worst]:.4g} m"
        raise AssemblyError(module, float(gap[worst]), f"longerons {pair} and {pair + 3}, {over}")
    return place_circles(nodes, lengths, edges)


def place_circles(base: Array, longerons: Array, edges: Index) -> Circles:
    """As `make_circles`, but with radii that are not numbers where two longerons do not meet."""
    start, end = base[..., edges[:, 0], :], base[..., edges[:, 1], :]
    far, near = longerons[..., :3], longerons[..., 3:]
    span = end - start
    side = np.linalg.norm(span, axis=-1)
    along = span / side[..., None]
    foot = (side**2 + near**2 - far**2) / (2 * side)
    inward = np.stack([-along[..., 1], along[..., 0], np.zeros_like(side)], axis=-1)
    radius = np.sqrt(near**2 - foot**2)
    return Circles(start + foot[..., None] * along, np.broadcast_to(inward, (*radius.shape, 3)), radius)


def circle_nodes(circles: Circles, phi: ArrayLike) -> Array:
    """Upper nodes in the frame of the base triangle, shape (..., 3, 3), m, at angles of shape (..., 3), rad (3.9, 3.28, 3.41).

    An angle of zero points inward, a quarter turn along the normal of the base.
    """
    angle = np.asarray(phi, float)[..., None]
    lift = np.array([0.0, 0.0, 1.0])
    return circles.centre + circles.radius[..., None] * (np.cos(angle) * circles.inward + np.sin(angle) * lift)


def circle_angles(circles: Circles, nodes: ArrayLike) -> Array:
    """Angles, shape (..., 3), rad, of upper nodes on their circles, shape (..., 3, 3), m, in the frame of the base."""
    arm = np.asarray(nodes, float) - circles.centre
    return np.arctan2(arm[..., 2], np.sum(arm * circles.inward, axis=-1))


def circle_tangents(circles: Circles, phi: ArrayLike) -> Array:
    """Derivatives dn_i/dphi_i of the upper nodes, shape (..., 3, 3), m/rad, at angles of shape (..., 3)."""
    angle = np.asarray(phi, float)[..., None]
    lift = np.array([0.0, 0.0, 1.0])
    return circles.radius[..., None] * (np.cos(angle) * lift - np.sin(angle) * circles.inward)


def edge_lengths(nodes: Array) -> Array:
    """Distances between first and second, second and third, third and first of three nodes, shape (..., 3, 3): (..., 3), m."""
    return np.linalg.norm(nodes[..., _NEXT, :] - nodes, axis=-1)


def closure_coefficients(circles: Circles, edges: ArrayLike) -> Array:
    """The fifteen numbers of a cell's closure, C of shape (5, 3, ...), m².

    Edges are the lengths between first and second, second and third, third and first upper node, shape (..., 3), m.
    """
    edges = np.asarray(edges, float)
    shape = np.broadcast_shapes(circles.radius.shape, edges.shape)
    c, v = (
        np.moveaxis(np.broadcast_to(item[..., :2], (*shape, 2)), (-1, -2), (0, 1))
        for item in (circles.centre, circles.inward)
    )
    h, edge = (np.moveaxis(np.broadcast_to(item, shape), -1, 0) for item in (circles.radius, edges))
    apart, h2, v2 = c[:, _NEXT] - c, h[_NEXT], v[:, _NEXT]
    a = apart[0] ** 2 + apart[1] ** 2 + h**2 + h2**2 - edge**2
    b = -2 * h * (apart[0] * v[0] + apart[1] * v[1])
    g = 2 * h2 * (apart[0] * v2[0] + apart[1] * v2[1])
    f = -2 * h * h2
    return np.stack([a, b, g, f * (v[0] * v2[0] + v[1] * v2[1]), f])


def closure_slopes(C: NDArray, cosine: NDArray, sine: NDArray) -> tuple[NDArray, NDArray]:
    """dF_k/dphi_k and dF_k/dphi_(k+1), each shape (3, ...), m²/rad, of cosines and sines of phi.

    Row k of equation 3.14 has only these two entries.
    """
    _, b, g, e, f = C
    c2, s2 = cosine[_NEXT], sine[_NEXT]
    return f * cosine * s2 - sine * (b + e * c2), f * sine * c2 - s2 * (g + e * cosine)


def edge_jacobian(C: ArrayLike, edges: ArrayLike, phi: ArrayLike) -> Array:
    """dD/dphi, the matrix of equation 3.14, shape (..., 3, 3), m/rad, at distances and angles of shape (..., 3)."""
    angle, edge = np.moveaxis(np.asarray(phi, float), -1, 0), np.asarray(edges, float)
    p, q = closure_slopes(np.asarray(C, float), np.cos(angle), np.sin(angle))
    J = np.zeros((*angle.shape[1:], 3, 3))
    for k in range(3):
        J[..., k, k] = p[k] / (2 * edge[..., k])
        J[..., k, _NEXT[k]] = q[k] / (2 * edge[..., k])
    return J


def angle_jacobian(circles: Circles, phi: Array) -> Array:
    """As `edge_jacobian`, of upper nodes wherever they are on their circles, at angles of shape (..., 3)."""
    length = edge_lengths(circle_nodes(circles, phi))
    return edge_jacobian(closure_coefficients(circles, length), length, phi)


def triangle_nodes(sides: ArrayLike) -> Array:
    """Corners of a triangle in its own frame, shape (..., 3 corners, 3), m; all z are zero.

    Sides are first-second, second-third, third-first, shape (..., 3), m.

    Raises:
        AssemblyError: The sides do not form a triangle; the residual is the excess of the longest side.
    """
    s = np.asarray(sides, float)
    excess = 2 * np.max(s, axis=-1) - np.sum(s, axis=-1)
    if np.any(~(excess < 0)) or np.any(s <= 0):
        worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
        raise AssemblyError("face triangle", float(np.max(excess)), f"sides {np.array2string(s[worst], precision=4)} m")
    return place_triangle(s)


def place_triangle(sides: Array) -> Array:
    """As `triangle_nodes`, but with corners that are not numbers where the sides do not close."""
    s = sides
    first, foot = s[..., 2], (s[..., 2] ** 2 + s[..., 1] ** 2 - s[..., 0] ** 2) / (2 * s[..., 2])
    nodes = np.zeros((*s.shape, 3))
    nodes[..., 0, 0] = first
    nodes[..., 1, 0] = foot
    nodes[..., 1, 1] = np.sqrt(s[..., 1] ** 2 - foot**2)
    return nodes - np.mean(nodes, axis=-2, keepdims=True)


def triangle_frame(nodes: ArrayLike) -> tuple[Array, Array]:
    """Rotation, shape (..., 3, 3), and origin, shape (..., 3), m, of the frame on three corners, shape (..., 3, 3), m.

    Both are in the frame of the corners. Source: equations 3.15 to 3.19, and 3.47 to 3.50 with the top nodes 7 to 9.
    """
    n = np.asarray(nodes, float)
    along, other = n[..., 0, :] - n[..., 2, :], n[..., 1, :] - n[..., 2, :]
    X = along / np.linalg.norm(along, axis=-1, keepdims=True)
    Z = np.cross(along, other)
    Z /= np.linalg.norm(Z, axis=-1, keepdims=True)
    return np.stack([X, np.cross(Z, X), Z], axis=-1), np.mean(n, axis=-2)
