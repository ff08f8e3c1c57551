"""All active modules of one kind in a chain, solved together.

A set has M modules with the same number of inputs (canonical, see the module's own file) and of legs (the members whose
lengths can change). Inputs are x, shape (..., M, inputs); leading dimensions are batches. All methods are in the frames
B of the modules.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics import octahedron as single
from vgtsim.kinematics import tetrahedron as tetra
from vgtsim.kinematics.mode_following import follow, worst_direction
from vgtsim.kinematics.octahedral_closure import Circles, closure_coefficients
from vgtsim.kinematics.roll_pitch_yaw import pose_parameters, pose_transform, pose_twist

Array = NDArray[np.float64]

_TURNED = (
    0.999  # given as the fraction covered when lengths were reached with a mid node on the wrong side of its circle
)


class ModuleSet(Protocol):
    """What a chain asks of a set.

    Attributes:
        names: Of the modules.
        inputs: Number of canonical inputs of a module.
        actuated: Which legs are actuators, shape (M, legs).
        inner_count: Number of nodes of a module that are on neither face.
    """

    names: tuple[str, ...]
    inputs: int
    inner_count: int

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """Which legs are actuators, shape (M, legs)."""
        ...

    def transform(self, x: Array) -> tuple[Array, Array]:
        """R_BT, shape (..., M, 3, 3), and P_BT, shape (..., M, 3), m."""
        ...

    def twist(self, x: Array) -> tuple[Array, Array]:
        """Angular velocity of T and velocity of its origin per unit rate, each shape (..., M, 3, inputs)."""
        ...

    def inner(self, x: Array) -> Array:
        """Inner nodes, shape (..., M, inner_count, 3), m."""
        ...

    def inner_derivative(self, x: Array) -> Array:
        """Their derivatives, shape (..., M, inner_count, 3, inputs)."""
        ...

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """Leg lengths, shape (..., M, legs), m, and dl/dx, shape (..., M, legs, inputs)."""
        ...

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Follow leg lengths, shape (..., M, legs), from a start, shape (..., M, inputs), on its assembly mode.

        Without a start, from the module's own straight pose. Returns inputs, and the fraction of the way covered, shape
        (..., M): one where the lengths were reached.
        """
        ...

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: Lengths that no pose can have; the module is named.
            SingularityError: A singularity lies between.
        """
        ...

    def conditioned(self, x: Array) -> Array:
        """Derivative of the legs' lengths in units that make it a pure number, shape (..., M, legs, legs)."""
        ...


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

    @cached_property
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


@dataclass(frozen=True)
class Octahedra:
    """Longeron-actuated octahedral modules; inputs are poses (x, y, z, roll, pitch, yaw), legs the six longerons.

    Attributes:
        names: Of the modules.
        geometries: One each.
    """

    names: tuple[str, ...]
    geometries: tuple[single.Geometry, ...]
    inputs = 6
    inner_count = 0

    @cached_property
    def actuated(self) -> NDArray[np.bool_]:
        """Longerons with a cylinder."""
        return np.array([[length is None for length in geometry.static] for geometry in self.geometries])

    @cached_property
    def _static(self) -> Array:
        """Lengths of the static longerons, not a number for the actuated ones, shape (M, 6), m."""
        return np.array(
            [[np.nan if item is None else item for item in geometry.static] for geometry in self.geometries]
        )

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Lower ends in B and upper ends in T, each shape (M, 6, 3), m."""
        lower = np.array([geometry.base_nodes[single.LEGS[:, 0]] for geometry in self.geometries])
        return lower, np.array([geometry.top_nodes[single.LEGS[:, 1]] for geometry in self.geometries])

    def transform(self, x: Array) -> tuple[Array, Array]:
        """As `roll_pitch_yaw.pose_transform`."""
        return pose_transform(x)

    def twist(self, x: Array) -> tuple[Array, Array]:
        """As `roll_pitch_yaw.pose_twist`."""
        return pose_twist(x)

    def inner(self, x: Array) -> Array:
        """None."""
        return np.empty((*x.shape[:-1], 0, 3))

    def inner_derivative(self, x: Array) -> Array:
        """None."""
        return np.empty((*x.shape[:-1], 0, 3, 6))

    def _legs(self, x: Array) -> tuple[Array, Array]:
        R, P = pose_transform(x)
        lower, upper = self._ends
        return single.leg_jacobian(lower, upper @ np.swapaxes(R, -1, -2) + P[..., None, :], P)

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """Lengths of all six longerons by 3.27 and their derivatives by the parameters of the pose.

        Raises:
            AssemblyError: A static longeron would need another length: the pose is outside the module's subspace.
        """
        lengths, J = self._legs(x)
        error = np.abs(np.nan_to_num(lengths - self._static))
        if np.any(error > single.STATIC_TOLERANCE):
            worst = np.unravel_index(int(np.argmax(error)), error.shape)
            module, leg = int(worst[-2]), int(worst[-1])
            freedom = int(self.actuated[module].sum())
            detail = f"pose outside the {freedom}-dimensional subspace: static longeron l{leg + 1} would be"
            raise AssemblyError(self.names[module], float(error[worst]), f"{detail} {lengths[worst]:.6g} m")
        angular, linear = pose_twist(x)
        return lengths, J @ np.concatenate([linear, angular], axis=-2)

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """As `octahedron.advance`, module by module.

        Args:
            lengths: Of all longerons, shape (..., M, 6), m.
            start: Poses on the wanted mode, shape (..., M, 6); absent for the modules' `home`.

        Returns:
            Poses, shape (..., M, 6), and the fraction of the way covered, shape (..., M).
        """
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        for m, geometry in enumerate(self.geometries):
            wanted = lengths[..., m, :].reshape(-1, 6)
            near = single.home(geometry, wanted) if start is None else pose_transform(start[..., m, :])
            begin = (np.broadcast_to(near[0], (len(wanted), 3, 3)), np.broadcast_to(near[1], (len(wanted), 3)))
            R, P, part = single.advance(geometry, wanted, begin)
            x[..., m, :] = pose_parameters(R, P).reshape(x[..., m, :].shape)
            reached[..., m] = part.reshape(reached[..., m].shape)
        return x, reached

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Args:
            lengths: Of all longerons, shape (..., M, 6), m.
            start: Poses on the wanted mode, shape (..., M, 6), or absent.

        Returns:
            Poses, shape (..., M, 6).

        Raises:
            AssemblyError: A longeron pair does not close; the module is named.
            SingularityError: A singularity lies between.
        """
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                single.closure(geometry, lengths[..., m, :])
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        x, reached = self.attempt(lengths, start)
        if reached.min(initial=1.0) < 1.0:
            worst = np.unravel_index(int(np.argmin(reached)), reached.shape)
            geometry, name = self.geometries[worst[-1]], self.names[worst[-1]]
            R, P = pose_transform(x[worst])
            value, leg = single.singularity(geometry, R, P)
            role = "longeron" if geometry.static[leg] is not None else "actuator"
            gap = np.abs(single.lengths(geometry, R, P) - lengths[worst]).max()
            raise SingularityError(name, value, f"{name}/{role}/{leg + 1}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dtwist with rotations in units of the top nodes' radius."""
        scale = np.ones((len(self.names), 6))
        scale[:, 3:] = np.array([geometry.radius for geometry in self.geometries])[:, None]
        return self._legs(x)[1] / scale[:, None, :]


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

    @cached_property
    def actuated(self) -> NDArray[np.bool_]:
        """All of them."""
        return np.ones((len(self.names), 1), dtype=bool)

    def transform(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.transform`."""
        return tetra.transform(self.geometry, x[..., 0])

    def twist(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.twist`."""
        return tetra.twist(self.geometry, x[..., 0])

    def inner(self, x: Array) -> Array:
        """None."""
        return np.empty((*x.shape[:-1], 0, 3))

    def inner_derivative(self, x: Array) -> Array:
        """None."""
        return np.empty((*x.shape[:-1], 0, 3, 1))

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """As `tetrahedron.inverse` and `length_derivative`."""
        theta = x[..., 0]
        slope = tetra.length_derivative(self.geometry, theta)
        return tetra.inverse(self.geometry, theta)[..., None], slope[..., None, None]

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
        if reached.min(initial=1.0) < 1.0:
            worst = np.unravel_index(int(np.argmin(reached)), reached.shape)
            name, longest = self.names[worst[-1]], 2 * float(self.geometry.height[worst[-1]])
            gap = abs(float(lengths[worst][0]) - longest)
            raise SingularityError(name, 0.0, f"{name}/actuator/1", gap, min(1.0, longest / float(lengths[worst][0])))
        return theta

    def conditioned(self, x: Array) -> Array:
        """dl/dtheta over the altitude: the cosine of half the hinge angle."""
        return self.length_jacobian(x)[1] / self.geometry.height[..., None, None]


def find_singular(module_set: ModuleSet, x: Array) -> tuple[Array, NDArray[np.intp]]:
    """Smallest singular value of each module, a pure number, and the leg worst of it.

    Args:
        module_set: The set.
        x: Shape (..., M, inputs).

    Returns:
        Shapes (..., M).
    """
    left, value, _ = np.linalg.svd(module_set.conditioned(x))
    return value[..., -1], np.argmax(np.abs(left[..., -1]), axis=-1)


def straight_pose(geometry: single.Geometry, lengths: Sequence[float]) -> Array:
    """Pose of an octahedral module with given longerons on its working mode.

    Args:
        geometry: Fixed dimensions.
        lengths: l1 to l6, m.

    Returns:
        x, y, z, roll, pitch, yaw, shape (6,).

    Raises:
        AssemblyError: The longerons do not close.
    """
    return pose_parameters(*single.forward(geometry, np.array(lengths)))
