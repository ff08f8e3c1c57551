"""The general double-octahedral modules of a chain, see `module_sets`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics import double_octahedron_general as general
from vgtsim.kinematics import double_octahedron_rates as rates

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GeneralDoubleOctahedra:
    """General double-octahedral modules; inputs are the angles phi_1 to phi_3 of 3.28, legs the three actuators.

    The upper cell follows from the lower by its closure, on the assembly mode of the straight pose: every call comes from
    there, so that what an input means depends on nothing else.

    Attributes:
        names: Of the modules.
        geometries: One each; all of them or none have a joint offset.
        begins: State of each straight pose, shape (M, 6), rad.
    """

    names: tuple[str, ...]
    geometries: tuple[general.Geometry, ...]
    begins: Array
    inputs = 3

    @property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if self.geometries[0].joint_offset else 3

    @cached_property
    def _actuated(self) -> NDArray[np.bool_]:
        return np.ones((len(self.names), 3), dtype=bool)

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """All of them."""
        return self._actuated

    def states(self, x: Array) -> Array:
        """All six angles of each module, shape (..., M, 6), rad.

        Raises:
            AssemblyError: A module does not assemble, or only beyond a singularity; it is named.
        """
        parts = []
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                parts.append(general.forward(geometry, x[..., m, :], self.begins[m]))
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        return np.stack(parts, axis=-2)

    def _each(self, x: Array, solved: Callable[[general.Geometry, Array], Array], axis: int) -> Array:
        """Something of every module's state, stacked along the axis of the modules."""
        states = self.states(x)
        parts = [solved(geometry, states[..., m, :]) for m, geometry in enumerate(self.geometries)]
        return np.stack(parts, axis=axis)

    def transform(self, x: Array) -> tuple[Array, Array]:
        """As `double_octahedron_general.transform`."""
        states = self.states(x)
        R, P = zip(
            *(general.transform(geometry, states[..., m, :]) for m, geometry in enumerate(self.geometries)), strict=True
        )
        return np.stack(R, axis=-3), np.stack(P, axis=-2)

    def twist(self, x: Array) -> tuple[Array, Array]:
        """As `double_octahedron_rates.jacobian`."""
        J = self._each(x, rates.jacobian, axis=-3)
        return J[..., 3:, :], J[..., :3, :]

    def inner(self, x: Array) -> Array:
        """n4, n5, n6; with a joint offset the blocks' feet n4 to n6, middles, and heads n4' to n6'."""
        points = self._each(x, general.nodes, axis=-3)
        feet, heads = points[..., :3, :], points[..., 3:6, :]
        return np.concatenate([feet, (feet + heads) / 2, heads], axis=-2) if self.inner_count == 9 else feet

    def inner_derivative(self, x: Array) -> Array:
        """As `double_octahedron_rates.mid_velocities`, for all inner nodes."""
        both = self._each(x, rates.mid_velocities, axis=-4)
        feet, heads = both[..., :3, :, :], both[..., 3:, :, :]
        return np.concatenate([feet, (feet + heads) / 2, heads], axis=-3) if self.inner_count == 9 else feet

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """Actuator lengths and their derivatives: the lower cell alone, in closed form."""
        lengths = [general.actuator_lengths(geometry, x[..., m, :]) for m, geometry in enumerate(self.geometries)]
        return np.stack(lengths, axis=-2), self.angle_jacobian(x)

    def legs(self, x: Array) -> tuple[Array, Array]:
        """As `length_jacobian`: there are no static legs."""
        return self.length_jacobian(x)

    def angle_jacobian(self, x: Array) -> Array:
        """As `double_octahedron_general.angle_jacobian`, shape (..., M, 3, 3), m/rad."""
        parts = [general.angle_jacobian(geometry, x[..., m, :]) for m, geometry in enumerate(self.geometries)]
        return np.stack(parts, axis=-3)

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """As `double_octahedron_general.advance_lengths`, module by module.

        Args:
            lengths: Shape (..., M, 3), m.
            start: Inputs on the wanted mode, shape (..., M, 3); absent for the straight poses.

        Returns:
            Inputs, shape (..., M, 3), and the fraction of the way covered, shape (..., M).
        """
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        begin = self.begins if start is None else self.states(start)
        for m, geometry in enumerate(self.geometries):
            state, part = general.advance_lengths(geometry, lengths[..., m, :], begin[..., m, :])
            x[..., m, :], reached[..., m] = state[..., :3], part
        return x, reached

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Args:
            lengths: Shape (..., M, 3), m.
            start: Shape (..., M, 3), or absent.

        Returns:
            Inputs, shape (..., M, 3).

        Raises:
            AssemblyError: Lengths that no pose can have; the module is named.
            SingularityError: A singularity of either cell lies between.
        """
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                general.upper_circles(geometry, lengths[..., m, :])
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        x, reached = self.attempt(lengths, start)
        if reached.min(initial=1.0) < 1.0:
            worst = np.unravel_index(int(np.argmin(reached)), reached.shape)
            m = int(worst[-1])
            geometry, name = self.geometries[m], self.names[m]
            begin = np.broadcast_to(
                self.begins[m] if start is None else self.states(start)[..., m, :], (*x.shape[:-2], 6)
            )
            state = general.advance_lengths(geometry, lengths[worst], begin[worst[:-1]])[0]
            value, member = rates.singularity(geometry, state)
            top = general.nodes(geometry, state)[6:]
            sides = np.linalg.norm(top[[1, 2, 0]] - top, axis=-1)
            gap = np.abs([*(general.actuator_lengths(geometry, state) - lengths[worst]), *(sides - geometry.top)]).max()
            kind, number = member.split()
            raise SingularityError(name, value, f"{name}/{kind}/{number[1:]}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the mean radius of the circles."""
        radius = np.array([np.mean(geometry.circles.radius) for geometry in self.geometries])
        return self.angle_jacobian(x) / radius[:, None, None]

    def least_singular(self, x: Array) -> Array:
        """Smallest singular value of the nearer cell, as `double_octahedron_rates.singularity`.

        Args:
            x: Shape (..., M, 3).

        Returns:
            Shape (..., M), pure numbers.
        """
        lower = np.linalg.svd(self.conditioned(x), compute_uv=False)[..., -1]
        states, upper = self.states(x), []
        for m, geometry in enumerate(self.geometries):
            J = rates.upper_jacobian(general.nodes(geometry, states[..., m, :]))[1]
            J[..., 3:] /= geometry.radius
            upper.append(np.linalg.svd(J, compute_uv=False)[..., -1])
        return np.minimum(lower, np.stack(upper, axis=-1))


def straight_states(names: Sequence[str], geometries: Sequence[general.Geometry], lengths: Sequence[float]) -> Array:
    """States of modules with three equal actuators each, on the working mode.

    Args:
        names: Of the modules.
        geometries: M of them.
        lengths: Of the actuators of each, m.

    Returns:
        Shape (M, 6), rad.

    Raises:
        AssemblyError: A module does not assemble; it is named.
    """
    states = []
    for name, geometry, length in zip(names, geometries, lengths, strict=True):
        try:
            states.append(general.forward_lengths(geometry, [length] * 3))
        except AssemblyError as error:
            raise AssemblyError(name, error.residual, str(error)) from None
    return np.array(states)
