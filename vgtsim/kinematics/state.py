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
        chain: The arm.
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
        """R_BT beside P_BT of every active module, shape (b, A, 3, 4)."""
        layout = self._layout
        local = np.empty((len(self.q), len(layout.names), 3, 4))
        for place, part in zip(layout.places, self.parts, strict=True):
            R, P = part.transform
            if place.whole:
                local[..., :3], local[..., 3] = R, P
            else:
                local[..., :3][:, place.active], local[..., 3][:, place.active] = R, P
        return local

    @cached_property
    def base(self) -> Array:
        """Rotation beside centroid of the base of every active module and of the last face, in G, (b, A + 1, 3, 4)."""
        layout, local = self._layout, self._local
        turn, shift, turns = self.chain.steps
        step = np.empty(local.shape)
        step[..., :3] = local[..., :3] @ turn if turns else local[..., :3]
        step[..., 3] = (local[..., :3] @ shift[..., None])[..., 0] + local[..., 3]
        base = np.empty((len(self.q), len(layout.names) + 1, 3, 4))
        base[:, 0] = (self.chain.mount @ layout.root)[:3]
        for a in range(len(layout.names)):
            np.matmul(base[:, a, :, :3], step[:, a], out=base[:, a + 1])
            base[:, a + 1, :, 3] += base[:, a, :, 3]
        return base

    @cached_property
    def top(self) -> Array:
        """The same of the top of every active module, shape (b, A, 3, 4)."""
        top = self.base[:, :-1, :, :3] @ self._local
        top[..., 3] += self.base[:, :-1, :, 3]
        return top

    @cached_property
    def faces(self) -> Array:
        """Rotation beside origin of all K + 1 faces, the mast flange first, in G, shape (b, K + 1, 3, 4)."""
        layout = self._layout
        known = np.empty((len(self.q), len(layout.names) + 1, 3, 4))
        known[:, 0], known[:, 1:] = self.chain.mount[:3], self.top
        source, offset = np.take(known, layout.face_from, axis=1), layout.face_offset[:, :3]
        if np.all(offset[:, :, :3] == np.eye(3)):  # sections without tilt or twist: faces are only shifted
            source[..., 3] = place_points(offset[:, None, :, 3], source)[..., 0, :]
            return source
        faces = source[..., :3] @ offset
        faces[..., 3] += source[..., 3]
        return faces

    def face(self, face: int) -> tuple[Array, Array]:
        """Frame of one face: 0 for the mast flange, k for the top of module k.

        Returns:
            R, shape (b, 3, 3), and P, shape (b, 3), m, in frame G.
        """
        layout = self._layout
        if face == len(layout.face_from) - 1:
            return self.base[:, -1, :, :3], self.base[:, -1, :, 3]
        source, offset = int(layout.face_from[face]), layout.face_offset[face]
        if source == 0:
            T, count = self.chain.mount @ offset, len(self.q)
            return np.broadcast_to(T[:3, :3], (count, 3, 3)), np.broadcast_to(T[:3, 3], (count, 3))
        from_top = self.top[:, source - 1]
        return from_top[..., :3] @ offset[:3, :3], from_top[..., :3] @ offset[:3, 3] + from_top[..., 3]

    @cached_property
    def nodes(self) -> Array:
        """Positions of all nodes in G, in the order of the truss, shape (b, N, 3), m."""
        layout, count = self._layout, len(self.q)
        found = [place_points(layout.corners, self.faces).reshape(count, -1, 3)]
        for place, part in zip(layout.places, self.parts, strict=True):
            if place.modules.inner_count:
                base = self.base[:, :-1] if place.whole else self.base[:, place.active]
                found.append(place_points(part.inner, base).reshape(count, -1, 3))
        return np.take(np.concatenate(found, axis=1), layout.order, axis=1)

    @cached_property
    def tool(self) -> tuple[Array, Array]:
        """Tool point, shape (b, 3), m, and outward unit normal of the tip plate, shape (b, 3), in G."""
        direction = self.base[:, -1, :, 2]
        return self.base[:, -1, :, 3] + self.chain.manipulator.tip_plate.tool_offset * direction, direction

    @cached_property
    def angular(self) -> Array:
        """Angular velocity of all beyond a module per input, shape (b, n, 3), in G."""
        return self._turn(tuple(part.twist[0] for part in self.parts))

    @cached_property
    def linear(self) -> Array:
        """Velocity of that body's point at the origin of G per input, shape (b, n, 3), m."""
        return self._slide - cross(self.angular, self._top_origins)

    @cached_property
    def _slide(self) -> Array:
        """Velocity of the origin of the module's top per input, shape (b, n, 3), m."""
        return self._turn(tuple(part.twist[1] for part in self.parts))

    @property
    def _top_origins(self) -> Array:
        """Origin of the top of each input's module, shape (b, n, 3), m."""
        return np.take(self.top[..., 3], self._layout.owner, axis=1)

    def _turn(self, vectors: tuple[Array, ...]) -> Array:
        """Vectors of all places' inputs, shape (b, M, inputs, 3), turned into G, in the chain's order, (b, n, 3)."""
        turn, count = self.base[:, :-1], len(self.q)
        if len(vectors) == 1:
            return turn_vectors(vectors[0], turn).reshape(count, -1, 3)
        whole = np.empty((count, self._layout.inputs, 3))
        for place, own in zip(self._layout.places, vectors, strict=True):
            whole[:, place.columns] = turn_vectors(own, turn[:, place.active])
        return whole

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
        arm, angular, slide = self.tool[0][:, None] - self._top_origins, self.angular, self._slide
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            J[:, i] = slide[..., i] + angular[..., j] * arm[..., k] - angular[..., k] * arm[..., j]
            J[:, 3 + i] = angular[..., i]
        return J

    @cached_property
    def node_jacobian(self) -> Array:
        """Derivatives of all nodes by the inputs, shape (b, N, 3, n), in G."""
        layout = self._layout
        spin, slide = (np.swapaxes(item, -1, -2)[:, None] for item in (self.angular, self.linear))
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


def turn_vectors(vectors: Array, frames: Array) -> Array:
    """Vectors, shape (..., k, 3), turned by frames, shape (..., 3, 4): much faster than products of 3 by 3 matrices."""
    turned = vectors[..., :1] * frames[..., None, :, 0]
    turned += vectors[..., 1:2] * frames[..., None, :, 1]
    turned += vectors[..., 2:] * frames[..., None, :, 2]
    return turned


def place_points(points: Array, frames: Array) -> Array:
    """Points, shape (..., k, 3), m, of frames, shape (..., 3, 4): a rotation beside an origin."""
    placed = turn_vectors(points, frames)
    placed += frames[..., None, :, 3]
    return placed


def cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; several times faster than NumPy's on small arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return result
