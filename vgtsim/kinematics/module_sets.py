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

_BRANCH = 1e-9  # m: departure of a solution's own lengths from those asked for that is no rounding any more


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

    def solve(self, lengths: Array, start: Array) -> Array:
        """Inputs of leg lengths, shape (..., M, legs), on the assembly mode of the start, shape (..., M, inputs)."""
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

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """Conventional forward solution, each step proved to stay on the mode of the start.

        Args:
            lengths: Shape (..., M, 3), m.
            start: Shape (..., M, 3); absent for the straight modules with three equal actuators of the mean length.

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
        begin = double.straight_angles(self.geometry, lengths) if start is None else self.angles(start)
        phi = np.broadcast_to(begin, lengths.shape).reshape(-1, 3)
        module = np.broadcast_to(np.arange(len(self.names)), lengths.shape[:-1]).ravel()
        goal = lengths.reshape(-1, 3)
        every = np.broadcast_to(self.geometry.apothem, lengths.shape[:-1]).ravel()
        radius = np.broadcast_to(self.geometry.height, lengths.shape[:-1]).ravel()
        circles = Circles(
            -every[:, None, None] * double.INWARD,
            np.broadcast_to(double.INWARD, (len(every), 3, 3)),
            np.repeat(radius[:, None], 3, axis=1),
        )
        first = double.actuator_lengths(double.mid_nodes(self.geometry, phi.reshape(lengths.shape))).reshape(-1, 3)
        C, change = closure_coefficients(circles, first), (first**2 - goal**2).T

        def path(t: Array, index: NDArray[np.intp]) -> Array:
            now = C[..., index]
            now[0] += t * change[:, index]
            return now

        result = follow(path, phi)
        self._refuse_singular(result.phi, result.reached, module, goal)
        x = double.midplane_from_angles(self.geometry, result.phi.reshape(lengths.shape))
        off = np.abs(double.length_jacobian(self.geometry, x, self.angles(x))[0] - lengths).max(axis=-1).ravel()
        if np.any(off > _BRANCH):
            self._refuse_singular(result.phi, np.where(off > _BRANCH, 0.0, 1.0), module, goal)
        return x

    def _refuse_singular(self, phi: Array, reached: Array, module: NDArray[np.intp], goal: Array) -> None:
        if reached.min(initial=1.0) == 1.0:
            return
        worst = int(np.argmin(reached))
        geometry, name = self._one(int(module[worst])), self.names[int(module[worst])]
        J = double.angle_jacobian(geometry, phi[worst]) / geometry.height
        value, row = worst_direction(J)
        gap = np.abs(double.actuator_lengths(double.mid_nodes(geometry, phi[worst])) - goal[worst]).max()
        raise SingularityError(name, value, f"{name}/actuator/{row + 1}", float(gap), float(reached[worst]))

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

    def solve(self, lengths: Array, start: Array) -> Array:
        """As `octahedron.forward`, module by module.

        Args:
            lengths: Of all longerons, shape (..., M, 6), m.
            start: Poses on the wanted mode, shape (..., M, 6).

        Returns:
            Poses, shape (..., M, 6).

        Raises:
            AssemblyError: A longeron pair does not close; the module is named.
            SingularityError: A singularity lies between.
        """
        x = np.empty(lengths.shape)
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            wanted = lengths[..., m, :].reshape(-1, 6)
            try:
                single.closure(geometry, wanted)
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
            begin = np.broadcast_to(start[..., m, :], lengths[..., m, :].shape).reshape(-1, 6)
            R, P, reached = single.advance(geometry, wanted, pose_transform(begin))
            if reached.min(initial=1.0) < 1.0:
                worst = int(np.argmin(reached))
                value, leg = single.singularity(geometry, R[worst], P[worst])
                role = "longeron" if geometry.static[leg] is not None else "actuator"
                gap = np.abs(single.lengths(geometry, R[worst], P[worst]) - wanted[worst]).max()
                raise SingularityError(name, value, f"{name}/{role}/{leg + 1}", float(gap), float(reached[worst]))
            x[..., m, :] = pose_parameters(R, P).reshape(x[..., m, :].shape)
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

    def solve(self, lengths: Array, start: Array) -> Array:
        """Closed form, on the side of the flat pose on which the start is.

        Args:
            lengths: Shape (..., M, 1), m.
            start: Shape (..., M, 1), rad.

        Returns:
            Hinge angles, shape (..., M, 1), rad.

        Raises:
            SingularityError: A length beyond the flat pose, which is singular; the module is named.
        """
        longest = 2 * self.geometry.height
        excess = lengths[..., 0] - longest
        if np.any(~(excess < 0)) or np.any(lengths < 0):
            worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
            name = self.names[worst[-1]]
            raise SingularityError(name, 0.0, f"{name}/actuator/1", float(max(excess[worst], 0.0)), 0.0)
        theta = 2 * np.arcsin(lengths / longest[:, None])
        return np.where(start > np.pi, 2 * np.pi - theta, np.where(start < 0, -theta, theta))

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
