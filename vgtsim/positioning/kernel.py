"""All that one iteration needs of an arm's kinematics, for all modules and a batch of configurations at once.

Inside this room a configuration is one row of inputs, shape (n,), and one row of leg lengths: the J actuators in the
chain's order and then the S static legs of octahedral modules. What a module's legs do by its own inputs is kept in
blocks, one array for each kind of module; only the product along the arm goes module by module.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.positioning.parts import Part, solver

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Blocks = tuple[Array, ...]


@dataclass(frozen=True)
class State:
    """Kinematics of a batch of configurations.

    Attributes:
        q: Inputs, shape (b, n).
        base: Rotation and centroid of the base of every active module and of the last face, in frame G, (b, A + 1, 3, 4).
        top: Of the top of every active module, shape (b, A, 3, 4).
        angular: Angular velocity of all beyond a module per input, shape (b, n, 3), in G.
        linear: Velocity of the point at the origin of G, shape (b, n, 3), m.
        legs: Lengths of the actuators, then of the static legs, shape (b, J + S), m.
        blocks: Their derivatives by the module's own inputs: for each kind, shape (b, M, legs, inputs).
        valid: Which active modules assemble, on the straight arm's mode, shape (b, A); where one does not, all values
            mean nothing.
    """

    q: Array
    base: Array
    top: Array
    angular: Array
    linear: Array
    legs: Array
    blocks: Blocks
    valid: NDArray[np.bool_]

    @property
    def assembles(self) -> NDArray[np.bool_]:
        """Which configurations assemble, shape (b,)."""
        return np.all(self.valid, axis=1)


@dataclass(frozen=True)
class Kernel:
    """An arm, ready for batches.

    Attributes:
        chain: The arm.
    """

    chain: Chain

    @cached_property
    def static(self) -> Array:
        """Lengths that the static legs have, shape (S,), m."""
        found = [
            place.modules.length_jacobian(place.straight)[0][~place.modules.actuated]
            for place in self.chain.layout.places
        ]
        return np.concatenate(found)

    @cached_property
    def leg_index(self) -> tuple[Index, ...]:
        """For each kind the column of every leg in a state's `legs`, shape (M, legs)."""
        count, found = self.chain.layout.actuators, []
        for place in self.chain.layout.places:
            index = place.lengths.copy()
            fixed = index < 0
            index[fixed] = count + np.arange(int(fixed.sum()))
            count += int(fixed.sum())
            found.append(index)
        return tuple(found)

    @cached_property
    def _solvers(self) -> list:  # type: ignore[type-arg]
        return [solver(place) for place in self.chain.layout.places]

    @cached_property
    def _after(self) -> tuple[Array, Array, bool]:
        """Rotation and shift from the top of each active module to the next base, and whether any rotates."""
        after = self.chain.layout.after
        return after[:, :3, :3], after[:, :3, 3], bool(np.any(after[:, :3, :3] != np.eye(3)))

    def state(self, q: ArrayLike) -> State:
        """Kinematics of inputs of shape (b, n)."""
        x = np.asarray(q, float)
        places = self.chain.layout.places
        parts = [solve(place.take(x)) for place, solve in zip(places, self._solvers, strict=True)]
        base, local = self._bases(parts, len(x))
        turn = base[:, :-1, :, :3]
        top = np.empty(local.shape)
        np.matmul(turn, local, out=top)
        top[..., 3] += base[:, :-1, :, 3]
        angular, linear = (
            self._put([part.spin for part in parts], turn),
            self._put([part.slide for part in parts], turn),
        )
        linear = linear - cross(angular, top[..., 3][:, self.chain.layout.owner])
        legs = self._legs([part.length for part in parts])
        valid = np.empty((len(x), len(self.chain.layout.names)), dtype=bool)
        for place, part in zip(places, parts, strict=True):
            valid[:, place.active] = part.valid
        return State(x, base, top, angular, linear, legs, tuple(part.block for part in parts), valid)

    def _bases(self, parts: list[Part], count: int) -> tuple[Array, Array]:
        """Bases, shape (b, A + 1, 3, 4), and T_BT, shape (b, A, 3, 4)."""
        layout, (turn, shift, turns) = self.chain.layout, self._after
        local = np.empty((count, len(layout.names), 3, 4))
        for place, part in zip(layout.places, parts, strict=True):
            local[..., :3][:, place.active] = part.R
            local[..., 3][:, place.active] = part.P
        step = np.empty(local.shape)
        step[..., :3] = local[..., :3] @ turn if turns else local[..., :3]
        step[..., 3] = (local[..., :3] @ shift[..., None])[..., 0] + local[..., 3]
        base = np.empty((count, len(layout.names) + 1, 3, 4))
        base[:, 0] = (self.chain.mount @ layout.root)[:3]
        for a in range(len(layout.names)):
            np.matmul(base[:, a, :, :3], step[:, a], out=base[:, a + 1])
            base[:, a + 1, :, 3] += base[:, a, :, 3]
        return base, local

    def _put(self, vectors: list[Array], turn: Array) -> Array:
        """Vectors of all kinds' inputs, shape (b, M, inputs, 3), turned into G, in the chain's order, (b, n, 3)."""
        places = self.chain.layout.places
        if len(places) == 1:
            found = vectors[0] @ np.swapaxes(turn, -1, -2)
            return found.reshape(len(found), -1, 3)
        whole = np.empty((len(turn), self.chain.layout.inputs, 3))
        for place, own in zip(places, vectors, strict=True):
            place.put(whole, own @ np.swapaxes(turn[:, place.active], -1, -2))
        return whole

    def _legs(self, lengths: list[Array]) -> Array:
        whole = np.empty((len(lengths[0]), self.chain.layout.actuators + len(self.static)))
        for index, own in zip(self.leg_index, lengths, strict=True):
            whole[:, index] = own
        return whole

    def face(self, state: State, face: int) -> tuple[Array, Array]:
        """Frame of a face: 0 for the mast flange, k for the top of module k.

        Returns:
            R, shape (b, 3, 3), and P, shape (b, 3), m, in frame G.
        """
        layout = self.chain.layout
        if face == len(layout.face_from) - 1:
            return state.base[:, -1, :, :3], state.base[:, -1, :, 3]
        source, offset = int(layout.face_from[face]), layout.face_offset[face]
        if source == 0:
            T = self.chain.mount @ offset
            count = len(state.q)
            return np.broadcast_to(T[:3, :3], (count, 3, 3)), np.broadcast_to(T[:3, 3], (count, 3))
        from_top = state.top[:, source - 1]
        return from_top[..., :3] @ offset[:3, :3], from_top[..., :3] @ offset[:3, 3] + from_top[..., 3]

    def pull(self, blocks: Blocks, weight: Array) -> Array:
        """Slope by the inputs, shape (b, n), of legs weighted with shape (b, J) or (b, J + S)."""
        whole = self._with_static(weight)
        found = []
        for index, block in zip(self.leg_index, blocks, strict=True):
            found.append((whole[:, index][..., None, :] @ block)[..., 0, :])
        return self._row(found)

    def curve(self, blocks: Blocks, weight: Array) -> Blocks:
        """BᵀWB of every module's block with weights of shape (b, J), shape (b, M, inputs, inputs) for each kind."""
        whole = self._with_static(weight)
        return tuple(
            np.swapaxes(block, 2, 3) @ (whole[:, index][..., None] * block)
            for index, block in zip(self.leg_index, blocks, strict=True)
        )

    def dense(self, blocks: Blocks) -> Array:
        """Derivatives of all legs, static ones last, by all inputs, shape (b, J + S, n)."""
        layout = self.chain.layout
        whole = np.zeros((len(blocks[0]), layout.actuators + len(self.static), layout.inputs))
        for place, index, block in zip(layout.places, self.leg_index, blocks, strict=True):
            whole[:, index[:, :, None], place.columns[:, None, :]] = block
        return whole

    def spread(self, curves: Blocks) -> Array:
        """Matrix of all inputs, shape (b, n, n), of modules' own, shape (b, M, inputs, inputs) for each kind."""
        layout = self.chain.layout
        if len(layout.places) == 1:
            batch, count, size = curves[0].shape[:3]
            full = np.zeros((batch, count, size, count, size))
            place = np.arange(count)
            full[:, place, :, place, :] = np.moveaxis(curves[0], 1, 0)
            return full.reshape(batch, count * size, count * size)
        whole = np.zeros((len(curves[0]), layout.inputs, layout.inputs))
        for place, own in zip(layout.places, curves, strict=True):
            whole[:, place.columns[:, :, None], place.columns[:, None, :]] = own
        return whole

    def _row(self, parts: list[Array]) -> Array:
        """Inputs of all kinds, shape (b, M, inputs), in the chain's order, shape (b, n)."""
        places = self.chain.layout.places
        if len(places) == 1:
            return parts[0].reshape(len(parts[0]), -1)
        whole = np.empty((len(parts[0]), self.chain.layout.inputs))
        for place, own in zip(places, parts, strict=True):
            whole[:, place.columns] = own
        return whole

    def _with_static(self, weight: Array) -> Array:
        missing = self.chain.layout.actuators + len(self.static) - weight.shape[1]
        return np.concatenate([weight, np.zeros((len(weight), missing))], axis=1) if missing else weight


def cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis, shapes (..., 3); `np.cross` takes three times as long."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)
