"""The kinematics of a batch of configurations: frames, velocities, nodes, legs. There is no other engine.

A configuration is one row of inputs, shape (n,), and has one row of leg lengths: the J actuators in the chain's order and
then the S static legs of octahedra. The slopes of a module's legs by the module's inputs are kept in blocks, one array for
each place of the layout. Nothing here raises: `valid` and its like mark what does not assemble, so that one bad trial does
not stop a batch. `Chain` raises. The kinds of modules fill the numbers of their modules, `composition` joins them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.kinematics import composition
from vgtsim.kinematics.modules import ModuleState

if TYPE_CHECKING:
    from vgtsim.kinematics.chain import Chain
    from vgtsim.kinematics.layout import Layout

Blocks = tuple[Array, ...]

_NO_MOTION = np.empty((0, 0, 6))


@dataclass(frozen=True, eq=False)
class State:
    """Kinematics of b configurations of inputs q, shape (b, n). Each property is worked out when it is first asked for."""

    chain: Chain
    q: Array

    def __post_init__(self) -> None:
        """Copy inputs that compiled functions do not take."""
        if not (self.q.flags.c_contiguous and self.q.flags.writeable):
            object.__setattr__(self, "q", np.array(self.q, order="C"))

    @property
    def _layout(self) -> Layout:
        return self.chain.layout

    @cached_property
    def parts(self) -> tuple[ModuleState, ...]:
        """The modules, one state for each place of the layout."""
        return tuple(ModuleState(place.take(self.q), place.modules) for place in self._layout.places)

    @cached_property
    def valid(self) -> Mask:
        """Which active modules assemble, on the straight arm's mode, shape (b, A); elsewhere no number means anything."""
        if self._layout.whole:
            return self.parts[0].valid
        whole = np.empty((len(self.q), len(self._layout.names)), dtype=bool)
        for place, part in zip(self._layout.places, self.parts, strict=True):
            whole[:, place.active] = part.valid
        return whole

    @property
    def assembles(self) -> Mask:
        """Which configurations are valid as a whole, shape (b,)."""
        return np.asarray(self.valid.all(axis=1))

    @cached_property
    def _moving(self) -> tuple[Array, Array, Array, Array]:
        """Bases, tops, and angular and linear velocities of what is beyond each module."""
        layout, shape = self._layout, (len(self.q), self._layout.inputs)
        if layout.whole:
            motion = self.parts[0].motion.reshape(*shape, 6)
        else:
            motion = np.empty((*shape, 6))
            for place, part in zip(layout.places, self.parts, strict=True):
                motion[:, place.columns] = part.motion
        return self._compose(motion)

    @cached_property
    def _standing(self) -> tuple[Array, Array]:
        """Bases and tops."""
        return self._moving[:2] if "_moving" in self.__dict__ else self._compose(_NO_MOTION)[:2]

    def _compose(self, motion: Array) -> tuple[Array, Array, Array, Array]:
        layout, count, active = self._layout, len(self.q), len(self._layout.names)
        if layout.whole:
            frame = self.parts[0].frame
        else:
            frame = np.empty((count, active, 3, 4))
            for place, part in zip(layout.places, self.parts, strict=True):
                frame[:, place.active] = part.frame
        base, top = np.empty((count, active + 1, 3, 4)), np.empty((count, active, 3, 4))
        angular, linear = np.empty((*motion.shape[:2], 3)), np.empty((*motion.shape[:2], 3))
        composition.compose(self.chain.root, layout.after, layout.owner, frame, motion, base, top, angular, linear)
        return base, top, angular, linear

    @property
    def base(self) -> Array:
        """Rotation beside centroid of the base of every active module and of the last face, in G, (b, A + 1, 3, 4)."""
        return self._standing[0]

    @property
    def top(self) -> Array:
        """The same of the top of every active module, shape (b, A, 3, 4)."""
        return self._standing[1]

    @property
    def motion(self) -> tuple[Array, Array, Array, Array]:
        """Mast flange, tops, and per input angular velocity of all beyond a module and velocity of its point at the origin of G.

        For compiled functions, in G; shapes (3, 4), (b, A, 3, 4), (b, n, 3) and (b, n, 3), m.
        """
        _, top, angular, linear = self._moving
        return self.chain.flange, top, angular, linear

    @cached_property
    def faces(self) -> Array:
        """Rotation beside origin of all K + 1 faces, the mast flange first, in G, shape (b, K + 1, 3, 4)."""
        layout = self._layout
        known = np.concatenate([np.broadcast_to(self.chain.mount[:3], (len(self.q), 1, 3, 4)), self.top], axis=1)
        return known.take(layout.face_from, axis=1) @ layout.face_offset

    @cached_property
    def nodes(self) -> Array:
        """Positions of all nodes in G, in the order of the truss, shape (b, N, 3), m."""
        layout = self._layout
        found = np.empty((len(self.q), len(layout.moves), 3))
        composition.seat_corners(self.chain.flange, layout.face_from, layout.corners, layout.spots, self.top, found)
        for place, part in zip(layout.places, self.parts, strict=True):
            if place.modules.inner_count:
                composition.seat_inner(self.base, place.active, place.nodes, part.inner, found)
        return found

    @cached_property
    def tool(self) -> tuple[Array, Array]:
        """Tool point, shape (b, 3), m, and outward unit normal of the tip plate, shape (b, 3), in G."""
        direction = self.base[:, -1, :, 2]
        return self.base[:, -1, :, 3] + self.chain.manipulator.tip_plate.tool_offset * direction, direction

    @cached_property
    def legs(self) -> Array:
        """Lengths of the actuators, then of the static legs as the inputs have them, shape (b, J + S), m."""
        layout = self._layout
        if layout.in_order:
            return self.parts[0].legs[0].reshape(len(self.q), -1)
        whole = np.empty((len(self.q), layout.actuators + len(layout.static)))
        for place, part in zip(layout.places, self.parts, strict=True):
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
        row = np.empty(self.q.shape)
        for place, block in zip(self._layout.places, self.blocks, strict=True):
            composition.pull(weight, place.legs, place.columns, block, row)
        return row

    def curve(self, weight: Array) -> Array:
        """Matrix of all inputs, shape (b, n, n): slopes of the legs squared, with weights of shape (b, J)."""
        whole = np.zeros((*self.q.shape, self._layout.inputs))
        for place, block in zip(self._layout.places, self.blocks, strict=True):
            composition.curve(weight, place.legs, place.columns, block, whole)
        return whole

    @cached_property
    def leg_slopes(self) -> Array:
        """Derivatives of all legs, static ones last, by all inputs, shape (b, J + S, n)."""
        layout = self._layout
        whole = np.zeros((len(self.q), layout.actuators + len(layout.static), layout.inputs))
        for place, block in zip(layout.places, self.blocks, strict=True):
            composition.spread(place.legs, place.columns, block, whole)
        return whole

    @cached_property
    def tool_jacobian(self) -> Array:
        """Velocity of the tool point over angular velocity of the tip plate per input, shape (b, 6, n), in G."""
        _, _, angular, linear = self._moving
        J = np.empty((len(self.q), 6, self._layout.inputs))
        composition.move_body(np.ascontiguousarray(self.tool[0]), angular, linear, J)
        return J

    @cached_property
    def node_jacobian(self) -> Array:
        """Derivatives of all nodes by the inputs, shape (b, N, 3, n), in G."""
        layout, (base, _, angular, linear) = self._layout, self._moving
        J = np.empty((*self.nodes.shape, layout.inputs))
        composition.move_nodes(self.nodes, layout.moves, angular, linear, J)
        for place, part in zip(layout.places, self.parts, strict=True):
            if place.modules.inner_count:
                composition.move_inner(base, place.active, place.nodes, place.columns, part.inner_slope, J)
        return J
