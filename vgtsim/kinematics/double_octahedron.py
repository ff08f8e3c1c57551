"""The symmetric batten-actuated double-octahedral module (sections 3.5.3 and 3.5.4).

Frame B sits at the centroid of the base triangle n1 n2 n3, X along n1 - n3 and Z towards the module; frame T sits on
the top triangle n7 n8 n9 in the same way (equations 3.47 to 3.50). The top triangle is the mirror image of the base in
the mid-plane, so the module's transform depends on the mid-plane alone. Its three inputs here are

    g = (u_x, u_y, d): the first two components of the mid-plane's unit normal U (3.52), and its distance d from the
    centroid of the base (3.53), in frame B,

which is a canonical input in the sense of section 3.2: everything follows from it in closed form.
Differs: the dissertation's canonical input is the three angles phi of equation 3.28; `midplane_from_angles` and
`angles` convert. (u_x, u_y, d) has no square root in the chain and makes the gimbal of figure 3.13 explicit.

Arrays carry any leading batch dimensions, written `...`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics.conditioning import invert_sound

Array = NDArray[np.float64]

# v_i: from the middle of the base edge that carries n4, n5, n6 towards the centroid (3.8)
INWARD = np.array([[0.0, 1.0, 0.0], [-np.sqrt(0.75), -0.5, 0.0], [np.sqrt(0.75), -0.5, 0.0]])
_ACTUATORS = np.array([[0, 1], [1, 2], [2, 0]])  # l1 = n4 n5, l2 = n5 n6, l3 = n6 n4 (3.33)


@dataclass(frozen=True)
class Geometry:
    """Fixed dimensions of a module, or of several, each figure then of shape (M,), for inputs of shape (..., M, 3).

    Attributes:
        face_side: Side b of the base and top triangles, m.
        longeron: Length of the twelve longerons, m.
        joint_offset: Ljo of equation 3.54, m.
    """

    face_side: float | Array
    longeron: float | Array
    joint_offset: float | Array = 0.0

    @property
    def height(self) -> Array:
        """Altitude of a longeron triangle on its base edge, m: h of equation 3.7."""
        return np.sqrt(np.asarray(self.longeron) ** 2 - np.asarray(self.face_side) ** 2 / 4)

    @property
    def apothem(self) -> Array:
        """Distance of the base edges from the centroid, m."""
        return np.asarray(self.face_side) / (2 * np.sqrt(3))


def face_nodes(face_side: float) -> Array:
    """Corners of a face triangle in its own frame.

    Args:
        face_side: Side b, m.

    Returns:
        n1, n2, n3, shape (3, 3), m.
    """
    apothem = face_side / (2 * np.sqrt(3))
    return np.array([[face_side / 2, -apothem, 0.0], [0.0, 2 * apothem, 0.0], [-face_side / 2, -apothem, 0.0]])


def normal(midplane: ArrayLike) -> Array:
    """Unit normal of the mid-plane.

    Args:
        midplane: (u_x, u_y, d), shape (..., 3).

    Returns:
        U in frame B, shape (..., 3); u_z is positive.

    Raises:
        ValueError: u_x² + u_y² is not below 1.
    """
    g = np.asarray(midplane, float)
    rest = 1.0 - g[..., 0] ** 2 - g[..., 1] ** 2
    if np.any(rest <= 0):
        raise ValueError(f"mid-plane normal lies in the base plane: u_x² + u_y² = {1 - np.min(rest):.4g}, below 1")
    return np.stack([g[..., 0], g[..., 1], np.sqrt(rest)], axis=-1)


def normal_derivative(U: Array) -> Array:
    """Derivative of the normal with respect to (u_x, u_y).

    Args:
        U: Unit normal, shape (..., 3).

    Returns:
        dU/du_x and dU/du_y as columns, shape (..., 3, 2).
    """
    D = np.zeros((*U.shape, 2))
    D[..., 0, 0] = D[..., 1, 1] = 1.0
    D[..., 2, 0] = -U[..., 0] / U[..., 2]
    D[..., 2, 1] = -U[..., 1] / U[..., 2]
    return D


def transform(geometry: Geometry, midplane: ArrayLike) -> tuple[Array, Array]:
    """Rotation and origin of frame T in frame B.

    R_BT = (I - 2 U Uᵀ) diag(1, 1, -1) and P_BT = (2 d + Ljo) U: equations 3.52 to 3.54 in closed form.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).

    Returns:
        R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m.
    """
    g = np.asarray(midplane, float)
    U = normal(g)
    R = np.eye(3) - 2 * U[..., :, None] * U[..., None, :]
    R[..., :, 2] *= -1
    return R, (2 * g[..., 2:] + _column(geometry.joint_offset)) * U


def twist(geometry: Geometry, midplane: ArrayLike) -> tuple[Array, Array]:
    """Velocity of frame T per unit rate of each input, in frame B.

    The rotation's rate is [omega]x = dR Rᵀ with omega = 2 U x dU.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).

    Returns:
        Angular velocity and velocity of T's origin, each shape (..., 3, 3), inputs along the last axis.
    """
    g = np.asarray(midplane, float)
    U = normal(g)
    dU = normal_derivative(U)
    angular = np.zeros((*U.shape, 3))
    x, y, z = U[..., 0], U[..., 1], U[..., 2]
    slope_x, slope_y = dU[..., 2, 0], dU[..., 2, 1]
    angular[..., 0, 0], angular[..., 0, 1] = 2 * y * slope_x, 2 * (y * slope_y - z)
    angular[..., 1, 0], angular[..., 1, 1] = 2 * (z - x * slope_x), -2 * x * slope_y
    angular[..., 2, 0], angular[..., 2, 1] = -2 * y, 2 * x
    linear = np.empty((*U.shape, 3))
    linear[..., :2] = (2 * g[..., 2:] + _column(geometry.joint_offset))[..., None] * dU
    linear[..., 2] = 2 * U
    return angular, linear


def _column(value: float | Array) -> Array:
    """A dimension with an axis for coordinates or nodes, shape (..., 1)."""
    return np.asarray(value)[..., None]


def angles(geometry: Geometry, midplane: ArrayLike) -> Array:
    """Canonical angles phi of a mid-plane: where it cuts the circles of the mid nodes, outward branch.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).

    Returns:
        phi_1 to phi_3, shape (..., 3), rad; a quarter turn is an upright longeron triangle, more leans outward.

    Raises:
        AssemblyError: The plane misses a circle; the residual is the distance by which.
    """
    g = np.asarray(midplane, float)
    U = normal(g)
    lean, height = U @ INWARD.T, _column(geometry.height)
    cosine, sine = height * lean, height * U[..., 2:]
    offset = g[..., 2:] + _column(geometry.apothem) * lean
    amplitude = np.hypot(cosine, sine)
    miss = np.max(np.abs(offset) - amplitude)
    if miss > 0:
        raise AssemblyError("double octahedron", float(miss), "the mid-plane misses a longeron circle")
    return np.arctan2(sine, cosine) + np.arccos(offset / amplitude)


def mid_nodes(geometry: Geometry, phi: ArrayLike) -> Array:
    """Nodes n4, n5, n6 from the canonical angles (equation 3.28).

    Args:
        geometry: Fixed dimensions.
        phi: Angles, shape (..., 3), rad.

    Returns:
        Nodes in frame B, shape (..., 3, 3), node by node, m.
    """
    phi = np.asarray(phi, float)
    height = _column(geometry.height)
    nodes = (height * np.cos(phi) - _column(geometry.apothem))[..., None] * INWARD
    nodes[..., 2] = height * np.sin(phi)
    return nodes


def midplane_from_angles(geometry: Geometry, phi: ArrayLike) -> Array:
    """Canonical forward solution: the plane through n4, n5, n6 (equations 3.28, 3.52, 3.53).

    Args:
        geometry: Fixed dimensions.
        phi: Angles, shape (..., 3), rad.

    Returns:
        (u_x, u_y, d), shape (..., 3).
    """
    n = mid_nodes(geometry, phi)
    cross = _area(n)
    U = cross / np.linalg.norm(cross, axis=-1, keepdims=True)
    return np.concatenate([U[..., :2], np.sum(U * n[..., 0, :], axis=-1, keepdims=True)], axis=-1)


def upright(geometry: Geometry, phi: ArrayLike) -> NDArray[np.bool_]:
    """Whether the mid-plane's normal has a positive z component, as (u_x, u_y, d) takes for granted, shape (...)."""
    return _area(mid_nodes(geometry, phi))[..., 2] > 0


def _area(n: Array) -> Array:
    """Normal of the triangle n4 n5 n6, twice its area long, shape (..., 3)."""
    return np.cross(n[..., 1, :] - n[..., 0, :], n[..., 2, :] - n[..., 0, :])


def lengths(geometry: Geometry, midplane: ArrayLike) -> Array:
    """Actuator lengths of a mid-plane.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).

    Returns:
        l1, l2, l3, shape (..., 3), m.

    Raises:
        AssemblyError: The mid-plane misses a longeron circle.
    """
    return actuator_lengths(mid_nodes(geometry, angles(geometry, midplane)))


def actuator_lengths(nodes: Array) -> Array:
    """Distances n4 n5, n5 n6, n6 n4 from the mid nodes, shape (..., 3, 3), m: shape (..., 3), m."""
    return np.linalg.norm(nodes[..., _ACTUATORS[:, 1], :] - nodes[..., _ACTUATORS[:, 0], :], axis=-1)


def mid_node_derivative(geometry: Geometry, midplane: ArrayLike, phi: Array) -> Array:
    """Derivative of n4, n5, n6 with respect to the mid-plane.

    Each phi solves h (U·v cos phi + u_z sin phi) = d - U·c, which is differentiated implicitly.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).
        phi: The angles of that mid-plane, shape (..., 3), rad.

    Returns:
        dn/dg in frame B, shape (..., 3 nodes, 3 coordinates, 3 inputs).
    """
    U = normal(midplane)
    dU = normal_derivative(U)
    tangent = tangents(geometry, phi)
    rate = np.empty((*phi.shape, 3))
    rate[..., :2] = -mid_nodes(geometry, phi) @ dU
    rate[..., 2] = 1.0
    rate /= (tangent @ U[..., None])[..., 0][..., None]
    return tangent[..., None] * rate[..., None, :]


def tangents(geometry: Geometry, phi: Array) -> Array:
    """Derivative of n4, n5, n6 with respect to their angles, shape (..., 3, 3), m."""
    height = _column(geometry.height)
    tangent = (-height * np.sin(phi))[..., None] * INWARD
    tangent[..., 2] = height * np.cos(phi)
    return tangent


def length_jacobian(geometry: Geometry, midplane: ArrayLike, phi: Array | None = None) -> tuple[Array, Array]:
    """Actuator lengths and their derivative with respect to the mid-plane.

    Args:
        geometry: Fixed dimensions.
        midplane: (u_x, u_y, d), shape (..., 3).
        phi: Its angles, shape (..., 3), rad, where they are known.

    Returns:
        Lengths, shape (..., 3), m, and dl/dg, shape (..., 3 lengths, 3 inputs).

    Raises:
        AssemblyError: The mid-plane misses a longeron circle.
    """
    phi = angles(geometry, midplane) if phi is None else phi
    nodes = mid_nodes(geometry, phi)
    dn = mid_node_derivative(geometry, midplane, phi)
    span = nodes[..., _ACTUATORS[:, 1], :] - nodes[..., _ACTUATORS[:, 0], :]
    length = np.linalg.norm(span, axis=-1)
    unit = span / length[..., None]
    relative = dn[..., _ACTUATORS[:, 1], :, :] - dn[..., _ACTUATORS[:, 0], :, :]
    return length, np.einsum("...ik,...ikj->...ij", unit, relative)


def midplane_from_lengths(
    geometry: Geometry, actuators: ArrayLike, start: ArrayLike | None = None, tolerance: float = 1e-13
) -> Array:
    """Conventional forward solution: Newton on the three loop closures (equations 3.32 to 3.33).

    Args:
        geometry: Fixed dimensions.
        actuators: l1, l2, l3, shape (..., 3), m.
        start: Mid-plane to start from, shape (..., 3); absent for the straight module of the mean length.
        tolerance: Greatest closure residual accepted, m.

    Returns:
        (u_x, u_y, d), shape (..., 3).

    Raises:
        AssemblyError: No assembly was found near the start; the residual is what was left.
        SingularPoseError: The start, or what it leads to, is singular.

    Source: equations 3.28 to 3.33. Differs: undamped steps, at most 0.2 rad each, in place of a fixed damping 0.90.
    """
    wanted = np.asarray(actuators, float)
    phi = straight_angles(geometry, wanted) if start is None else angles(geometry, start)
    residual = np.inf
    for _ in range(50):
        nodes = mid_nodes(geometry, phi)
        gap = actuator_lengths(nodes) - wanted
        residual = float(np.max(np.abs(gap), initial=0.0))
        if residual <= tolerance:
            break
        slopes = angle_jacobian(geometry, phi)
        step = -(invert_sound(slopes, float(np.mean(geometry.height)), lambda _: "double octahedron") @ gap[..., None])[
            ..., 0
        ]
        largest = np.max(np.abs(step), axis=-1, keepdims=True)
        phi = phi + step * np.minimum(1.0, 0.2 / np.maximum(largest, 1e-300))
    if not residual <= 1e2 * tolerance:
        raise AssemblyError("double octahedron", residual, f"lengths {np.array2string(wanted, precision=4)} m")
    return midplane_from_angles(geometry, phi)


def straight_angles(geometry: Geometry, actuators: Array) -> Array:
    """Angles of the straight module whose three actuators all have the mean length, shape (..., 3)."""
    reach = np.mean(actuators, axis=-1, keepdims=True) / np.sqrt(3) - _column(geometry.apothem)
    phi = np.arccos(np.clip(-reach / _column(geometry.height), -0.98, 0.98))
    return np.repeat(phi, 3, axis=-1)


def angle_jacobian(geometry: Geometry, phi: Array) -> Array:
    """Derivative of the actuator lengths with respect to phi: the matrix of equation 3.14, shape (..., 3, 3), m/rad."""
    nodes = mid_nodes(geometry, phi)
    tangent = tangents(geometry, phi)
    span = nodes[..., _ACTUATORS[:, 1], :] - nodes[..., _ACTUATORS[:, 0], :]
    unit = span / np.linalg.norm(span, axis=-1, keepdims=True)
    J = np.zeros((*phi.shape, 3))
    for row, (first, second) in enumerate(_ACTUATORS):
        J[..., row, first] = -np.sum(unit[..., row, :] * tangent[..., first, :], axis=-1)
        J[..., row, second] = np.sum(unit[..., row, :] * tangent[..., second, :], axis=-1)
    return J


def inverse_position(geometry: Geometry, position: ArrayLike) -> Array:
    """Closed-form inverse positioning: the mid-plane that puts T's origin at a point (section 3.5.4).

    Args:
        geometry: Fixed dimensions.
        position: Wanted origin of T in frame B, shape (..., 3), m.

    Returns:
        (u_x, u_y, d), shape (..., 3).

    Raises:
        AssemblyError: The point is nearer to the base than the joint offset, or not above the base plane.
    """
    P = np.asarray(position, float)
    distance = np.linalg.norm(P, axis=-1, keepdims=True)
    short = np.max(geometry.joint_offset - distance)
    if short >= 0 or np.any(P[..., 2] <= 0):
        raise AssemblyError("double octahedron", float(max(short, -P[..., 2].min())), "position below the base")
    return np.concatenate([P[..., :2] / distance, (distance - geometry.joint_offset) / 2], axis=-1)


def inverse_gimbal(geometry: Geometry, direction: ArrayLike, extension: ArrayLike) -> Array:
    """Closed-form inverse gimbal: the mid-plane that gives the top face a normal and the module an extension.

    Args:
        geometry: Fixed dimensions.
        direction: Wanted Z axis of T in frame B, shape (..., 3), unit.
        extension: Distance between the origins of B and T, 2 d + Ljo, shape (...), m.

    Returns:
        (u_x, u_y, d), shape (..., 3): U bisects the two face normals.

    Raises:
        AssemblyError: The direction is opposite to the base normal.
    """
    bisector = np.asarray(direction, float) + np.array([0.0, 0.0, 1.0])
    size = np.linalg.norm(bisector, axis=-1, keepdims=True)
    if np.any(size < 1e-9):
        raise AssemblyError("double octahedron", 0.0, "top face turned back on the base: no mid-plane")
    half = (np.asarray(extension, float)[..., None] - geometry.joint_offset) / 2
    return np.concatenate([(bisector / size)[..., :2], np.broadcast_to(half, (*size.shape[:-1], 1))], axis=-1)
