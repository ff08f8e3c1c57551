"""Which nodes of an arm keep their distances whatever its cylinders do: those of static modules and of the tip plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Index
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.modules import kind_of


@dataclass(frozen=True)
class RigidSections:
    """Nodes that are one rigid body, and members that are length rows; N nodes, L rows.

    Attributes:
        of_node: Section of each node, shape (N,): 0 is fixed to the flange, the last one holds the tip plate, -1 are free
            hubs.
        count: Number of sections with that of the flange.
        rows: Indices of the members whose lengths are rows, shape (L,).
    """

    of_node: Index
    count: int
    rows: Index

    def nodes(self, section: int) -> list[int]:
        """Nodes of a section, or of -1 the free hubs."""
        return np.flatnonzero(self.of_node == section).tolist()


def find_rigid_sections(chain: Chain) -> RigidSections:
    """Join the nodes of static modules to bodies; modules that share a face are one.

    Raises:
        DescriptionError: Two sections share a hinge, or the arm has joint blocks.
    """
    truss = chain.truss
    if len(truss.rings):
        raise DescriptionError(None, "simulation.members", "sections in an arm with joint offsets", "rigid or elastic")
    groups = [set(range(len(truss.nodes))[part]) for part in (truss.base, truss.tip)]
    for index, module in enumerate(chain.manipulator.modules):
        if kind_of(module).make_static is None:
            continue
        joined = set(truss.ends[truss.module == index].ravel().tolist())
        for other in [group for group in groups if len(group & joined) >= 3]:
            groups.remove(other)
            joined |= other
        groups.append(joined)
    of_node = np.full(len(truss.nodes), -1)
    for number, group in enumerate(sorted(groups, key=min)):
        taken = [node for node in sorted(group) if of_node[node] >= 0]
        if taken:
            found = f"sections in an arm with a hinge at {truss.nodes[taken[0]]}"
            raise DescriptionError(None, "simulation.members", found, "rigid or elastic")
        of_node[list(group)] = number
    near, far = of_node[truss.ends].T
    return RigidSections(of_node, len(groups), np.flatnonzero((near != far) | (near < 0)))
