"""The symmetric double octahedron alone: its closed-form inverses and its forward iteration (sections 3.5.3 and 3.5.4).

All else is asked of the package's set of one module. Mid-planes are (u_x, u_y, d), shape (..., 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import angle_jacobian, circle_nodes, edge_lengths
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.modules import ModuleState, mid_plane
from vgtsim.kinematics.modules.double_octahedral import DoubleOctahedra

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MirrorModule:
    """One module.

    Attributes:
        face_side: Side b of the base and top triangles, m.
        longeron: Length of the twelve longerons, m.
        joint_offset: Ljo of equation 3.54, m.
    """

    face_side: float
    longeron: float
    joint_offset: float = 0.0

    @cached_property
    def geometry(self) -> mid_plane.DoubleOctahedronGeometry:
        """Its dimensions, each of shape (1,)."""
        figures = (self.face_side, self.longeron, self.joint_offset)
        return mid_plane.DoubleOctahedronGeometry(*(np.array([float(item)]) for item in figures))

    @cached_property
    def own(self) -> DoubleOctahedra:
        """The set of this module, named m, its straight pose with longerons at 30 degrees to the base's normal."""
        straight = np.array([[0.0, 0.0, float(self.geometry.height[0]) * np.cos(np.pi / 6)]])
        return DoubleOctahedra(("m",), straight, self.geometry)

    @property
    def height(self) -> float:
        """Altitude h of a longeron triangle, m."""
        return float(self.geometry.height[0])

    @property
    def apothem(self) -> float:
        """Distance of the base edges from the centroid, m."""
        return float(self.geometry.apothem[0])


def face_nodes(face_side: float) -> Array:
    """Corners n1, n2, n3 of a face triangle in its own frame, shape (3, 3), m."""
    apothem = face_side / (2 * np.sqrt(3))
    return np.array([[face_side / 2, -apothem, 0.0], [0.0, 2 * apothem, 0.0], [-face_side / 2, -apothem, 0.0]])


def _at(module: MirrorModule, midplane: ArrayLike) -> tuple[ModuleState, tuple[int, ...]]:
    g = np.asarray(midplane, float)
    return module.own.at(g.reshape(-1, 1, 3)), g.shape[:-1]


def _shaped(value: Array, batch: tuple[int, ...]) -> Array:
    return value.reshape(*batch, *value.shape[2:])


def transform(module: MirrorModule, midplane: ArrayLike) -> tuple[Array, Array]:
    """R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m."""
    at, batch = _at(module, midplane)
    R, P = at.frame[..., :3], at.frame[..., 3]
    return _shaped(R, batch), _shaped(P, batch)


def twist(module: MirrorModule, midplane: ArrayLike) -> tuple[Array, Array]:
    """Angular velocity of T and velocity of its origin, each shape (..., 3, 3), inputs along the last axis."""
    at, batch = _at(module, midplane)
    spin, slide = at.motion[..., :3], at.motion[..., 3:]
    return np.swapaxes(_shaped(spin, batch), -1, -2), np.swapaxes(_shaped(slide, batch), -1, -2)


def length_jacobian(module: MirrorModule, midplane: ArrayLike) -> tuple[Array, Array]:
    """Actuator lengths, shape (..., 3), m, and dl/dg, shape (..., 3 lengths, 3 inputs)."""
    at, batch = _at(module, midplane)
    length, block = at.legs
    return _shaped(length, batch), _shaped(block, batch)


def lengths(module: MirrorModule, midplane: ArrayLike) -> Array:
    """Actuator lengths l1, l2, l3, shape (..., 3), m."""
    return length_jacobian(module, midplane)[0]


def inner(module: MirrorModule, midplane: ArrayLike) -> tuple[Array, Array]:
    """Inner nodes, shape (..., k, 3), m, and their derivatives, shape (..., k, 3, 3)."""
    at, batch = _at(module, midplane)
    return _shaped(at.inner, batch), _shaped(at.inner_slope, batch)


def angles(module: MirrorModule, midplane: ArrayLike) -> Array:
    """Canonical angles phi, shape (..., 3), rad.

    Raises:
        AssemblyError: The mid-plane misses a longeron circle.
    """
    g = np.asarray(midplane, float)
    return module.own.angles(g[..., None, :])[..., 0, :]


def midplane_from_angles(module: MirrorModule, phi: ArrayLike) -> Array:
    """Canonical forward solution (equations 3.28, 3.52, 3.53), shape (..., 3), of angles, shape (..., 3), rad."""
    return mid_plane.midplane_from_angles(module.geometry, np.asarray(phi, float)[..., None, :])[..., 0, :]


def midplane_from_lengths(
    module: MirrorModule, actuators: ArrayLike, start: ArrayLike | None = None, tolerance: float = 1e-13
) -> Array:
    """Conventional forward solution: Newton on the three loop closures (equations 3.32 to 3.33).

    Args:
        module: The module.
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
    geometry, wanted = module.geometry, np.asarray(actuators, float)[..., None, :]
    phi = mid_plane.straight_angles(geometry, wanted) if start is None else angles(module, start)[..., None, :]
    residual = np.inf
    for _ in range(50):
        gap = edge_lengths(circle_nodes(geometry.circles, phi)) - wanted
        residual = float(np.max(np.abs(gap), initial=0.0))
        if residual <= tolerance:
            break
        slopes = angle_jacobian(geometry.circles, phi)
        step = -(invert_sound(slopes, module.height, lambda _: "double octahedron") @ gap[..., None])[..., 0]
        largest = np.max(np.abs(step), axis=-1, keepdims=True)
        phi = phi + step * np.minimum(1.0, 0.2 / np.maximum(largest, 1e-300))
    if not residual <= 1e2 * tolerance:
        raise AssemblyError("double octahedron", residual, f"lengths {np.array2string(wanted, precision=4)} m")
    return mid_plane.midplane_from_angles(geometry, phi)[..., 0, :]


def inverse_position(module: MirrorModule, position: ArrayLike) -> Array:
    """Closed-form inverse positioning: the mid-plane that puts T's origin at a point (section 3.5.4).

    Args:
        module: The module.
        position: Wanted origin of T in frame B, shape (..., 3), m.

    Returns:
        (u_x, u_y, d), shape (..., 3).

    Raises:
        AssemblyError: The point is nearer to the base than the joint offset, or not above the base plane.
    """
    P = np.asarray(position, float)
    distance = np.linalg.norm(P, axis=-1, keepdims=True)
    short = np.max(module.joint_offset - distance)
    if short >= 0 or np.any(P[..., 2] <= 0):
        raise AssemblyError("double octahedron", float(max(short, -P[..., 2].min())), "position below the base")
    return np.concatenate([P[..., :2] / distance, (distance - module.joint_offset) / 2], axis=-1)


def inverse_gimbal(module: MirrorModule, direction: ArrayLike, extension: ArrayLike) -> Array:
    """Closed-form inverse gimbal: the mid-plane that gives the top face a normal and the module an extension.

    Args:
        module: The module.
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
    half = (np.asarray(extension, float)[..., None] - module.joint_offset) / 2
    return np.concatenate([(bisector / size)[..., :2], np.broadcast_to(half, (*size.shape[:-1], 1))], axis=-1)
