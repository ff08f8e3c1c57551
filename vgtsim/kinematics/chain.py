"""Chains of modules: every node, frame and Jacobian of an arm from the inputs of its active modules (chapter 4).

Active modules are those with actuators. Inputs q are canonical and stand in one row, shape (..., n), from the mast to the
tool: for a double octahedron its mid-plane (u_x, u_y, d), for a general one its angles phi_1 to phi_3, for a tetrahedron
its hinge angle theta, for an octahedron its pose (x, y, z, roll, pitch, yaw). Actuator lengths have shape (..., J), in the
order of the truss's actuators. Leading dimensions are batches. Positions are in frame G, the frame that the mount maps B_1
into.

`Chain.state` gives all kinematics of a batch at once and marks what does not assemble; the other methods take batches of
any shape and raise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Manipulator
from vgtsim.kinematics.composition import correct, spread_rates
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.layout import Layout, Place, make_layout
from vgtsim.kinematics.state import State
from vgtsim.kinematics.truss import Truss, make_truss

_SOLVED = 1e-9  # m: error of a length; the nodes of a long arm are a hundred times as far off
_MOST = 6  # Newton steps; from a step before, two are enough


@dataclass(frozen=True, eq=False)
class Chain:
    """Kinematics of one arm on its mount T_G_B1, shape (4, 4): frame B of the first module in frame G."""

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
    def seats(self) -> tuple[tuple[Place, int], ...]:
        """Place of each active module, from the mast to the tool, and which of the place's modules it is."""
        found = {int(a): (place, m) for place in self.layout.places for m, a in enumerate(place.active)}
        return tuple(found[a] for a in range(len(self.layout.names)))

    @property
    def leans(self) -> bool:
        """Whether all active modules are of one set whose inputs lean mid-planes, see `ModuleSet.leans`."""
        places = self.layout.places
        return len(places) == 1 and places[0].modules.leans

    @cached_property
    def root(self) -> Array:
        """Rotation beside centroid of the base of the first active module, in G, shape (3, 4)."""
        return (self.mount @ self.layout.root)[:3]

    @cached_property
    def flange(self) -> Array:
        """Rotation beside centroid of the mast flange in G, shape (3, 4): the mount without its last row."""
        return np.array(self.mount[:3])

    @cached_property
    def straight(self) -> Array:
        """Inputs of the straight working pose, shape (n,)."""
        row = np.empty(self.layout.inputs)
        for place in self.layout.places:
            row[place.columns] = place.modules.straight
        return row

    @cached_property
    def member_lengths(self) -> Array:
        """Lengths of all members in the straight pose, shape (M,), m; a tube keeps its length."""
        return self.truss.lengths(self.nodes(self.straight))

    @cached_property
    def straight_yaws(self) -> Array:
        """Turn about Z of the base of each active module of the straight arm, in B_1, shape (A,), rad.

        Octahedra turn what follows them by 60 degrees, and twisted sections by their twist.
        """
        R = self.mount[:3, :3].T @ self.frames(self.straight)[0]
        which = self.layout.modules
        return np.arctan2(R[which, 1, 0], R[which, 0, 0])

    @cached_property
    def stowed(self) -> Array:
        """Inputs of the pose that passes the riser, shape (n,): double octahedra stowed, other modules straight."""
        row = np.array(self.straight)
        if self.manipulator.stowed is not None:
            for place in self.layout.places:
                row[place.columns] = place.modules.stow(self.manipulator.stowed.cylinder_length)
        return row

    @cached_property
    def stroke(self) -> Array:
        """Least and greatest actuator lengths, shape (2, J), m."""
        truss = self.truss
        cylinders = [self.manipulator.cylinders[truss.members[i].section] for i in truss.actuated]
        return np.array([[item.retracted for item in cylinders], [item.extended for item in cylinders]])

    def state(self, q: ArrayLike) -> State:
        """Kinematics of a batch of inputs, shape (b, n), with marks in place of errors."""
        return State(self, np.asarray(q, float))

    def _state(self, q: ArrayLike) -> tuple[State, tuple[int, ...]]:
        """State of inputs of any batch shape (..., n), and that shape."""
        x = np.asarray(q, float)
        batch, inputs = x.shape[:-1], self.layout.inputs
        if x.shape[-1:] != (inputs,):
            raise ValueError(f"inputs of shape {x.shape}; {self.manipulator.name} takes (..., {inputs})")
        return State(self, x if len(batch) == 1 else x.reshape(math.prod(batch), inputs)), batch

    def _require(self, state: State, what: Literal["placed", "closed", "kept"]) -> State:
        """Give the state back, or raise the error of the first kind of module that lacks the mark."""
        for place, part in zip(self.layout.places, state.parts, strict=True):
            if not getattr(part, what).all():
                raise place.modules.refuse(part.x)
        return state

    def frames(self, q: ArrayLike) -> tuple[Array, Array]:
        """Frames of all faces at inputs (..., n): the mast flange and then the top of each module (4.3 and 4.7).

        R has shape (..., K + 1, 3, 3), P (..., K + 1, 3), m, in frame G.
        """
        state, batch = self._state(q)
        faces = self._require(state, "placed").faces
        return _shaped(faces[..., :3], batch), _shaped(faces[..., 3], batch)

    def nodes(self, q: ArrayLike) -> Array:
        """Positions of all nodes in G, in the order of the truss, shape (..., N, 3), m, at inputs (..., n).

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        state, batch = self._state(q)
        return _shaped(self._require(state, "closed").nodes, batch)

    def tool(self, q: ArrayLike) -> tuple[Array, Array]:
        """Tool point, shape (..., 3), m, and outward unit normal of the tip plate, (..., 3), in G, at inputs (..., n)."""
        state, batch = self._state(q)
        position, direction = self._require(state, "placed").tool
        return _shaped(position, batch), _shaped(direction, batch)

    def lengths(self, q: ArrayLike) -> Array:
        """Actuator lengths, shape (..., J), m, at inputs (..., n).

        Raises:
            AssemblyError: A mid-plane misses a longeron circle, or a pose is outside the subspace that an octahedron's
                static longerons leave; the module is named.
        """
        state, batch = self._state(q)
        return _shaped(self._require(state, "kept").lengths, batch)

    def length_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Actuator lengths, shape (..., J), m, and dl/dq, shape (..., J, n), at inputs (..., n); errors as `lengths`."""
        state, batch = self._state(q)
        J = self._require(state, "kept").leg_slopes[:, : self.layout.actuators]
        return _shaped(state.lengths, batch), _shaped(J, batch)

    def length_rates(self, q: ArrayLike, rates: ArrayLike) -> Array:
        """Speeds of the actuators, shape (..., J), at inputs and their rates, each of shape (..., n); errors as `lengths`."""
        state, batch = self._state(q)
        self._require(state, "kept")
        dx, row = self._state(rates)[0].q, np.empty(state.lengths.shape)
        for place, block in zip(self.layout.places, state.blocks, strict=True):
            row[:, place.moving] = (block @ place.take(dx)[..., None])[..., place.modules.actuated, 0]
        return _shaped(row, batch)

    def input_rates(self, q: ArrayLike | State) -> Array:
        """Rates of the inputs per unit rate of each actuator, static longerons held: the chain rule of section 3.2.

        dq/dl, shape (..., n, J), at inputs (..., n) or of a state.

        Raises:
            AssemblyError: As `lengths`.
            SingularPoseError: A module is singular; it is named.
        """
        state, batch = (q, (len(q.q),)) if isinstance(q, State) else self._state(q)
        self._require(state, "kept")
        return _shaped(self._input_rates(state), batch)

    def _input_rates(self, state: State) -> Array:
        rates = np.zeros((len(state.q), self.layout.inputs, self.layout.actuators))
        for place, slopes in zip(self.layout.places, state.blocks, strict=True):
            names = place.modules.names
            block = invert_sound(slopes, place.modules.usual_slopes, lambda where, names=names: names[where[-1]])
            spread_rates(place.lengths, place.columns, block, rates)
        return rates

    def inputs_from_lengths(self, actuators: ArrayLike, start: ArrayLike | None = None) -> Array:
        """Conventional forward solution: inputs, shape (..., n), of actuator lengths, shape (..., J), m (section 4.3).

        Every module stays on the assembly mode of its start, with proof; see `mode_following`. The start is inputs,
        shape (..., n), or absent for the straight pose.

        Raises:
            AssemblyError: A module does not assemble; it is named.
            SingularityError: A module would have to pass a singularity on the way.
        """
        wanted = np.asarray(actuators, float)
        if wanted.shape[-1:] != (self.layout.actuators,):
            taken = f"{self.manipulator.name} takes (..., {self.layout.actuators})"
            raise ValueError(f"lengths of shape {wanted.shape}; {taken}")
        row = np.empty((*wanted.shape[:-1], self.layout.inputs))
        for place in self.layout.places:
            own = place.modules
            legs = np.empty((*wanted.shape[:-1], *place.lengths.shape))
            legs[...] = own.straight_legs[0]  # static legs keep their length
            legs[..., own.actuated] = wanted[..., place.moving]
            row[..., place.columns] = own.solve(legs, None if start is None else np.asarray(start)[..., place.columns])
        return row

    def follow(self, actuators: Array, near: State) -> State | None:
        """State of actuator lengths, shape (J,), m, by Newton's method from a state of one row some millimetres away.

        None where the iteration does not arrive or leaves the assembly mode. `inputs_from_lengths` goes any way, with proof.
        """
        wanted, state = np.concatenate([actuators, self.layout.static]), near
        off = wanted - near.legs[0]
        for _ in range(_MOST):
            q = np.empty_like(near.q)
            for place, block in zip(self.layout.places, state.blocks, strict=True):
                if not correct(place.legs, place.columns, block, off, q[0]):
                    return None
            q += state.q
            state = self.state(q)
            if not state.assembles[0]:
                return None
            off = wanted - state.legs[0]
            if np.abs(off).max() < _SOLVED:
                return state
        return None

    def jacobian(self, q: ArrayLike) -> Array:
        """As `tool_jacobian`, the Jacobian alone."""
        return self.tool_jacobian(q)[2]

    def tool_jacobian(self, q: ArrayLike) -> tuple[Array, Array, Array]:
        """Tool, and its geometric Jacobian in closed form (section 6.1.2), at inputs (..., n).

        Returns:
            Position, shape (..., 3), m, direction, shape (..., 3), and Jacobian, shape (..., 6, n): velocity of the
            tool point over angular velocity of the tip plate; all in frame G.
        """
        state, batch = self._state(q)
        J = state.tool_jacobian  # first: what it needs tells the rest
        position, direction = self._require(state, "placed").tool
        return _shaped(position, batch), _shaped(direction, batch), _shaped(J, batch)

    def conventional_jacobian(self, q: ArrayLike) -> Array:
        """Jacobian of the tool by the actuator lengths, shape (..., 6, J), at inputs (..., n); errors as `input_rates`."""
        state, batch = self._state(q)
        self._require(state, "kept")
        return _shaped(state.tool_jacobian @ self._input_rates(state), batch)

    def node_jacobian(self, q: ArrayLike) -> tuple[Array, Array]:
        """Nodes, shape (..., N, 3), m, and dn/dq, shape (..., N, 3, n), in G, at inputs (..., n)."""
        state, batch = self._state(q)
        nodes = self._require(state, "closed").nodes
        return _shaped(nodes, batch), _shaped(state.node_jacobian, batch)


def _shaped(rows: Array, batch: tuple[int, ...]) -> Array:
    """Rows of a state, shape (b, ...), as a batch of any shape, shape (..., ...)."""
    return rows.reshape(*batch, *rows.shape[1:])


def hanging_mount(height: float, place: tuple[float, float] = (0.0, 0.0), turn: float = 0.0) -> Array:
    """T_G_B1, (4, 4), of a base face at a height and an x and y in G, m, Z of B_1 down, turned from above by an angle, rad."""
    mount = np.diag([1.0, -1.0, -1.0, 1.0])  # a half turn about X: Z of B_1 points down
    if turn:
        c, s = np.cos(turn), np.sin(turn)
        mount[:2, :2] = [[c, s], [s, -c]]
    mount[:3, 3] = *place, height
    return mount
