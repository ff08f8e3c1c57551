"""Chains of modules: every node, frame and Jacobian of an arm from the inputs of its active modules (chapter 4).

Inputs q are canonical and stand in one row, shape (..., n), from the mast to the tool: for a double octahedron its
mid-plane (u_x, u_y, d), for a general one its angles phi_1 to phi_3, for a tetrahedron its hinge angle theta, for an
octahedron its pose (x, y, z, roll, pitch, yaw). Actuator lengths have shape (..., J), in the order of the truss's
actuators. Leading dimensions are batches. Positions are in frame G, the frame that the mount maps B_1 into.

All modules of a kind are solved in one call, static modules are absorbed into constants, and one product runs along the
arm.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.double_octahedra import DoubleOctahedra
from vgtsim.kinematics.layout import Layout, Place, make_layout
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
    def layout(self) -> Layout:
        """Sets of modules, constant transforms, where every node comes from."""
        return make_layout(self.manipulator, self.truss)

    @cached_property
    def straight(self) -> Array:
        """Inputs of the straight working pose, shape (n,)."""
        row = np.empty(self.layout.inputs)
        for place in self.layout.places:
            row[place.columns] = place.straight
        return row

    @cached_property
    def stowed(self) -> Array:
        """Inputs of the stowed pose, shape (n,): double octahedra stowed, other modules straight."""
        row = np.array(self.straight)
        for place in self.layout.places:
            if isinstance(place.modules, DoubleOctahedra):
                wanted = np.full(place.columns.shape, self.manipulator.stowed_length)
                row[place.columns] = place.modules.solve(wanted, None)
        return row

    @cached_property
    def stroke(self) -> Array:
        """Least and greatest actuator lengths, shape (2, J), m."""
        truss = self.truss
        cylinders = [self.manipulator.cylinders[truss.members[i].section] for i in truss.actuated]
        return np.array([[item.retracted for item in cylinders], [item.extended for item in cylinders]])

    def _inputs(self, q: ArrayLike) -> Array:
        """Inputs as an array, shape (..., n)."""
        given = np.asarray(q, float)
        if given.shape[-1:] != (self.layout.inputs,):
            raise ValueError(
                f"inputs of shape {given.shape}; {self.manipulator.name} takes (..., {self.layout.inputs})"
            )
        return given

    def _place_bases(self, x: Array) -> tuple[Array, Array]:
        """Bases of the active modules, then the last face, in G, (..., A + 1, 4, 4), and T_BT, (..., A, 4, 4)."""
        layout = self.layout
        local = np.zeros((*x.shape[:-1], len(layout.names), 4, 4))
        local[..., 3, 3] = 1.0
        for place in layout.places:
            R, P = place.modules.transform(place.take(x))
            local[..., :3, :3][..., place.active, :, :] = R
            local[..., :3, 3][..., place.active, :] = P
        step = local @ layout.after
        base = np.empty((*x.shape[:-1], len(layout.names) + 1, 4, 4))
        base[..., 0, :, :] = self.mount @ layout.root
        for a in range(len(layout.names)):
            np.matmul(base[..., a, :, :], step[..., a, :, :], out=base[..., a + 1, :, :])
        return base, local

    def _faces(self, base: Array, local: Array) -> Array:
        """Frames of all faces, shape (..., K + 1, 4, 4)."""
        layout = self.layout
        known = np.empty(base.shape)
        known[..., 0, :, :] = self.mount
        np.matmul(base[..., :-1, :, :], local, out=known[..., 1:, :, :])
        return known[..., layout.face_from, :, :] @ layout.face_offset

    def frames(self, q: ArrayLike) -> tuple[Array, Array]:
        """Frames of all faces (equations 4.3 and 4.7).

        Args:
            q: Inputs, shape (..., n).

        Returns:
            R, shape (..., K + 1, 3, 3), and P, shape (..., K + 1, 3), m, in frame G, for the mast flange and then the
            top face of each of the K modules.
        """
        faces = self._faces(*self._place_bases(self._inputs(q)))
        return faces[..., :3, :3], faces[..., :3, 3]

    def nodes(self, q: ArrayLike) -> Array:
        """Positions of all nodes.

        Args:
            q: Inputs, shape (..., n).

        Returns:
            In frame G, in the order of the truss, shape (..., N, 3), m.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        x = self._inputs(q)
        return self._nodes(x, *self._place_bases(x))

    def _nodes(self, x: Array, base: Array, local: Array) -> Array:
        faces = self._faces(base, local)
        turned = self.layout.corners @ np.swapaxes(faces[..., :3, :3], -1, -2) + faces[..., None, :3, 3]
        parts = [turned.reshape(*x.shape[:-1], -1, 3)]
        for place in self.layout.places:
            if place.modules.inner_count:
                T = base[..., :-1, :, :][..., place.active, :, :]
                inner = place.modules.inner(place.take(x)) @ np.swapaxes(T[..., :3, :3], -1, -2) + T[..., None, :3, 3]
                parts.append(inner.reshape(*x.shape[:-1], -1, 3))
        return np.take(np.concatenate(parts, axis=-2), self.layout.order, axis=-2)

    def tool(self, q: ArrayLike) -> tuple[Array, Array]:
        """Tool point and tool direction.

        Args:
            q: Inputs, shape (..., n).

        Returns:
            Position, shape (..., 3), m, and outward unit normal of the tip plate, shape (..., 3), in frame G.
        """
        return self._tool(self._place_bases(self._inputs(q))[0])

    def _tool(self, base: Array) -> tuple[Array, Array]:
        direction = base[..., -1, :3, 2]
        return base[..., -1, :3, 3] + self.manipulator.tip_plate.tool_offset * direction, direction

    def lengths(self, q: ArrayLike) -> Array:
        """Actuator lengths.

        Args:
            q: Inputs, shape (..., n).

        Returns:
            Shape (..., J), m.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle, or a pose is outside the subspace that an octahedron's
                static longerons leave; the module is named.
        """
        x = self._inputs(q)
        row = np.empty((*x.shape[:-1], self.layout.actuators))
        for place in self.layout.places:
            legs = place.modules.length_jacobian(place.take(x))[0]
            row[..., _moving(place)] = legs[..., place.modules.actuated]
        return row

    def length_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Actuator lengths and their derivatives; each module's depend on its own inputs only.

        Args:
            q: Inputs, shape (..., n).

        Returns:
            Lengths, shape (..., J), m, and dl/dq, shape (..., J, n).

        Raises:
            AssemblyError: As `lengths`.
        """
        x = self._inputs(q)
        row = np.empty((*x.shape[:-1], self.layout.actuators))
        J = np.zeros((*row.shape, self.layout.inputs))
        for place in self.layout.places:
            legs, block = place.modules.length_jacobian(place.take(x))
            moving = place.modules.actuated
            row[..., _moving(place)] = legs[..., moving]
            columns = np.broadcast_to(place.columns[:, None, :], (*moving.shape, place.modules.inputs))[moving]
            J[..., _moving(place)[:, None], columns] = block[..., moving, :]
        return row, J

    def length_rates(self, q: ArrayLike, rates: ArrayLike) -> Array:
        """Speeds of the actuators, shape (..., J), at inputs and their rates, each of shape (..., n).

        Raises:
            AssemblyError: As `lengths`.
        """
        x, dx = self._inputs(q), self._inputs(rates)
        row = np.empty((*x.shape[:-1], self.layout.actuators))
        for place in self.layout.places:
            block = place.modules.length_jacobian(place.take(x))[1]
            row[..., _moving(place)] = (block @ place.take(dx)[..., None])[..., place.modules.actuated, 0]
        return row

    @cached_property
    def _usual_slopes(self) -> tuple[Array, ...]:
        """How much all legs together change by each input in the straight pose, shape (M, inputs) for each place."""
        places = self.layout.places
        return tuple(np.linalg.norm(p.modules.length_jacobian(p.straight)[1], axis=-2) for p in places)

    def input_rates(self, q: ArrayLike, only: Collection[str] | None = None) -> Array:
        """Rates of the inputs q per unit rate of each actuator, static longerons held: the chain rule of section 3.2.

        Args:
            q: Inputs, shape (..., n).
            only: Names of the modules whose actuators move; absent for all.

        Returns:
            dq/dl, shape (..., n, J), zero for the other modules.

        Raises:
            AssemblyError: As `lengths`.
            SingularPoseError: A module is singular; it is named.
        """
        x = self._inputs(q)
        rates = np.zeros((*x.shape[:-1], self.layout.inputs, self.layout.actuators))
        for place, usual in zip(self.layout.places, self._usual_slopes, strict=True):
            chosen = [m for m, name in enumerate(place.modules.names) if only is None or name in only]
            names = [place.modules.names[m] for m in chosen]
            slopes = place.modules.length_jacobian(place.take(x))[1][..., chosen, :, :]
            block = invert_sound(slopes, usual[chosen], lambda where, names=names: names[where[-1]])
            module, leg = np.nonzero(place.modules.actuated[chosen])
            picked = np.moveaxis(block[..., module, :, leg], 0, -2)  # the picked legs come first
            rates[..., place.columns[chosen][module], place.lengths[chosen][module, leg][:, None]] = picked
        return rates

    def inputs_from_lengths(self, actuators: ArrayLike, start: ArrayLike | None = None) -> Array:
        """Conventional forward solution: inputs of given actuator lengths (section 4.3).

        Every module stays on the assembly mode of its start, with proof; see `mode_following`.

        Args:
            actuators: Shape (..., J), m.
            start: Inputs on the wanted modes, shape (..., n); absent for those of the straight pose.

        Returns:
            q, shape (..., n).

        Raises:
            AssemblyError: A module does not assemble; it is named.
            SingularityError: A module would have to pass a singularity on the way.
        """
        wanted = np.asarray(actuators, float)
        if wanted.shape[-1:] != (self.layout.actuators,):
            taken = f"{self.manipulator.name} takes (..., {self.layout.actuators})"
            raise ValueError(f"lengths of shape {wanted.shape}; {taken}")
        near = self._inputs(self.straight if start is None else start)
        row = np.empty((*wanted.shape[:-1], self.layout.inputs))
        for place in self.layout.places:
            begin = near[..., place.columns]
            if isinstance(place.modules, DoubleOctahedra) and start is None:
                begin = None
            row[..., place.columns] = place.modules.solve(self._legs(place, wanted), begin)
        return row

    def _legs(self, place: Place, wanted: Array) -> Array:
        """Lengths of all legs of a set, static ones included, shape (..., M, legs), m."""
        legs = np.empty((*wanted.shape[:-1], *place.lengths.shape))
        legs[...] = place.modules.length_jacobian(place.straight)[0]
        legs[..., place.modules.actuated] = wanted[..., _moving(place)]
        return legs

    def _screws(self, x: Array, base: Array, local: Array) -> tuple[Array, Array, Array]:
        """Angular velocity, velocity of the module's top origin, and that origin, each shape (..., n, 3)."""
        angular, linear = np.empty((2, *x.shape, 3))
        R = base[..., :-1, :3, :3]
        top = (R @ local[..., :3, 3:])[..., 0] + base[..., :-1, :3, 3]
        for place in self.layout.places:
            spin, slide = place.modules.twist(place.take(x))
            turn = R[..., place.active, :, :]
            place.put(angular, np.swapaxes(turn @ spin, -1, -2))
            place.put(linear, np.swapaxes(turn @ slide, -1, -2))
        return angular, linear, top[..., self.layout.owner, :]

    def jacobian(self, q: ArrayLike) -> Array:
        """As `tool_jacobian`, the Jacobian alone."""
        return self.tool_jacobian(q)[2]

    def tool_jacobian(self, q: ArrayLike) -> tuple[Array, Array, Array]:
        """Tool and its geometric Jacobian in closed form (section 6.1.2).

        Args:
            q: Inputs, shape (..., n).

        Returns:
            Position, shape (..., 3), m, direction, shape (..., 3), and Jacobian, shape (..., 6, n):
            velocity of the tool point over angular velocity of the tip plate; all in frame G.
        """
        x = self._inputs(q)
        base, local = self._place_bases(x)
        angular, linear, top = self._screws(x, base, local)
        position, direction = self._tool(base)
        J = np.empty((*x.shape[:-1], 6, self.layout.inputs))
        J[..., :3, :] = np.swapaxes(linear + _cross(angular, position[..., None, :] - top), -1, -2)
        J[..., 3:, :] = np.swapaxes(angular, -1, -2)
        return position, direction, J

    def conventional_jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian of the tool with respect to the actuator lengths at inputs q.

        Returns:
            Shape (..., 6, J), in frame G.

        Raises:
            AssemblyError: As `lengths`.
            SingularPoseError: A module is singular; it is named.
        """
        return self.jacobian(q) @ self.input_rates(q)

    def node_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Positions of all nodes and their derivatives, in closed form.

        Args:
            q: Inputs, shape (..., n).

        Returns:
            Nodes, shape (..., N, 3), m, and dn/dq, shape (..., N, 3, n), in frame G.
        """
        x, layout = self._inputs(q), self.layout
        base, local = self._place_bases(x)
        nodes = self._nodes(x, base, local)
        angular, linear, top = self._screws(x, base, local)
        spin, slide, origin = (np.swapaxes(item, -1, -2)[..., None, :, :] for item in (angular, linear, top))
        arm = [nodes[..., axis, None] - origin[..., axis, :] for axis in range(3)]
        J = np.empty((*nodes.shape, layout.inputs))
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            velocity = slide[..., i, :] + spin[..., j, :] * arm[k] - spin[..., k, :] * arm[j]
            np.multiply(velocity, layout.moves, out=J[..., i, :])
        for place in layout.places:
            if place.modules.inner_count:
                own = place.modules.inner_derivative(place.take(x))
                turned = base[..., :-1, None, :3, :3][..., place.active, :, :, :] @ own
                rows, columns = place.nodes[:, :, None], place.columns[:, None, :]
                np.swapaxes(J, -1, -2)[..., rows, columns, :] = np.swapaxes(turned, -1, -2)
        return nodes, J


def _moving(place: Place) -> NDArray[np.intp]:
    """Actuators of a set among the chain's, in the order of its legs."""
    return place.lengths[place.modules.actuated]


def _cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; several times faster than NumPy's on small arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return result


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
