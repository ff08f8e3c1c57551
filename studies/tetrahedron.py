"""The tetrahedral module alone: both branches of its forward solution, its nodes, its rates by length (section 3.3).

All else is asked of the package's set of one module. The hinge angle theta has shape (...), rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics.modules import ModuleState
from vgtsim.kinematics.modules.tetrahedral import Hinges

Array = NDArray[np.float64]
Branch = Literal[1, -1]

_FLAT = 1e-9  # m/rad over the altitude: dl/dtheta this small is that of a flat pose


@dataclass(frozen=True)
class HingeModule:
    """One module.

    Attributes:
        side: L1, of the four equal static members, m.
        hinge: L2, of the hinge line n2 n3, m.
    """

    side: float
    hinge: float

    def __post_init__(self) -> None:
        """Refuse sides that do not make a triangle."""
        _ = self.own

    @property
    def own(self) -> Hinges:
        """The set of this module."""
        return Hinges(("tetrahedron",), np.ones((1, 1)), np.array([[self.side, self.hinge]]))

    @property
    def height(self) -> float:
        """Altitude h of the static triangles, m (3.1)."""
        return float(self.own.height[0])

    @property
    def face(self) -> Array:
        """Sides of both faces in the order of `triangle`: apex between the first and the second, shape (3,), m."""
        return np.array([self.side, self.side, self.hinge])


def _at(module: HingeModule, theta: ArrayLike) -> tuple[ModuleState, tuple[int, ...]]:
    angle = np.asarray(theta, float)
    return module.own.at(angle.reshape(-1, 1, 1)), angle.shape


def forward(module: HingeModule, length: ArrayLike, branch: Branch = 1) -> Array:
    """Hinge angle of an actuator length on one of two branches: +1 the working one, -1 its mirror image in the base.

    Raises:
        AssemblyError: l is negative or longer than 2 h; the residual is by how much.

    Source: equation 3.2. Differs: as twice an arcsine, which is exact near theta = 0.
    """
    wanted = np.asarray(length, float)
    excess = np.maximum(wanted - 2 * module.height, -wanted)
    if np.any(~(excess <= 0)):
        worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
        detail = f"actuator of {wanted[worst]:.6g} m, between 0 and 2 h = {2 * module.height:.6g} m"
        raise AssemblyError("tetrahedron", float(excess[worst]), detail)
    return branch * 2 * np.arcsin(wanted / (2 * module.height))


def inverse(module: HingeModule, theta: ArrayLike) -> Array:
    """Actuator length of a hinge angle, shape (...), m (3.3)."""
    at, batch = _at(module, theta)
    return at.legs[0].reshape(batch)


def length_derivative(module: HingeModule, theta: ArrayLike) -> Array:
    """dl/dtheta, shape (...), m/rad; zero where it lies flat with l = 2 h.

    Raises:
        AssemblyError: theta is 0: the two apexes coincide and l has no derivative.
    """
    at, batch = _at(module, theta)
    if not at.kept.all():
        raise module.own.refuse(at.x)
    return at.legs[1].reshape(batch)


def transform(module: HingeModule, theta: ArrayLike) -> tuple[Array, Array]:
    """R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m (3.4)."""
    at, batch = _at(module, theta)
    R, P = at.frame[..., :3], at.frame[..., 3]
    return R.reshape(*batch, 3, 3), P.reshape(*batch, 3)


def twist(module: HingeModule, theta: ArrayLike) -> tuple[Array, Array]:
    """Angular velocity of T and velocity of its origin per rate of theta, each shape (..., 3, 1)."""
    at, batch = _at(module, theta)
    spin, slide = at.motion[..., :3], at.motion[..., 3:]
    return spin.reshape(*batch, 3, 1), slide.reshape(*batch, 3, 1)


def twist_per_length(module: HingeModule, theta: ArrayLike) -> tuple[Array, Array]:
    """The same per rate of the actuator length, by the chain rule.

    Raises:
        AssemblyError: The module lies flat, theta = 0 or pi: its singular poses.
    """
    slope = length_derivative(module, theta)
    if np.any(np.abs(slope) < _FLAT * module.height):
        least = f"smallest singular value {np.min(np.abs(slope)):.2g} m/rad"
        raise AssemblyError("tetrahedron", 0.0, f"flat at l = 2 h: {least}")
    angular, linear = twist(module, theta)
    return angular / slope[..., None, None], linear / slope[..., None, None]


def nodes(module: HingeModule, theta: ArrayLike) -> Array:
    """n1, n2, n3, n4 in frame B, shape (..., 4, 3), m."""
    h, angle = module.height, np.asarray(theta, float)
    result = np.zeros((*angle.shape, 4, 3))
    result[..., 0, 1] = 2 * h / 3
    result[..., 1, :] = [module.hinge / 2, -h / 3, 0.0]
    result[..., 2, :] = [-module.hinge / 2, -h / 3, 0.0]
    result[..., 3, 1], result[..., 3, 2] = h * np.cos(angle) - h / 3, h * np.sin(angle)
    return result
