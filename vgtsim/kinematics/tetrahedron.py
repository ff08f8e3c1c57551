"""The tetrahedral module: a hinge between two static triangles (section 3.3).

Nodes n1 and n4 are the apexes of two isosceles triangles on the common hinge line n2 n3 of length L2; their
sides are L1, and the actuator l joins n1 and n4. Frame B sits at the centroid of n1 n2 n3 and frame T at that
of n4 n2 n3, X along n2 - n3, Y towards the apex, Z by the right-hand rule. In the order of `triangle` the
corners of the base are n2, n1, n3 and those of the top n2, n4, n3.

theta turns the top about X. With 0 < theta < pi the module lies on +Z of B and on -Z of T, so faces mate with
their neighbours'; this is the working branch. At theta = 0 the top lies on the base and n4 on n1; at pi it
lies flat beside it, the length l = 2 h is the longest, and dtheta/dl is infinite: the two branches +theta and
-theta meet at these two flat poses.
Differs: the text attaches T to n1 n2 n4, a face that contains the actuator; equation 3.4 is right for n2 n3
n4.

Arrays carry any leading batch dimensions, written `...`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError

Array = NDArray[np.float64]
Branch = Literal[1, -1]

_FLAT = 1e-9  # rad: theta this near to 0 or pi is flat


@dataclass(frozen=True)
class Geometry:
    """Fixed dimensions of a module, or of several, each figure then of shape (M,), for angles of shape (..., M).

    Attributes:
        side: L1, of the four equal static members, m.
        hinge: L2, of the hinge line n2 n3, m.
    """

    side: float | Array
    hinge: float | Array

    def __post_init__(self) -> None:
        """Refuse sides that do not make a triangle."""
        side, hinge = np.asarray(self.side), np.asarray(self.hinge)
        if not np.all((hinge > 0) & (hinge < 2 * side)):
            detail = f"static triangles with sides {side} m on a hinge of {hinge} m are flat"
            raise AssemblyError("tetrahedron", float(np.max(hinge - 2 * side)), detail)

    @property
    def height(self) -> Array:
        """Altitude h of the static triangles, m (3.1)."""
        return np.sqrt(np.asarray(self.side) ** 2 - np.asarray(self.hinge) ** 2 / 4)

    @property
    def face(self) -> Array:
        """Sides of both faces in the order of `triangle`: apex between the first and the second, shape (..., 3), m."""
        return np.stack([self.side, self.side, self.hinge], axis=-1)


def forward(geometry: Geometry, length: ArrayLike, branch: Branch = 1) -> Array:
    """Hinge angle of an actuator length.

    Args:
        geometry: Fixed dimensions.
        length: l, shape (...), m.
        branch: Which of the two solutions: +1 the working one, -1 its mirror image in the base plane.

    Returns:
        theta, shape (...), rad.

    Raises:
        AssemblyError: l is negative or longer than 2 h; the residual is by how much.

    Source: equation 3.2. Differs: as twice an arcsine, which is exact near theta = 0.
    """
    wanted = np.asarray(length, float)
    excess = np.maximum(wanted - 2 * geometry.height, -wanted)
    if np.any(~(excess <= 0)):
        worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
        detail = f"actuator of {wanted[worst]:.6g} m, between 0 and 2 h = {2 * geometry.height:.6g} m"
        raise AssemblyError("tetrahedron", float(excess[worst]), detail)
    return branch * 2 * np.arcsin(wanted / (2 * geometry.height))


def inverse(geometry: Geometry, theta: ArrayLike) -> Array:
    """Actuator length of a hinge angle.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        l, shape (...), m.

    Source: equation 3.3. Differs: as a sine of the half angle, which is exact near theta = 0.
    """
    return 2 * geometry.height * np.abs(np.sin(np.asarray(theta, float) / 2))


def transform(geometry: Geometry, theta: ArrayLike) -> tuple[Array, Array]:
    """Rotation and origin of frame T in frame B.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m.

    Source: equation 3.4.
    """
    angle = np.asarray(theta, float)
    cosine, sine = np.cos(angle), np.sin(angle)
    R = np.zeros((*angle.shape, 3, 3))
    R[..., 0, 0] = 1.0
    R[..., 1, 1], R[..., 1, 2], R[..., 2, 1], R[..., 2, 2] = cosine, -sine, sine, cosine
    third = geometry.height / 3
    return R, np.stack([np.zeros_like(angle), -third * (1 - cosine), third * sine], axis=-1)


def nodes(geometry: Geometry, theta: ArrayLike) -> Array:
    """All four nodes.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        n1, n2, n3, n4 in frame B, shape (..., 4, 3), m.
    """
    h, angle = geometry.height, np.asarray(theta, float)
    result = np.zeros((*angle.shape, 4, 3))
    result[..., 0, 1] = 2 * h / 3
    result[..., 1, :] = [geometry.hinge / 2, -h / 3, 0.0]
    result[..., 2, :] = [-geometry.hinge / 2, -h / 3, 0.0]
    result[..., 3, 1], result[..., 3, 2] = h * np.cos(angle) - h / 3, h * np.sin(angle)
    return result


def twist(geometry: Geometry, theta: ArrayLike) -> tuple[Array, Array]:
    """Motion of frame T per unit rate of the hinge angle, the canonical input.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        Angular velocity of T and velocity of its origin in frame B, each shape (..., 3, 1), inputs along the
        last axis.
    """
    angle = np.asarray(theta, float)
    third = geometry.height / 3
    angular = np.zeros((*angle.shape, 3, 1))
    angular[..., 0, 0] = 1.0
    linear = np.stack([np.zeros_like(angle), -third * np.sin(angle), third * np.cos(angle)], axis=-1)
    return angular, linear[..., None]


def length_derivative(geometry: Geometry, theta: ArrayLike) -> Array:
    """dl/dtheta; motions per unit rate of l are those of `twist` divided by it.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        Shape (...), m/rad; zero, the module's singular value, where it lies flat with l = 2 h.

    Raises:
        AssemblyError: theta is 0: the two apexes coincide and l has no derivative.
    """
    angle = np.asarray(theta, float)
    sine = np.sin(angle / 2)
    if np.any(np.abs(sine) < _FLAT):
        raise AssemblyError("tetrahedron", 0.0, "folded flat: n4 lies on n1")
    return geometry.height * np.cos(angle / 2) * np.sign(sine)


def twist_per_length(geometry: Geometry, theta: ArrayLike) -> tuple[Array, Array]:
    """Motion of frame T per unit rate of the actuator length, by the chain rule.

    Args:
        geometry: Fixed dimensions.
        theta: Shape (...), rad.

    Returns:
        Angular velocity of T and velocity of its origin in frame B, each shape (..., 3, 1).

    Raises:
        AssemblyError: The module lies flat, theta = 0 or pi: its singular poses.
    """
    slope = length_derivative(geometry, theta)
    if np.any(np.abs(slope) < _FLAT * geometry.height):
        raise AssemblyError(
            "tetrahedron", 0.0, f"flat at l = 2 h: smallest singular value {np.min(np.abs(slope)):.2g} m/rad"
        )
    angular, linear = twist(geometry, theta)
    return angular / slope[..., None, None], linear / slope[..., None, None]
