"""The tetrahedral modules of a chain, see `module_sets`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import SingularityError
from vgtsim.kinematics import tetrahedron as tetra
from vgtsim.kinematics.module_sets import all_legs, find_short, no_inner

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tetrahedra:
    """Tetrahedral modules; the input is the hinge angle theta, the leg the actuator.

    Attributes:
        names: Of the modules.
        geometry: With figures of shape (M,).
    """

    names: tuple[str, ...]
    geometry: tetra.Geometry
    inputs = 1
    inner_count = 0

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """All of them."""
        return all_legs(self.names, 1)

    def transform(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.transform`."""
        return tetra.transform(self.geometry, x[..., 0])

    def twist(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.twist`."""
        return tetra.twist(self.geometry, x[..., 0])

    def inner(self, x: Array) -> Array:
        """None."""
        return no_inner(x)[0]

    def inner_derivative(self, x: Array) -> Array:
        """None."""
        return no_inner(x)[1]

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.inverse` and `length_derivative`."""
        theta = x[..., 0]
        slope = tetra.length_derivative(self.geometry, theta)
        return tetra.inverse(self.geometry, theta)[..., None], slope[..., None, None]

    def legs(self, x: Array) -> tuple[Array, Array]:
        """As `length_jacobian`: there are no static legs."""
        return self.length_jacobian(x)

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Closed form, on the side of the flat pose on which the start is.

        Args:
            lengths: Shape (..., M, 1), m.
            start: Shape (..., M, 1), rad; absent for the working branch.

        Returns:
            Hinge angles, shape (..., M, 1), rad, and one where the length is below the flat pose's, shape (..., M).
        """
        ratio = lengths / (2 * self.geometry.height[:, None])
        theta = 2 * np.arcsin(np.clip(ratio, 0.0, 1.0))
        if start is not None:
            theta = np.where(start > np.pi, 2 * np.pi - theta, np.where(start < 0, -theta, theta))
        return theta, np.where((ratio > 0) & (ratio < 1), 1.0, 0.0)[..., 0]

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Args:
            lengths: Shape (..., M, 1), m.
            start: Shape (..., M, 1), rad, or absent.

        Returns:
            Hinge angles, shape (..., M, 1), rad.

        Raises:
            SingularityError: A length at or beyond the flat pose, or none; the module is named.
        """
        theta, reached = self.attempt(lengths, start)
        worst = find_short(reached)
        if worst is not None:
            name, longest = self.names[worst[-1]], 2 * float(self.geometry.height[worst[-1]])
            gap = abs(float(lengths[worst][0]) - longest)
            raise SingularityError(name, 0.0, f"{name}/actuator/1", gap, min(1.0, longest / float(lengths[worst][0])))
        return theta

    def conditioned(self, x: Array) -> Array:
        """dl/dtheta over the altitude: the cosine of half the hinge angle."""
        return self.length_jacobian(x)[1] / self.geometry.height[..., None, None]
