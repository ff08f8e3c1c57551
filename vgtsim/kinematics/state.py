"""The kinematics of a batch of configurations: frames, velocities, nodes, legs. There is no other engine.

A configuration is one row of inputs, shape (n,), and has one row of leg lengths: the J actuators in the chain's order and
then the S static legs of octahedra. The slopes of a module's legs by the module's inputs are kept in blocks, one array for
each place of the layout; only the product along the arm goes module by module. Nothing here raises: `valid` and its like
mark what does not assemble, so that one bad trial does not stop a batch. `Chain` raises.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.modules import ModuleState

if TYPE_CHECKING:
    from vgtsim.kinematics.chain import Chain
    from vgtsim.kinematics.layout import Layout

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Blocks = tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class State:
    """Kinematics of b configurations. Each property is worked out when it is first asked for.

    Attributes:
        q: Inputs, shape (b, n).
    """

    chain: Chain
    q: Array

    @property
    def _layout(self) -> Layout:
        return self.chain.layout

    @cached_property
    def parts(self) -> tuple[ModuleState, ...]:
        """The modules, one state for each place of the layout."""
        return tuple(place.modules.at(place.take(self.q)) for place in self._layout.places)

    @cached_property
    def valid(self) -> Mask:
        """Which active modules assemble, on the straight arm's mode, shape (b, A); elsewhere no number means anything."""
        whole = np.empty((len(self.q), len(self._layout.names)), dtype=bool)
        for place, part in zip(self._layout.places, self.parts, strict=True):
            whole[:, place.active] = part.valid
        return whole

    @property
    def assembles(self) -> Mask:
        """Which configurations are valid as a whole, shape (b,)."""
        return np.all(self.valid, axis=1)

    @cached_property
    def _local(self) -> Array:
        """T_BT of every active module, shape (b, A, 4, 4)."""
        layout = self._layout
        local = np.zeros((len(self.q), len(layout.names), 4, 4))
        local[..., 3, 3] = 1.0
        for place, part in zip(layout.places, self.parts, strict=True):
            R, P = part.transform
            if place.whole:
                local[..., :3, :3], local[..., :3, 3] = R, P
            else:
                local[..., :3, :3][:, place.active], local[..., :3, 3][:, place.active] = R, P
        return local

    @cached_property
    def base(self) -> Array:
        """Rotation beside centroid of the base of every active module and of the last face, in G, (b, A + 1, 3, 4)."""
        layout = self._layout
        base = np.empty((len(self.q), len(layout.names) + 1, 3, 4))
        base[:, 0] = self.chain.root
        along, steps = base.swapaxes(0, 1), (self._local @ layout.after).swapaxes(0, 1)
        for own, step, following in zip(along[:-1], steps, along[1:], strict=True):
            np.matmul(own, step, out=following)
        return base

    @cached_property
    def top(self) -> Array:
        """The same of the top of every active module, shape (b, A, 3, 4)."""
        return self.base[:, :-1] @ self._local

    @cached_property
    def _origins(self) -> Array:
        """Origins of the tops of the active modules, shape (b, A, 3), m: less work than the whole of `top`."""
        base = self.base[:, :-1]
        return (base[..., :3] @ self._local[..., :3, 3:])[..., 0] + base[..., 3]

    @cached_property
    def faces(self) -> Array:
        """Rotation beside origin of all K + 1 faces, the mast flange first, in G, shape (b, K + 1, 3, 4)."""
        layout = self._layout
        known = np.empty((len(self.q), len(layout.names) + 1, 3, 4))
        known[:, 0] = self.chain.mount[:3]
        np.matmul(self.base[:, :-1], self._local, out=known[:, 1:])
        return known.take(layout.face_from, axis=1) @ layout.face_offset

    def face(self, face: int) -> tuple[Array, Array]:
        """Frame of one face in G: 0 for the mast flange, k for the top of module k: R, (b, 3, 3), and P, (b, 3), m."""
        layout = self._layout
        source, offset = int(layout.face_from[face]), layout.face_offset[face]
        if face == len(layout.face_from) - 1:
            frame = self.base[:, -1]
        elif source == 0:
            frame = np.broadcast_to((self.chain.mount @ offset)[:3], (len(self.q), 3, 4))
        else:
            frame = self.top[:, source - 1] @ offset
        return frame[..., :3], frame[..., 3]

    @cached_property
    def nodes(self) -> Array:
        """Positions of all nodes in G, in the order of the truss, shape (b, N, 3), m."""
        layout, count = self._layout, len(self.q)
        corners = layout.corners @ self.faces.swapaxes(-1, -2)
        found = [corners.reshape(count, -1, 3)]
        for place, part in zip(layout.places, self.parts, strict=True):
            if place.modules.inner_count:
                base = self.base[:, :-1] if place.whole else self.base[:, place.active]
                inner = part.inner @ base[..., :3].swapaxes(-1, -2)
                inner += base[..., None, :, 3]
                found.append(inner.reshape(count, -1, 3))
        if len(found) == 1 and layout.in_order:
            return found[0]
        return np.concatenate(found, axis=1).take(layout.order, axis=1)

    @cached_property
    def tool(self) -> tuple[Array, Array]:
        """Tool point, shape (b, 3), m, and outward unit normal of the tip plate, shape (b, 3), in G."""
        direction = self.base[:, -1, :, 2]
        return self.base[:, -1, :, 3] + self.chain.manipulator.tip_plate.tool_offset * direction, direction

    @cached_property
    def angular(self) -> Array:
        """Angular velocity of all beyond a module per input, shape (b, n, 3), in G."""
        return self._spin.swapaxes(1, 2)

    @cached_property
    def linear(self) -> Array:
        """Velocity of that body's point at the origin of G per input, shape (b, n, 3), m."""
        return self._move(-self._origins).swapaxes(1, 2)

    @cached_property
    def _spin(self) -> Array:
        """`angular` coordinate by coordinate, shape (b, 3, n)."""
        return self._turn(tuple(part.twist[0] for part in self.parts))

    @cached_property
    def _slide(self) -> Array:
        """Velocity of the origin of the module's top per input, shape (b, 3, n), m."""
        return self._turn(tuple(part.twist[1] for part in self.parts))

    def _turn(self, vectors: tuple[Array, ...]) -> Array:
        """Vectors of all places' inputs, shape (b, M, inputs, 3), turned into G, in the chain's order, (b, 3, n)."""
        turn, count = self.base[:, :-1, :, :3], len(self.q)
        whole = np.empty((count, 3, self._layout.inputs))
        for place, own in zip(self._layout.places, vectors, strict=True):
            if place.whole:
                into = whole.reshape(count, 3, *place.columns.shape).swapaxes(1, 2)
                np.matmul(turn, own.swapaxes(2, 3), out=into)
            else:
                whole[:, :, place.columns] = (turn[:, place.active] @ own.swapaxes(2, 3)).swapaxes(1, 2)
        return whole

    def _move(self, arm: Array, out: Array | None = None) -> Array:
        """Velocity per input, shape (b, 3, n), m, of points an arm, shape (b, A, 3), from the tops of the modules."""
        spin, slide = self._spin, self._slide
        arm = arm.swapaxes(1, 2).take(self._layout.owner, axis=2)
        J = np.empty(spin.shape) if out is None else out
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            own = np.multiply(spin[:, j], arm[:, k], out=J[:, i])
            own -= spin[:, k] * arm[:, j]
            own += slide[:, i]
        return J

    @cached_property
    def legs(self) -> Array:
        """Lengths of the actuators, then of the static legs as the inputs have them, shape (b, J + S), m."""
        whole = np.empty((len(self.q), self._layout.actuators + len(self._layout.static)))
        for place, part in zip(self._layout.places, self.parts, strict=True):
            whole[:, place.legs] = part.legs[0]
        return whole

    @property
    def lengths(self) -> Array:
        """Lengths of the actuators alone, shape (b, J), m."""
        return self.legs[:, : self._layout.actuators]

    @property
    def blocks(self) -> Blocks:
        """Derivatives of legs by their module's inputs, for each place of shape (b, M, legs, inputs)."""
        return tuple(part.legs[1] for part in self.parts)

    def pull(self, weight: Array) -> Array:
        """Slope by the inputs, shape (b, n), of legs weighted with shape (b, J) or (b, J + S)."""
        whole = self._with_static(weight)
        found = [
            (whole[:, place.legs][..., None, :] @ block)[..., 0, :]
            for place, block in zip(self._layout.places, self.blocks, strict=True)
        ]
        if len(found) == 1:
            return found[0].reshape(len(whole), -1)
        row = np.empty(self.q.shape)
        for place, own in zip(self._layout.places, found, strict=True):
            row[:, place.columns] = own
        return row

    def curve(self, weight: Array) -> Blocks:
        """BᵀWB of every module's block with weights of shape (b, J), shape (b, M, inputs, inputs) for each place."""
        whole = self._with_static(weight)
        return tuple(
            np.swapaxes(block, 2, 3) @ (whole[:, place.legs][..., None] * block)
            for place, block in zip(self._layout.places, self.blocks, strict=True)
        )

    @cached_property
    def leg_slopes(self) -> Array:
        """Derivatives of all legs, static ones last, by all inputs, shape (b, J + S, n)."""
        whole = np.zeros((*self.legs.shape, self._layout.inputs))
        for place, block in zip(self._layout.places, self.blocks, strict=True):
            whole[:, place.legs[:, :, None], place.columns[:, None, :]] = block
        return whole

    def spread(self, curves: Blocks) -> Array:
        """Matrix of all inputs, shape (b, n, n), of modules' blocks, shape (b, M, inputs, inputs) for each place."""
        if len(curves) == 1:
            batch, count, size = curves[0].shape[:3]
            full = np.zeros((batch, count, size, count, size))
            place = np.arange(count)
            full[:, place, :, place, :] = np.moveaxis(curves[0], 1, 0)
            return full.reshape(batch, count * size, count * size)
        whole = np.zeros((*self.q.shape, self._layout.inputs))
        for place, own in zip(self._layout.places, curves, strict=True):
            whole[:, place.columns[:, :, None], place.columns[:, None, :]] = own
        return whole

    def _with_static(self, weight: Array) -> Array:
        missing = self._layout.actuators + len(self._layout.static) - weight.shape[1]
        return np.concatenate([weight, np.zeros((len(weight), missing))], axis=1) if missing else weight

    @cached_property
    def tool_jacobian(self) -> Array:
        """Velocity of the tool point over angular velocity of the tip plate per input, shape (b, 6, n), in G."""
        J = np.empty((len(self.q), 6, self._layout.inputs))
        self._move(self.tool[0][:, None] - self._origins, J[:, :3])
        J[:, 3:] = self._spin
        return J

    @cached_property
    def node_jacobian(self) -> Array:
        """Derivatives of all nodes by the inputs, shape (b, N, 3, n), in G."""
        layout = self._layout
        spin, slide = self._spin[:, None], self.linear.swapaxes(1, 2)[:, None]
        arm = [self.nodes[..., axis, None] for axis in range(3)]
        J = np.empty((*self.nodes.shape, layout.inputs))
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            velocity = slide[..., i, :] + spin[..., j, :] * arm[k] - spin[..., k, :] * arm[j]
            np.multiply(velocity, layout.moves, out=J[..., i, :])
        for place, part in zip(layout.places, self.parts, strict=True):
            if place.modules.inner_count:
                turned = self.base[:, place.active, None, :, :3] @ part.inner_slope
                rows, columns = place.nodes[:, :, None], place.columns[:, None, :]
                np.swapaxes(J, -1, -2)[:, rows, columns] = np.swapaxes(turned, -1, -2)
        return J
