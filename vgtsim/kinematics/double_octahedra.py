"""The double-octahedral modules of a chain, see `module_sets`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics.mode_following import follow, worst_direction
from vgtsim.kinematics.octahedral_closure import Circles, closure_coefficients

Array = NDArray[np.float64]

# given as the fraction covered when lengths were reached with a mid node on the wrong side of its circle
_TURNED = 0.999


@dataclass(frozen=True)
class DoubleOctahedra:
    """Symmetric double-octahedral modules; inputs are mid-planes (u_x, u_y, d), legs the three actuators.

    Attributes:
        names: Of the modules.
        geometry: With figures of shape (M,).
    """

    names: tuple[str, ...]
    geometry: double.Geometry
    inputs = 3
    inner_count = 3

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """All of them."""
        return np.ones((len(self.names), 3), dtype=bool)

    def transform(self, x: Array) -> tuple[Array, Array]:
        """As `double_octahedron.transform`."""
        return double.transform(self.geometry, x)

    def twist(self, x: Array) -> tuple[Array, Array]:
        """As `double_octahedron.twist`."""
        return double.twist(self.geometry, x)

    def angles(self, x: Array) -> Array:
        """Angles phi of the mid nodes, shape (..., M, 3), rad.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        try:
            return double.angles(self.geometry, x)
        except AssemblyError as error:
            for place, name in enumerate(self.names):
                try:
                    double.angles(self._one(place), x[..., place, :])
                except AssemblyError as own:
                    raise AssemblyError(name, own.residual, "mid-plane too far") from None
            raise error from None

    def _one(self, place: int) -> double.Geometry:
        side, longeron, offset = self.geometry.face_side, self.geometry.longeron, self.geometry.joint_offset
        return double.Geometry(*(float(np.asarray(item)[place]) for item in (side, longeron, offset)))

    def inner(self, x: Array) -> Array:
        """Mid nodes n4, n5, n6."""
        return double.mid_nodes(self.geometry, self.angles(x))

    def inner_derivative(self, x: Array) -> Array:
        """As `double_octahedron.mid_node_derivative`."""
        return double.mid_node_derivative(self.geometry, x, self.angles(x))

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """As `double_octahedron.length_jacobian`."""
        return double.length_jacobian(self.geometry, x, self.angles(x))

    def legs(self, x: Array) -> tuple[Array, Array]:
        """As `length_jacobian`: there are no static legs."""
        return self.length_jacobian(x)

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Conventional forward solution, each step proved to stay on the mode of the start.

        Args:
            lengths: Shape (..., M, 3), m.
            start: Shape (..., M, 3); absent for the straight modules with three equal actuators of the mean length.

        Returns:
            Mid-planes, shape (..., M, 3), and the fraction of the way covered, shape (..., M).
        """
        phi, reached = self._follow(lengths, start)
        x = double.midplane_from_angles(self.geometry, phi)
        outward = np.sum(double.tangents(self.geometry, phi) * double.normal(x)[..., None, :], axis=-1) < 0
        return x, np.where(np.all(outward, axis=-1), reached, np.minimum(reached, _TURNED))

    def _follow(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Angles, shape (..., M, 3), rad, and the fraction of the way covered, shape (..., M)."""
        begin = double.straight_angles(self.geometry, lengths) if start is None else self.angles(start)
        begin = np.broadcast_to(begin, lengths.shape)
        apothem, radius = (
            np.broadcast_to(item, lengths.shape[:-1]).ravel() for item in (self.geometry.apothem, self.geometry.height)
        )
        circles = Circles(
            -apothem[:, None, None] * double.INWARD,
            np.broadcast_to(double.INWARD, (len(apothem), 3, 3)),
            np.repeat(radius[:, None], 3, axis=1),
        )
        first = double.actuator_lengths(double.mid_nodes(self.geometry, begin)).reshape(-1, 3)
        C, change = closure_coefficients(circles, first), (first**2 - lengths.reshape(-1, 3) ** 2).T

        def path(t: Array, index: NDArray[np.intp]) -> Array:
            now = C[..., index]
            now[0] += t * change[:, index]
            return now

        result = follow(path, begin.reshape(-1, 3))
        return result.phi.reshape(lengths.shape), result.reached.reshape(lengths.shape[:-1])

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Args:
            lengths: Shape (..., M, 3), m.
            start: Shape (..., M, 3), or absent.

        Returns:
            Mid-planes, shape (..., M, 3).

        Raises:
            AssemblyError: Three actuators do not make a triangle; the module is named.
            SingularityError: A singularity lies between.
        """
        excess = 2 * np.max(lengths, axis=-1) - np.sum(lengths, axis=-1)
        if np.any(~(excess < 0)):
            worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
            detail = f"actuators of {np.array2string(lengths[worst], precision=4)} m make no triangle"
            raise AssemblyError(self.names[worst[-1]], float(excess[worst]), detail)
        x, reached = self.attempt(lengths, start)
        if reached.min(initial=1.0) < 1.0:
            worst = np.unravel_index(int(np.argmin(reached)), reached.shape)
            geometry, name = self._one(int(worst[-1])), self.names[worst[-1]]
            phi = self._follow(lengths, start)[0][worst]
            value, row = worst_direction(double.angle_jacobian(geometry, phi) / geometry.height)
            gap = np.abs(double.actuator_lengths(double.mid_nodes(geometry, phi)) - lengths[worst]).max()
            raise SingularityError(name, value, f"{name}/actuator/{row + 1}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the altitude of the longeron triangles."""
        phi = self.angles(x)
        return double.angle_jacobian(self.geometry, phi) / self.geometry.height[..., None, None]
