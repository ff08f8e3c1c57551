"""The arm as a truss: which nodes there are, which members join them, and what each member is.

Node and member numbers within a module are the dissertation's (figures 3.10 and 3.11): n1 to n3 the base, n4 to n6 the
mid-plane, n7 to n9 the top; longerons L1 to L12; actuators l1 to l3.

With a joint offset each mid-plane node is a rigid block on the normal of the mid-plane. It has three nodes: the foot (n4 to
n6), where the lower longerons end; the head (n4' to n6'), where the upper longerons end; and the middle, to which the
actuators are pinned. The pins are normal to the mid-plane, and a rod turns freely in its barrel. So an actuator carries an
axial force and bending in the plane that it spans with the blocks' axes; it carries no torsion and no bending across that
plane. For forces at feet and heads it is three bars: chords between the feet and between the heads, and a diagonal from the
foot of its first block to the head of its second. A block is a bar from foot to head. So a ring of three blocks and three
actuators is a braced prism of twelve bars, which is isostatic. `Truss.bars` has all these bars.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import by_rows, compiled
from vgtsim.description import Manipulator
from vgtsim.kinematics.modules import kind_of
from vgtsim.kinematics.modules.sets import TRIANGLE, PlannedMember


@dataclass(frozen=True)
class Member:
    """One bar or cylinder, for example `m2/longeron/1`.

    Attributes:
        role: `longeron`, `cross_longeron`, `batten` or `actuator`.
        ends: Indices of its two nodes; the ball joint is at the first, the closure at the second.
        module: Index of its module.
        section: Name of its tube or cylinder.
    """

    name: str
    role: str
    ends: tuple[int, int]
    module: int
    section: str


@dataclass(frozen=True, eq=False)
class Truss:
    """Topology of a whole arm; tables that are made of one are kept by its identity.

    Attributes:
        nodes: Node names, the three of the mast flange first, the three of the tip plate last.
        node_module: Module of each node, shape (N,); -1 on the mast flange.
        members: In the order of the modules.
        group: Number of each node's group, shape (N,): faces and mid-planes have three nodes each, feet and heads of
            joint blocks apart, the top of a tetrahedral module adds one. Each group's bars hold it on the groups before
            it. -1 for the middles of blocks, whose loads feet and heads share.
        rings: Nodes of the joint blocks: foot, middle and head of three blocks of each mid-plane with a joint offset,
            shape (R, 3, 3). Actuator l1 joins the first block to the second, and so on round.
        faces: Nodes of the mast's face and of the top of each module, shape (K + 1, 3).
        ends: Node indices of each member, shape (M, 2).
        module: Module of each member, shape (M,).
        actuated: Indices of the actuators among the members, shape (J,).
        tip_edges: Node index pairs of the tip plate's edges, shape (3, 2).
        ring_actuators: Indices of the actuators between joint blocks among the members, shape (R, 3).
        bars: Node index pairs of the pin-jointed truss with the same equilibrium, shape (B, 2): the members, where the
            chord of its feet stands for an actuator between blocks, the tip plate's edges, and then of all rings the
            upper chords, the diagonals and the blocks, three each.
    """

    nodes: tuple[str, ...]
    node_module: Index
    members: tuple[Member, ...]
    group: Index
    rings: Index = field(default_factory=lambda: np.zeros((0, 3, 3), dtype=int))
    faces: Index = field(default_factory=lambda: np.zeros((0, 3), dtype=int))
    ends: Index = field(init=False)
    module: Index = field(init=False)
    actuated: Index = field(init=False)
    tip_edges: Index = field(init=False)
    ring_actuators: Index = field(init=False)
    bars: Index = field(init=False)

    def __post_init__(self) -> None:
        """Derive the arrays from the members, read-only."""
        tip = len(self.nodes) - 3
        arrays = {
            "node_module": self.node_module,
            "group": self.group,
            "rings": self.rings,
            "faces": self.faces,
            "ends": np.array([member.ends for member in self.members]),
            "module": np.array([member.module for member in self.members]),
            "actuated": np.array([i for i, member in enumerate(self.members) if member.role == "actuator"], dtype=int),
            "tip_edges": np.array([(tip + i, tip + j) for i, j in TRIANGLE]),
        }
        middles = set(self.rings[:, :, 1].ravel().tolist())
        pinned = [i for i in arrays["actuated"].tolist() if self.members[i].ends[0] in middles]
        arrays["ring_actuators"] = np.array(pinned, dtype=int).reshape(-1, 3)
        arrays["bars"] = _equivalent_bars(arrays["ends"], arrays["tip_edges"], self.rings, arrays["ring_actuators"])
        for name, value in arrays.items():
            frozen = np.array(value)
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    @property
    def free(self) -> Index:
        """Nodes that are bodies of their own: hubs between flange and tip plate, and middles of joint blocks."""
        between = np.arange(self.base.stop, self.tip.start)
        return np.setdiff1d(between, self.rings[:, :, [0, 2]])

    @property
    def hubs(self) -> Mask:
        """Nodes at which a joint ball is, shape (N,): all but the middles of joint blocks."""
        return self.group >= 0

    @property
    def bar_names(self) -> tuple[str, ...]:
        """Names of the bars."""
        parts = [f"{self.nodes[block[1]]}/block" for ring in self.rings for block in ring]
        pinned = [self.members[i].name for i in self.ring_actuators.ravel()]
        edges = tuple(f"tip/edge/{corner + 1}" for corner in range(3))
        return (*self.member_names, *edges, *pinned, *pinned, *parts)

    @property
    def member_names(self) -> tuple[str, ...]:
        """Names of the members."""
        return tuple(member.name for member in self.members)

    def spans(self, nodes: Array) -> Array:
        """Vectors from the near to the far ends of the members, shape (..., M, 3), m, for nodes of shape (..., N, 3)."""
        return nodes[..., self.ends[:, 1], :] - nodes[..., self.ends[:, 0], :]

    def lengths(self, nodes: Array) -> Array:
        """Lengths of the members, shape (..., M), m, for nodes of shape (..., N, 3)."""
        flat, length = by_rows(nodes.reshape(-1, *nodes.shape[-2:])), np.empty((*nodes.shape[:-2], len(self.ends)))
        _fill_lengths(self._own_ends, flat, length.reshape(-1, len(self.ends)))
        return length

    @cached_property
    def _own_ends(self) -> Index:
        """A copy of `ends`, as compiled functions take it."""
        return np.array(self.ends, np.intp)

    @property
    def base(self) -> slice:
        """The nodes of the mast flange."""
        return slice(0, 3)

    @property
    def tip(self) -> slice:
        """The nodes of the tip plate."""
        return slice(len(self.nodes) - 3, len(self.nodes))


def make_truss(manipulator: Manipulator) -> Truss:
    """List the nodes and members of an arm.

    A face's battens belong to the module below it, so neighbours share them; the mast flange and the tip plate are
    rigid and take the place of the first and the last three.
    """
    nodes = [f"base/{corner + 1}" for corner in range(3)]
    owner, group = [-1] * 3, [0] * 3
    members: list[Member] = []
    rings: list[list[list[int]]] = []
    face = [0, 1, 2]
    faces = [face]
    for index, module in enumerate(manipulator.modules):
        kind, groups = kind_of(module), {"base": face}
        for name in (*kind.groups(module), "top"):
            corners = kind.top if name == "top" else (0, 1, 2)
            groups[name] = list(face)
            carried = name == "mid" and "foot" in groups
            number = -1 if carried else max(group) + 1
            for corner in corners:
                groups[name][corner] = len(nodes)
                nodes.append(f"{module.name}/{name}/{corner + 1}")
                owner.append(index)
                group.append(number)
        plan, top = kind.plan(module, groups), groups["top"]
        if index < len(manipulator.modules) - 1:  # the tip plate takes the place of the last battens
            plan += [
                PlannedMember("batten", module.batten_tube, top[i], top[j], n)
                for n, (i, j) in enumerate(kind.battens, 1)
            ]
        members += [
            Member(
                f"{module.name}/{item.role}/{item.number}", item.role, (item.first, item.second), index, item.section
            )
            for item in plan
        ]
        if "foot" in groups:
            rings.append([[groups[name][corner] for name in ("foot", "mid", "head")] for corner in range(3)])
        face = top
        faces.append(face)
    blocks = np.array(rings, dtype=int).reshape(-1, 3, 3)
    return Truss(
        nodes=tuple(nodes),
        node_module=np.array(owner),
        members=tuple(members),
        group=np.array(group),
        rings=blocks,
        faces=np.array(faces),
    )


@compiled
def _fill_lengths(ends: Index, nodes: Array, length: Array) -> None:
    for t in range(len(nodes)):
        for m in range(len(ends)):
            square = 0.0
            for k in range(3):
                square += (nodes[t, ends[m, 1], k] - nodes[t, ends[m, 0], k]) ** 2
            length[t, m] = np.sqrt(square)


def _equivalent_bars(ends: Index, tip_edges: Index, rings: Index, actuators: Index) -> Index:
    """Ends of `Truss.bars`."""
    foot, head = rings[:, :, 0], rings[:, :, 2]
    beyond = [1, 2, 0]  # the block that an actuator from each block leads to
    members = ends.copy()
    members[actuators] = np.stack([foot, foot[:, beyond]], axis=-1)
    upper = np.stack([head, head[:, beyond]], axis=-1).reshape(-1, 2)
    diagonal = np.stack([foot, head[:, beyond]], axis=-1).reshape(-1, 2)
    return np.concatenate([members, tip_edges, upper, diagonal, np.stack([foot, head], axis=-1).reshape(-1, 2)])
