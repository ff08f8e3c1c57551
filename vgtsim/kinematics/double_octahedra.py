"""The double-octahedral modules of a chain, see `module_sets`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics.mode_following import follow, worst_direction
from vgtsim.kinematics.module_sets import all_legs, find_short
from vgtsim.kinematics.octahedral_closure import Circles, closure_coefficients

Array = NDArray[np.float64]

# given as the fraction covered when lengths were reached with the mid-plane turned over, or past a mid node's circle
_TURNED = 0.999


@dataclass(frozen=True)
class DoubleOctahedra:
    """Symmetric double-octahedral modules; inputs are mid-planes (u_x, u_y, d), legs the three actuators.

    Attributes:
        names: Of the modules.
        geometry: With figures of shape (M,); all of them or none have a joint offset.
    """

    names: tuple[str, ...]
    geometry: double.Geometry
    inputs = 3

    @property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if self._offset else 3

    @cached_property
    def _offset(self) -> bool:
        return bool(np.any(np.asarray(self.geometry.joint_offset) > 0))

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """All of them."""
        return all_legs(self.names, 3)

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
                    double.angles(self.one(place), x[..., place, :])
                except AssemblyError as own:
                    raise AssemblyError(name, own.residual, "mid-plane too far") from None
            raise error from None

    def one(self, place: int) -> double.Geometry:
        """Dimensions of one module."""
        side, longeron, offset = self.geometry.face_side, self.geometry.longeron, self.geometry.joint_offset
        return double.Geometry(*(float(np.asarray(item)[place]) for item in (side, longeron, offset)))

    def inner(self, x: Array) -> Array:
        """Mid nodes n4, n5, n6; with a joint offset the blocks' feet n4 to n6, middles, and heads n4' to n6'."""
        feet = double.mid_nodes(self.geometry, self.angles(x))
        if not self._offset:
            return feet
        rise = np.asarray(self.geometry.joint_offset)[:, None, None] * double.normal(x)[..., None, :]
        return np.concatenate([feet, feet + rise / 2, feet + rise], axis=-2)

    def inner_derivative(self, x: Array) -> Array:
        """As `double_octahedron.mid_node_derivative`, for all inner nodes."""
        feet = double.mid_node_derivative(self.geometry, x, self.angles(x))
        if not self._offset:
            return feet
        rise = np.zeros((*x.shape[:-1], 1, 3, 3))
        rise[..., 0, :, :2] = double.normal_derivative(double.normal(x))
        rise *= np.asarray(self.geometry.joint_offset)[:, None, None, None]
        return np.concatenate([feet, feet + rise / 2, feet + rise], axis=-3)

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
        sound = np.all(outward, axis=-1) & double.upright(self.geometry, phi)
        return x, np.where(sound, reached, np.minimum(reached, _TURNED))

    def _follow(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Angles, shape (..., M, 3), rad, and the fraction of the way covered, shape (..., M)."""
        begin = double.straight_angles(self.geometry, lengths) if start is None else self.angles(start)
        begin = np.broadcast_to(begin, lengths.shape)
        first = double.actuator_lengths(double.mid_nodes(self.geometry, begin))
        C = cell_closure(self.geometry, first).reshape(5, 3, -1)
        change = (first**2 - lengths**2).reshape(-1, 3).T

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
        worst = find_short(reached)
        if worst is not None:
            geometry, name = self.one(worst[-1]), self.names[worst[-1]]
            phi = self._follow(lengths, start)[0][worst]
            value, row = worst_direction(double.angle_jacobian(geometry, phi) / geometry.height)
            gap = np.abs(double.actuator_lengths(double.mid_nodes(geometry, phi)) - lengths[worst]).max()
            raise SingularityError(name, value, f"{name}/actuator/{row + 1}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the altitude of the longeron triangles."""
        phi = self.angles(x)
        return double.angle_jacobian(self.geometry, phi) / self.geometry.height[..., None, None]


def cell_closure(geometry: double.Geometry, actuators: Array) -> Array:
    """Closure of the cell below the mid-plane, see `octahedral_closure`.

    Args:
        geometry: Fixed dimensions.
        actuators: l1, l2, l3, shape (..., 3), m.

    Returns:
        C, shape (5, 3, ...), m².
    """
    shape = actuators.shape[:-1]
    apothem, height = (np.broadcast_to(item, shape) for item in (geometry.apothem, geometry.height))
    centre, inward = -apothem[..., None, None] * double.INWARD, np.broadcast_to(double.INWARD, (*shape, 3, 3))
    return closure_coefficients(Circles(centre, inward, np.repeat(height[..., None], 3, axis=-1)), actuators)
