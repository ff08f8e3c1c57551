"""What a chain works out once from its description: sets of modules, constant transforms, sources of the nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import (
    DoubleOctahedral,
    GeneralDoubleOctahedral,
    Module,
    Octahedral,
    Prism,
    SectionModule,
    Tetrahedral,
    joint_offset,
)
from vgtsim.errors import TrussError
from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics import double_octahedron_general as general
from vgtsim.kinematics import octahedron as single
from vgtsim.kinematics import tetrahedron as tetra
from vgtsim.kinematics.double_octahedra import DoubleOctahedra
from vgtsim.kinematics.general_double_octahedra import GeneralDoubleOctahedra, straight_states
from vgtsim.kinematics.module_sets import ModuleSet
from vgtsim.kinematics.octahedra import Octahedra, straight_pose
from vgtsim.kinematics.static_section import StaticSection, make_section, section_from_transform
from vgtsim.kinematics.tetrahedra import Tetrahedra
from vgtsim.kinematics.triangle import triangle_nodes
from vgtsim.kinematics.truss import Truss

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Place:
    """Where the modules of a set stand in a chain.

    Attributes:
        modules: The set.
        active: Indices among the active modules, shape (M,); a slice when they are all of them.
        columns: Of the chain's inputs, shape (M, inputs).
        lengths: Of the chain's actuators, shape (M, legs); -1 for static legs.
        nodes: Of the inner nodes, shape (M, inner_count).
        straight: Inputs of the straight working pose, shape (M, inputs).
    """

    modules: ModuleSet
    active: Index | slice
    columns: Index
    lengths: Index
    nodes: Index
    straight: Array

    def take(self, x: Array) -> Array:
        """Inputs of the set, shape (..., M, inputs), of those of the chain, shape (..., n)."""
        if isinstance(self.active, slice):
            return x.reshape(*x.shape[:-1], *self.columns.shape)
        return x[..., self.columns]

    def put(self, whole: Array, own: Array) -> None:
        """Write vectors of the set's inputs, shape (..., M, inputs, 3), among the chain's, shape (..., n, 3)."""
        if isinstance(self.active, slice):
            whole.reshape(own.shape)[...] = own
        else:
            whole[..., self.columns, :] = own


@dataclass(frozen=True)
class Layout:
    """A chain's constants; A active modules, K modules, n inputs, J actuators, N nodes.

    Attributes:
        places: One for each kind of active module, those with a joint offset apart.
        names: Of the active modules.
        inputs: n.
        actuators: J.
        owner: Active module of each input, shape (n,).
        root: T from the base of the first active module to the mount, shape (4, 4).
        after: From the base of the next active module (of the last face, for the last) to the top of each, (A, 4, 4).
        face_from: For the mast flange and each module's top face: 0 for the mount, a + 1 for the top of active module
            a, shape (K + 1,).
        face_offset: The face's frame in that frame, shape (K + 1, 4, 4).
        corners: Of each face in its own frame, shape (K + 1, 3, 3), m.
        order: Of each node among the corners of all faces and then the inner nodes of all places, shape (N,).
        moves: Whether a node moves as a point of the body beyond the module of an input, shape (N, n), 0 or 1.
    """

    places: tuple[Place, ...]
    names: tuple[str, ...]
    inputs: int
    actuators: int
    owner: Index
    root: Array
    after: Array
    face_from: Index
    face_offset: Array
    corners: Array
    order: Index
    moves: Array


def make_layout(manipulator: Manipulator, truss: Truss) -> Layout:
    """Work the constants out.

    Args:
        manipulator: The arm.
        truss: Its truss.

    Returns:
        The layout.

    Raises:
        AssemblyError: A module does not assemble in its straight pose.
        TrussError: The members of a static section do not hold it.
    """
    modules, side = manipulator.modules, manipulator.face_side
    active = [k for k, module in enumerate(modules) if not isinstance(module, Prism | SectionModule)]
    sizes = [_input_count(modules[k]) for k in active]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    alike = [(modules[k].kind, joint_offset(modules[k]) > 0) for k in active]
    places = []
    kinds = ("double_octahedral", "double_octahedral_general", "tetrahedral", "octahedral")
    for key in ((kind, offset) for kind in kinds for offset in (False, True) if (kind, offset) in alike):
        which = [a for a, own in enumerate(alike) if own == key]
        columns = np.array([np.arange(first[a], first[a + 1]) for a in which], dtype=int)
        among = slice(None) if len(which) == len(active) else np.array(which)
        places.append(_place(manipulator, truss, [active[a] for a in which], among, columns))
    root, after, face_from, offset = _constants(manipulator, active)
    faces = [modules[0].faces(side)[0], *(module.faces(side)[1] for module in modules)]
    owner = np.repeat(np.arange(len(active)), sizes).astype(int)
    module_of_input = np.array(active, dtype=int)[owner]
    moves = (truss.node_module[:, None] >= module_of_input).astype(float)
    for place in places:
        moves[place.nodes[:, :, None], place.columns[:, None, :]] = 0.0
    return Layout(
        tuple(places),
        tuple(modules[k].name for k in active),
        int(first[-1]),
        len(truss.actuated),
        owner,
        root,
        after,
        face_from,
        offset,
        np.array([triangle_nodes(sides) for sides in faces]),
        _node_order(manipulator, truss, places),
        moves,
    )


def make_static(module: Prism | SectionModule, side: float) -> StaticSection:
    """Static section of a description.

    Args:
        module: The description.
        side: The arm's face side, m.

    Returns:
        The section.

    Raises:
        AssemblyError: A measured transform is not a rotation.
        TrussError: The members do not hold it; the module is named.
    """
    base, top = module.faces(side)
    try:
        if isinstance(module, SectionModule) and module.transform is not None:
            return section_from_transform(base, top, module.transform)
        tilt, twist = (module.tilt, module.twist) if isinstance(module, SectionModule) else ((0.0, 0.0), 0.0)
        return make_section(base, module.length or 0.0, top=top, tilt=tilt, twist=twist)
    except TrussError as error:
        members = tuple(f"{module.name}/{member}" for member in error.members)
        raise TrussError(error.rank, members, f"{module.name}: a static section whose members do not hold it") from None


def octahedron_geometry(module: Octahedral, side: float) -> single.Geometry:
    """Fixed dimensions of an octahedral module.

    Args:
        module: The description.
        side: The arm's face side, m.

    Returns:
        The geometry.
    """
    base, top = module.faces(side)
    return single.Geometry(base, top, tuple(longeron.length for longeron in module.longerons))


def general_geometry(module: GeneralDoubleOctahedral, side: float) -> general.Geometry:
    """Fixed dimensions of a general double-octahedral module.

    Args:
        module: The description.
        side: The arm's face side, m.

    Returns:
        The geometry.
    """
    base, top = module.faces(side)
    return general.Geometry(base, top, module.longerons, module.joint_offset)


def _input_count(module: Module) -> int:
    return {"tetrahedral": 1, "octahedral": 6}.get(module.kind, 3)


def _place(manipulator: Manipulator, truss: Truss, which: list[int], active: Index | slice, columns: Index) -> Place:
    """Build the set of the modules with given indices."""
    picked = [manipulator.modules[k] for k in which]
    modules, straight = _module_set(picked, manipulator.face_side)
    lengths = np.full(modules.actuated.shape, -1, dtype=int)
    rank = {int(member): j for j, member in enumerate(truss.actuated)}
    for m, k in enumerate(which):
        own = [rank[i] for i in truss.actuated.tolist() if truss.module[i] == k]
        lengths[m, modules.actuated[m]] = own
    inner = [np.flatnonzero(truss.node_module == k)[: modules.inner_count] for k in which]
    return Place(modules, active, columns, lengths, np.array(inner, dtype=int).reshape(len(which), -1), straight)


def _module_set(picked: list[Module], side: float) -> tuple[ModuleSet, Array]:
    names = tuple(module.name for module in picked)
    doubles = [module for module in picked if isinstance(module, DoubleOctahedral)]
    if doubles:
        longeron, offset, reach = np.array([[m.longeron, m.joint_offset, m.straight] for m in doubles]).T
        zero = np.zeros(len(doubles))
        geometry = double.Geometry(np.full(len(doubles), side), longeron, offset)
        return DoubleOctahedra(names, geometry), np.stack([zero, zero, (reach - offset) / 2], axis=-1)
    generals = [module for module in picked if isinstance(module, GeneralDoubleOctahedral)]
    if generals:
        shapes = tuple(general_geometry(module, side) for module in generals)
        begins = straight_states(names, shapes, [module.straight for module in generals])
        return GeneralDoubleOctahedra(names, shapes, begins), begins[:, :3]
    hinges = [module for module in picked if isinstance(module, Tetrahedral)]
    if hinges:
        faces = np.array([module.faces(side)[0] for module in hinges])
        straight = np.array([[module.straight] for module in hinges])
        return Tetrahedra(names, tetra.Geometry(faces[:, 0], faces[:, 2])), straight
    stewarts = [module for module in picked if isinstance(module, Octahedral)]
    geometries = tuple(octahedron_geometry(module, side) for module in stewarts)
    poses = [
        straight_pose(geometry, [item.length or module.straight for item in module.longerons])
        for geometry, module in zip(geometries, stewarts, strict=True)
    ]
    return Octahedra(names, geometries), np.array(poses)


def _constants(manipulator: Manipulator, active: list[int]) -> tuple[Array, Array, Index, Array]:
    """Absorb the static modules: `root`, `after`, `face_from` and `face_offset` of the layout."""
    here, source = np.eye(4), 0
    gathered, origin, offset = [], [0], [np.eye(4)]
    for k, module in enumerate(manipulator.modules):
        if k in active:
            gathered.append(here)
            here, source = np.eye(4), source + 1
        elif isinstance(module, Prism | SectionModule):
            static = make_static(module, manipulator.face_side)
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = static.R, static.P
            here = here @ step
        origin.append(source)
        offset.append(here)
    whole = np.array([*gathered, here])
    return whole[0], whole[1:], np.array(origin), np.array(offset)


def _node_order(manipulator: Manipulator, truss: Truss, places: list[Place]) -> Index:
    """Where each node stands among the corners of all faces and then the inner nodes of all places."""
    order = np.empty(len(truss.nodes), dtype=int)
    order[:3] = np.arange(3)
    for k, module in enumerate(manipulator.modules):
        corners = np.array([1] if isinstance(module, Tetrahedral) else [0, 1, 2])
        own = np.flatnonzero(truss.node_module == k)
        order[own[-len(corners) :]] = 3 * (k + 1) + corners
    count = 3 * (len(manipulator.modules) + 1)
    for place in places:
        order[place.nodes.ravel()] = count + np.arange(place.nodes.size)
        count += place.nodes.size
    return order
