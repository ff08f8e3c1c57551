"""The arm as a truss: which nodes there are, which members join them, and what each member is.

Node and member numbers within a module are the dissertation's (figures 3.10 and 3.11): n1 to n3 the base, n4 to n6 the
mid-plane, n7 to n9 the top; longerons L1 to L12; actuators l1 to l3.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import DoubleOctahedral, Module, Octahedral, Tetrahedral

# ends as (base | mid | top, corner); L1 to L12 of figure 3.10
_OCTAHEDRON_LONGERONS = (
    (("base", 0), ("mid", 0)),
    (("base", 1), ("mid", 1)),
    (("base", 2), ("mid", 2)),
    (("base", 2), ("mid", 0)),
    (("base", 0), ("mid", 1)),
    (("base", 1), ("mid", 2)),
    (("mid", 1), ("top", 0)),
    (("mid", 2), ("top", 1)),
    (("mid", 0), ("top", 2)),
    (("mid", 0), ("top", 0)),
    (("mid", 1), ("top", 1)),
    (("mid", 2), ("top", 2)),
)
_LEGS = ((0, 0), (1, 1), (2, 2), (2, 0), (0, 1), (1, 2))  # corners of base and top of l1 to l6 (3.27)
_TRIANGLE = ((0, 1), (1, 2), (2, 0))


@dataclass(frozen=True)
class Member:
    """One bar or cylinder.

    Attributes:
        name: For example `m2/longeron/1`.
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


@dataclass(frozen=True)
class Truss:
    """Topology of a whole arm.

    Attributes:
        nodes: Node names, the three of the mast flange first, the three of the tip plate last.
        node_module: Module of each node, shape (N,); -1 on the mast flange.
        members: In the order of the modules.
        group: Number of each node's group, shape (N,): faces and mid-planes have three nodes each, the top of a
            tetrahedral module adds one. Each group's members hold it on the groups before it.
        ends: Node indices of each member, shape (M, 2).
        module: Module of each member, shape (M,).
        actuated: Indices of the actuators among the members, shape (J,).
        tip_edges: Node index pairs of the tip plate's edges, shape (3, 2).
    """

    nodes: tuple[str, ...]
    node_module: NDArray[np.intp]
    members: tuple[Member, ...]
    group: NDArray[np.intp]
    ends: NDArray[np.intp] = field(init=False)
    module: NDArray[np.intp] = field(init=False)
    actuated: NDArray[np.intp] = field(init=False)
    tip_edges: NDArray[np.intp] = field(init=False)

    def __post_init__(self) -> None:
        """Derive the arrays from the members, read-only."""
        tip = len(self.nodes) - 3
        arrays = {
            "node_module": self.node_module,
            "group": self.group,
            "ends": np.array([member.ends for member in self.members]),
            "module": np.array([member.module for member in self.members]),
            "actuated": np.array([i for i, member in enumerate(self.members) if member.role == "actuator"], dtype=int),
            "tip_edges": np.array([(tip + i, tip + j) for i, j in _TRIANGLE]),
        }
        for name, value in arrays.items():
            frozen = np.array(value)
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    @property
    def member_names(self) -> tuple[str, ...]:
        """Names of the members."""
        return tuple(member.name for member in self.members)

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

    Args:
        manipulator: The arm.

    Returns:
        Its truss.
    """
    nodes = [f"base/{corner + 1}" for corner in range(3)]
    owner, group = [-1] * 3, [0] * 3
    members: list[Member] = []
    face = [0, 1, 2]
    for index, module in enumerate(manipulator.modules):
        groups = {"base": face}
        for name in ("mid", "top") if isinstance(module, DoubleOctahedral) else ("top",):
            corners = (1,) if isinstance(module, Tetrahedral) else (0, 1, 2)
            groups[name] = list(face)
            for corner in corners:
                groups[name][corner] = len(nodes)
                nodes.append(f"{module.name}/{name}/{corner + 1}")
                owner.append(index)
                group.append(group[-1] + (corner == corners[0]))
        members += _module_members(module, index, groups, closed=index == len(manipulator.modules) - 1)
        face = groups["top"]
    return Truss(tuple(nodes), np.array(owner), tuple(members), np.array(group))


_Plan = list[tuple[str, str, int, int, int]]  # role, section, ends, number


def _module_members(module: Module, index: int, groups: dict[str, list[int]], closed: bool) -> list[Member]:
    base, top = groups["base"], groups["top"]
    plan: _Plan = []
    if isinstance(module, DoubleOctahedral):
        for number, ((below, i), (above, j)) in enumerate(_OCTAHEDRON_LONGERONS, 1):
            plan.append(("longeron", module.longeron_tube, groups[below][i], groups[above][j], number))
        mid = groups["mid"]
        plan += [("actuator", module.cylinder, mid[i], mid[j], n) for n, (i, j) in enumerate(_TRIANGLE, 1)]
    elif isinstance(module, Octahedral):
        for number, (longeron, (i, j)) in enumerate(zip(module.longerons, _LEGS, strict=True), 1):
            role = "longeron" if longeron.cylinder is None else "actuator"
            plan.append((role, longeron.cylinder or longeron.tube or "", base[i], top[j], number))
    elif isinstance(module, Tetrahedral):
        plan.append(("actuator", module.cylinder, base[1], top[1], 1))
    else:
        plan += [("longeron", module.longeron_tube, base[i], top[i], i + 1) for i in range(3)]
        plan += [("cross_longeron", module.cross_longeron_tube, base[i], top[j], i + 1) for i, j in _TRIANGLE]
    if not closed:
        edges = _TRIANGLE[:2] if isinstance(module, Tetrahedral) else _TRIANGLE
        plan += [("batten", module.batten_tube, top[i], top[j], n) for n, (i, j) in enumerate(edges, 1)]
    return [
        Member(f"{module.name}/{role}/{number}", role, (first, second), index, section)
        for role, section, first, second, number in plan
    ]
