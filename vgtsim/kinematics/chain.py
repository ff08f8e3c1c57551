"""Chains of modules: every node, frame and Jacobian of an arm from the mid-planes of its active modules (chapter 4).

Inputs q have shape (..., A, 3): for each of the A active modules its mid-plane (u_x, u_y, d), see `double_octahedron`.
Leading dimensions are batches. Positions are in frame G, the frame that the mount maps B_1 into.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.manipulator import DoubleOctahedral, Manipulator
from vgtsim.errors import AssemblyError
from vgtsim.kinematics import double_octahedron as octa
from vgtsim.kinematics.truss import Truss, make_truss

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """Kinematics of one arm on its mount.

    Attributes:
        manipulator: The arm.
        mount: T_G_B1, shape (4, 4): frame B of the first module in frame G.
    """

    manipulator: Manipulator
    mount: Array

    def __post_init__(self) -> None:
        """Copy the mount and make it read-only."""
        mount = np.array(self.mount, float)
        mount.flags.writeable = False
        object.__setattr__(self, "mount", mount)

    @cached_property
    def truss(self) -> Truss:
        """Nodes and members."""
        return make_truss(self.manipulator)

    @cached_property
    def geometries(self) -> tuple[octa.Geometry, ...]:
        """Fixed dimensions of the active modules."""
        side = self.manipulator.face_side
        return tuple(octa.Geometry(side, item.longeron, item.joint_offset) for item in self.manipulator.active)

    @cached_property
    def _steps(self) -> tuple[int | float, ...]:
        """For each module its index among the active ones (int), or the length of a prism (float)."""
        steps: list[int | float] = []
        active = 0
        for module in self.manipulator.modules:
            if isinstance(module, DoubleOctahedral):
                steps.append(active)
                active += 1
            else:
                steps.append(float(module.length))
        return tuple(steps)

    @cached_property
    def straight(self) -> Array:
        """Inputs of the straight working pose, shape (A, 3)."""
        return np.array([[0.0, 0.0, (item.straight - item.joint_offset) / 2] for item in self.manipulator.active])

    @cached_property
    def stowed(self) -> Array:
        """Inputs of the stowed pose, shape (A, 3)."""
        length = self.manipulator.stowed.cylinder_length
        return np.array([octa.midplane_from_lengths(geometry, np.full(3, length)) for geometry in self.geometries])

    @cached_property
    def stroke(self) -> Array:
        """Least and greatest actuator lengths, shape (2, A, 3), m."""
        cylinders = [self.manipulator.cylinders[item.cylinder] for item in self.manipulator.active]
        ends = np.array([[item.retracted for item in cylinders], [item.extended for item in cylinders]])
        return np.repeat(ends[..., None], 3, axis=-1)

    def frames(self, q: ArrayLike) -> tuple[Array, Array]:
        """Frames of all faces (equations 4.3 and 4.7).

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            R, shape (..., K + 1, 3, 3), and P, shape (..., K + 1, 3), m, in frame G, for the mast flange and then the
            top face of each of the K modules.
        """
        q = np.asarray(q, float)
        batch = q.shape[:-2]
        R = np.empty((*batch, len(self._steps) + 1, 3, 3))
        P = np.empty((*batch, len(self._steps) + 1, 3))
        R[..., 0, :, :], P[..., 0, :] = self.mount[:3, :3], self.mount[:3, 3]
        for k, step in enumerate(self._steps):
            if isinstance(step, int):
                turn, shift = octa.transform(self.geometries[step], q[..., step, :])
                R[..., k + 1, :, :] = R[..., k, :, :] @ turn
                P[..., k + 1, :] = P[..., k, :] + (R[..., k, :, :] @ shift[..., None])[..., 0]
            else:
                R[..., k + 1, :, :] = R[..., k, :, :]
                P[..., k + 1, :] = P[..., k, :] + step * R[..., k, :, 2]
        return R, P

    def nodes(self, q: ArrayLike) -> Array:
        """Positions of all nodes.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            In frame G, in the order of the truss, shape (..., N, 3), m.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        q = np.asarray(q, float)
        R, P = self.frames(q)
        return self._nodes(q, R, P)

    def _nodes(self, q: Array, R: Array, P: Array) -> Array:
        face = octa.face_nodes(self.manipulator.face_side)
        parts = [face @ np.swapaxes(R[..., 0, :, :], -1, -2) + P[..., 0, None, :]]
        for k, step in enumerate(self._steps):
            if isinstance(step, int):
                mid = octa.mid_nodes(self.geometries[step], self._angles(q, step))
                parts.append(mid @ np.swapaxes(R[..., k, :, :], -1, -2) + P[..., k, None, :])
            parts.append(face @ np.swapaxes(R[..., k + 1, :, :], -1, -2) + P[..., k + 1, None, :])
        return np.concatenate(parts, axis=-2)

    def _angles(self, q: Array, active: int) -> Array:
        try:
            return octa.angles(self.geometries[active], q[..., active, :])
        except AssemblyError as error:
            raise AssemblyError(self.manipulator.active[active].name, error.residual, "mid-plane too far") from None

    def tool(self, q: ArrayLike) -> tuple[Array, Array]:
        """Tool point and tool direction.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Position, shape (..., 3), m, and outward unit normal of the tip plate, shape (..., 3), in frame G.
        """
        R, P = self.frames(q)
        direction = R[..., -1, :, 2]
        return P[..., -1, :] + self.manipulator.tip_plate.tool_offset * direction, direction

    def lengths(self, q: ArrayLike) -> Array:
        """Actuator lengths.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Shape (..., A, 3), m.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        return self.length_jacobian(q)[0]

    def length_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Actuator lengths and their derivatives; each module's depend on its own inputs only.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Lengths, shape (..., A, 3), m, and the blocks dl/dg, shape (..., A, 3, 3).

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        q = np.asarray(q, float)
        length, block = np.empty(q.shape), np.empty((*q.shape, 3))
        for a, geometry in enumerate(self.geometries):
            try:
                length[..., a, :], block[..., a, :, :] = octa.length_jacobian(geometry, q[..., a, :])
            except AssemblyError as error:
                raise AssemblyError(self.manipulator.active[a].name, error.residual, "mid-plane too far") from None
        return length, block

    def inputs_from_lengths(self, actuators: ArrayLike, start: ArrayLike | None = None) -> Array:
        """Conventional forward solution: inputs of given actuator lengths (section 4.3).

        Args:
            actuators: Shape (..., A, 3), m.
            start: Inputs to start each module's iteration from, shape (..., A, 3).

        Returns:
            q, shape (..., A, 3).

        Raises:
            AssemblyError: A module does not assemble; it is named.
        """
        wanted = np.asarray(actuators, float)
        near = None if start is None else np.asarray(start, float)
        q = np.empty(wanted.shape)
        for a, geometry in enumerate(self.geometries):
            try:
                seed = None if near is None else near[..., a, :]
                q[..., a, :] = octa.midplane_from_lengths(geometry, wanted[..., a, :], seed)
            except (AssemblyError, np.linalg.LinAlgError) as error:
                residual = error.residual if isinstance(error, AssemblyError) else float("inf")
                raise AssemblyError(self.manipulator.active[a].name, residual) from None
        return q

    def screws(self, q: ArrayLike) -> tuple[Array, Array]:
        """Velocity of everything beyond a module per unit rate of its inputs.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Angular velocity and velocity of the point at the origin of G, each shape (..., A, 3 inputs, 3), in G.
        """
        q = np.asarray(q, float)
        return self._screws(q, *self.frames(q))

    def _screws(self, q: Array, R: Array, P: Array) -> tuple[Array, Array]:
        angular, linear = np.empty((*q.shape, 3)), np.empty((*q.shape, 3))
        for k, step in enumerate(self._steps):
            if isinstance(step, int):
                spin, slide = octa.twist(self.geometries[step], q[..., step, :])
                angular[..., step, :, :] = np.swapaxes(R[..., k, :, :] @ spin, -1, -2)
                linear[..., step, :, :] = np.swapaxes(R[..., k, :, :] @ slide, -1, -2)
                linear[..., step, :, :] -= np.cross(angular[..., step, :, :], P[..., k + 1, None, :])
        return angular, linear

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian of the tool in closed form (section 6.1.2).

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Shape (..., 6, 3 A): velocity of the tool point over angular velocity of the tip plate, in frame G.
        """
        q = np.asarray(q, float)
        R, P = self.frames(q)
        angular, linear = self._screws(q, R, P)
        tool = P[..., -1, :] + self.manipulator.tip_plate.tool_offset * R[..., -1, :, 2]
        velocity = linear + np.cross(angular, tool[..., None, None, :])
        J = np.concatenate([velocity, angular], axis=-1)
        return np.swapaxes(J.reshape(*q.shape[:-2], -1, 6), -1, -2)

    def node_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Positions of all nodes and their derivatives, in closed form.

        Args:
            q: Inputs, shape (..., A, 3).

        Returns:
            Nodes, shape (..., N, 3), m, and dn/dq, shape (..., N, 3, 3 A), in frame G.
        """
        q = np.asarray(q, float)
        R, P = self.frames(q)
        nodes = self._nodes(q, R, P)
        angular, linear = self._screws(q, R, P)
        velocity = linear[..., None, :, :, :] + np.cross(angular[..., None, :, :, :], nodes[..., None, None, :])
        row = 3
        for k, step in enumerate(self._steps):
            if isinstance(step, int):
                velocity[..., :row, step, :, :] = 0.0
                phi = self._angles(q, step)
                local = octa.mid_node_derivative(self.geometries[step], q[..., step, :], phi)
                turned = np.einsum("...xk,...nki->...nix", R[..., k, :, :], local)
                velocity[..., row : row + 3, step, :, :] = turned
                row += 6
            else:
                row += 3
        J = velocity.reshape(*nodes.shape[:-1], -1, 3)
        return nodes, np.swapaxes(J, -1, -2)


def hanging_mount(height: float) -> Array:
    """Mount of an arm that hangs from a mast on the tank axis.

    Args:
        height: Of the arm's base face above the origin of G, m.

    Returns:
        T_G_B1, shape (4, 4): a half turn about X, so that Z of B_1 points down.
    """
    mount = np.diag([1.0, -1.0, -1.0, 1.0])
    mount[2, 3] = height
    return mount
