"""The longeron-actuated octahedral modules of a chain, see `module_sets`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics import octahedron as single
from vgtsim.kinematics.module_sets import find_short, no_inner
from vgtsim.kinematics.roll_pitch_yaw import pose_parameters, pose_transform, pose_twist

Array = NDArray[np.float64]


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

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """Longerons with a cylinder."""
        return self._actuated

    @cached_property
    def _actuated(self) -> NDArray[np.bool_]:
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
        return no_inner(x)[0]

    def inner_derivative(self, x: Array) -> Array:
        """None."""
        return no_inner(x)[1]

    def _legs(self, x: Array) -> tuple[Array, Array]:
        R, P = pose_transform(x)
        lower, upper = self._ends
        return single.leg_jacobian(lower, upper @ np.swapaxes(R, -1, -2) + P[..., None, :], P)

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """Lengths of all six longerons by 3.27 and their derivatives by the parameters of the pose.

        Raises:
            AssemblyError: A static longeron would need another length: the pose is outside the module's subspace.
        """
        lengths, J = self.legs(x)
        error = np.abs(np.nan_to_num(lengths - self._static))
        if np.any(error > single.STATIC_TOLERANCE):
            worst = np.unravel_index(int(np.argmax(error)), error.shape)
            module, leg = int(worst[-2]), int(worst[-1])
            freedom = int(self.actuated[module].sum())
            detail = f"pose outside the {freedom}-dimensional subspace: static longeron l{leg + 1} would be"
            raise AssemblyError(self.names[module], float(error[worst]), f"{detail} {lengths[worst]:.6g} m")
        return lengths, J

    def legs(self, x: Array) -> tuple[Array, Array]:
        """As `length_jacobian`, for any pose: static longerons too have its lengths."""
        lengths, J = self._legs(x)
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
        worst = find_short(reached)
        if worst is not None:
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
