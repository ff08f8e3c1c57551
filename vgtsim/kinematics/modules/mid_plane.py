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
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Mask
from vgtsim.kinematics.closure import Circles, circle_nodes

# v_i: from the middle of the base edge that carries n4, n5, n6 towards the centroid (3.8)
INWARD = np.array([[0.0, 1.0, 0.0], [-np.sqrt(0.75), -0.5, 0.0], [np.sqrt(0.75), -0.5, 0.0]])


@dataclass(frozen=True)
class DoubleOctahedronGeometry:
    """Fixed dimensions of M modules, for mid-planes and angles of shape (..., M, 3).

    Attributes:
        face_side: Side b of the base and top triangles, shape (M,), m.
        longeron: Length of the twelve longerons, shape (M,), m.
        joint_offset: Ljo of equation 3.54, shape (M,), m.
    """

    face_side: Array
    longeron: Array
    joint_offset: Array

    @cached_property
    def height(self) -> Array:
        """Altitude of a longeron triangle on its base edge, shape (M,), m: h of equation 3.7."""
        return np.sqrt(self.longeron**2 - self.face_side**2 / 4)

    @cached_property
    def apothem(self) -> Array:
        """Distance of the base edges from the centroid, shape (M,), m."""
        return self.face_side / (2 * np.sqrt(3))

    @cached_property
    def circles(self) -> Circles:
        """Circles of n4, n5, n6 in frame B, see `closure` (3.28)."""
        inward = np.broadcast_to(INWARD, (len(self.height), 3, 3))
        return Circles(-self.apothem[:, None, None] * INWARD, inward, np.repeat(self.height[:, None], 3, axis=-1))

    def __getitem__(self, which: slice) -> DoubleOctahedronGeometry:
        return DoubleOctahedronGeometry(self.face_side[which], self.longeron[which], self.joint_offset[which])


def normal(midplane: ArrayLike) -> Array:
    """Unit normal U of mid-planes, shape (..., 3), in B, u_z positive; a ValueError where u_x² + u_y² is not below 1."""
    g = np.asarray(midplane, float)
    rest = 1.0 - g[..., 0] ** 2 - g[..., 1] ** 2
    if np.any(rest <= 0):
        raise ValueError(f"mid-plane normal lies in the base plane: u_x² + u_y² = {1 - np.min(rest):.4g}, below 1")
    return np.stack([g[..., 0], g[..., 1], np.sqrt(rest)], axis=-1)


def find_misses(geometry: DoubleOctahedronGeometry, midplane: Array) -> Array:
    """Greatest distance, (..., M), m, by which mid-planes, (..., M, 3), miss a longeron circle; negative where they meet all."""
    U = normal(midplane)
    lean = U @ INWARD.T
    offset = midplane[..., 2:] + geometry.apothem[..., None] * lean
    return np.max(np.abs(offset) - geometry.height[..., None] * np.hypot(lean, U[..., 2:]), axis=-1)


def angles(geometry: DoubleOctahedronGeometry, midplane: Array) -> Array:
    """Canonical angles phi, shape (..., M, 3), rad, of mid-planes that meet the circles of the mid nodes, outward branch.

    A quarter turn is an upright longeron triangle, more leans outward.
    """
    U = normal(midplane)
    lean, height = U @ INWARD.T, geometry.height[..., None]
    cosine, sine = height * lean, height * U[..., 2:]
    offset = midplane[..., 2:] + geometry.apothem[..., None] * lean
    return np.arctan2(sine, cosine) + np.arccos(offset / np.hypot(cosine, sine))


def midplane_from_angles(geometry: DoubleOctahedronGeometry, phi: ArrayLike) -> Array:
    """Canonical forward solution: the plane (u_x, u_y, d) through n4, n5, n6, of angles phi (3.28, 3.52, 3.53)."""
    n = circle_nodes(geometry.circles, phi)
    cross = _area(n)
    U = cross / np.linalg.norm(cross, axis=-1, keepdims=True)
    return np.concatenate([U[..., :2], np.sum(U * n[..., 0, :], axis=-1, keepdims=True)], axis=-1)


def upright(geometry: DoubleOctahedronGeometry, phi: ArrayLike) -> Mask:
    """Whether the mid-plane's normal has a positive z component, as (u_x, u_y, d) takes for granted, shape (...)."""
    return _area(circle_nodes(geometry.circles, phi))[..., 2] > 0


def _area(n: Array) -> Array:
    """Normal of the triangle n4 n5 n6, twice its area long, shape (..., 3)."""
    return np.cross(n[..., 1, :] - n[..., 0, :], n[..., 2, :] - n[..., 0, :])


def straight_angles(geometry: DoubleOctahedronGeometry, actuators: Array) -> Array:
    """Angles of the straight module whose three actuators all have the mean length, shape (..., 3)."""
    reach = np.mean(actuators, axis=-1, keepdims=True) / np.sqrt(3) - geometry.apothem[..., None]
    # 0.98: lengths beyond what a straight module has begin beside the flat pose at one, where the way would end at once
    phi = np.arccos(np.clip(-reach / geometry.height[..., None], -0.98, 0.98))
    return np.repeat(phi, 3, axis=-1)
