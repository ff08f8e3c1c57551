"""Constants that a chain works out once from its description: sets of modules, transforms, sources of the nodes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import Manipulator
from vgtsim.kinematics.closure import triangle_nodes
from vgtsim.kinematics.modules import KINDS, ModuleSet, kind_of
from vgtsim.kinematics.truss import Truss


@dataclass(frozen=True)
class Place:
    """Where the modules of a set stand in a chain.

    Attributes:
        modules: The set.
        active: Indices among the active modules, shape (M,).
        whole: Whether they are all of the active modules.
        columns: Of the chain's inputs, shape (M, inputs).
        lengths: Of the chain's actuators, shape (M, legs); -1 for static legs.
        legs: Of all legs of the chain, actuators and then static ones, shape (M, legs).
        nodes: Of the inner nodes, shape (M, inner_count).
    """

    modules: ModuleSet
    active: Index
    whole: bool
    columns: Index
    lengths: Index
    legs: Index
    nodes: Index

    @property
    def moving(self) -> Index:
        """Actuators of the set among the chain's, in the order of its legs."""
        return self.lengths[self.modules.actuated]

    def take(self, x: Array) -> Array:
        """Inputs of the set, shape (..., M, inputs), of those of the chain, shape (..., n)."""
        shape = (*x.shape[:-1], *self.columns.shape)
        return (x if self.whole else x.take(self.columns.ravel(), axis=-1)).reshape(shape)


@dataclass(frozen=True)
class Layout:
    """A chain's constants; A active modules, K modules, n inputs, J actuators, S static legs, N nodes.

    Active modules are those with actuators.

    Attributes:
        places: One for each kind of active module, those with a joint offset apart.
        names: Of the active modules.
        modules: Index of each active module among all, shape (A,).
        inputs: n.
        actuators: J.
        owner: Active module of each input, shape (n,).
        static: Lengths of the static legs, shape (S,), m.
        root: T from the base of the first active module to the mount, shape (4, 4).
        after: Rotation beside origin, from the base of the next active module (of the last face, for the last) to the top of
            each, shape (A, 3, 4).
        face_from: For the mast flange and each module's top face: 0 for the mount, a + 1 for the top of active module
            a, shape (K + 1,).
        face_offset: The face's frame in that frame, shape (K + 1, 4, 4).
        corners: Node, and face, of each corner that is a node of its own, shape (C, 2).
        spots: Of each in the frame that `face_from` names, shape (C, 3), m.
        moves: Number of the first inputs that move a node as a point of the body beyond their modules, shape (N,).
    """

    places: tuple[Place, ...]
    names: tuple[str, ...]
    modules: Index
    inputs: int
    actuators: int
    owner: Index
    static: Array
    root: Array
    after: Array
    face_from: Index
    face_offset: Array
    corners: Index
    spots: Array
    moves: Index

    @property
    def whole(self) -> bool:
        """Whether all active modules are of one place."""
        return len(self.places) == 1

    @cached_property
    def in_order(self) -> bool:
        """Whether all legs are those of one place, one module after the other."""
        legs = self.places[0].legs.ravel()
        return self.whole and np.array_equal(legs, np.arange(legs.size))


def make_layout(manipulator: Manipulator, truss: Truss) -> Layout:
    """Work the constants out; an AssemblyError or a TrussError where a straight module or a static section does not hold."""
    modules, side = manipulator.modules, manipulator.face_side
    active = np.array([k for k, module in enumerate(modules) if kind_of(module).make_set], dtype=int)
    places = _make_places(manipulator, truss, active)
    sizes = np.zeros(len(active), dtype=int)
    for place in places:
        sizes[place.active] = place.modules.inputs
    owner = np.repeat(np.arange(len(active)), sizes)
    root, after, face_from, offset = _find_transforms(manipulator)
    corners = _find_corners(manipulator, truss)
    faces = np.array(
        [triangle_nodes(sides) for sides in (modules[0].faces(side)[0], *(part.faces(side)[1] for part in modules))]
    )
    spots = np.empty((len(corners), 3))
    for spot, (_, face, corner) in zip(spots, corners, strict=True):
        spot[:] = offset[face, :3, :3] @ faces[face, corner] + offset[face, :3, 3]
    moves = np.searchsorted(active[owner], truss.node_module, side="right")
    for place in places:
        moves[place.nodes] = place.columns[:, :1]
    static = [place.modules.straight_legs[0][~place.modules.actuated] for place in places]
    return Layout(
        places=tuple(places),
        names=tuple(modules[k].name for k in active),
        modules=active,
        inputs=len(owner),
        actuators=len(truss.actuated),
        owner=owner,
        static=np.concatenate([*static, np.empty(0)]),
        root=root,
        after=np.ascontiguousarray(after[:, :3]),
        face_from=face_from,
        face_offset=offset,
        corners=np.ascontiguousarray(corners[:, :2]),
        spots=spots,
        moves=moves,
    )


def _make_places(manipulator: Manipulator, truss: Truss, active: Index) -> list[Place]:
    """A place for each kind of active module, those with a joint offset apart, in the order of `KINDS`."""
    modules, order = manipulator.modules, list(KINDS)
    keys = [(order.index(modules[k].kind), modules[k].offset > 0) for k in active]
    sets = {}
    for key in sorted(set(keys)):
        which = np.array([a for a, own in enumerate(keys) if own == key])
        make = kind_of(modules[active[which[0]]]).make_set
        assert make is not None  # it is active
        sets[key] = (which, make([modules[k] for k in active[which]], manipulator.face_side))
    first = np.concatenate([[0], np.cumsum([sets[key][1].inputs for key in keys])]).astype(int)
    places, count = [], len(truss.actuated)
    for which, own in sets.values():
        lengths = np.full(own.actuated.shape, -1, dtype=int)
        for m, k in enumerate(active[which]):
            lengths[m, own.actuated[m]] = np.flatnonzero(truss.module[truss.actuated] == k)
        legs = lengths.copy()
        fixed = lengths < 0
        legs[fixed] = count + np.arange(int(fixed.sum()))
        count += int(fixed.sum())
        inner = [np.flatnonzero(truss.node_module == k)[: own.inner_count] for k in active[which]]
        places.append(
            Place(
                modules=own,
                active=which,
                whole=len(sets) == 1,
                columns=first[which][:, None] + np.arange(own.inputs),
                lengths=lengths,
                legs=legs,
                nodes=np.array(inner, dtype=int).reshape(len(which), -1),
            )
        )
    return places


def _find_transforms(manipulator: Manipulator) -> tuple[Array, Array, Index, Array]:
    """Absorb the static modules: `root`, `after`, `face_from` and `face_offset` of the layout."""
    here, source = np.eye(4), 0
    gathered, origin, offset = [], [0], [np.eye(4)]
    for module in manipulator.modules:
        if (make := kind_of(module).make_static) is None:
            gathered.append(here)
            here, source = np.eye(4), source + 1
        else:
            here = here @ make(module, manipulator.face_side).transform
        origin.append(source)
        offset.append(here)
    whole = np.array([*gathered, here])
    return whole[0], whole[1:], np.array(origin), np.array(offset)


def _find_corners(manipulator: Manipulator, truss: Truss) -> Index:
    """Node, face and corner of that face for each node on a face, shape (C, 3)."""
    rows = [(node, 0, node) for node in range(3)]
    for k, module in enumerate(manipulator.modules):
        corners, own = kind_of(module).top, np.flatnonzero(truss.node_module == k)
        rows += [(node, k + 1, corner) for node, corner in zip(own[-len(corners) :].tolist(), corners, strict=True)]
    return np.array(rows, dtype=int)
