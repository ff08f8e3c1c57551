"""The arm as capsules: segments between two points, with a radius."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import MemberPairs, pair_members
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import member_radii

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_APART = 3  # modules nearer than this along the arm cannot touch while their lengths are inside the strokes


@dataclass(frozen=True)
class Capsules:
    """Members, the edges of the tip plate and the payload as M capsules.

    Attributes:
        ends: Points of each, shape (M, 2): nodes by index, the tool point after the last node.
        radii: Shape (M,), m; a cylinder has the radius of its barrel over its whole length.
        module: Module of each, shape (M,).
        point_radii: Radius of a ball about each point that holds hub and capsule ends, shape (N + 1,), m.
    """

    ends: Index
    radii: Array
    module: Index
    point_radii: Array

    @cached_property
    def far_pairs(self) -> MemberPairs:
        """Pairs that a plan keeps apart."""
        return pair_members(self.ends, self.radii, self.module, _APART)

    @cached_property
    def judged_pairs(self) -> MemberPairs:
        """Pairs whose clearance is judged: all but those of neighbours, as the verification does."""
        return pair_members(self.ends, self.radii, self.module, 2)


def make_capsules(chain: Chain, payload_radius: float) -> Capsules:
    """Wrap an arm and the payload, a ball about the tool point."""
    manipulator, truss = chain.manipulator, chain.truss
    tool, last = len(truss.nodes), len(manipulator.modules) - 1
    plate = [(tool - 3, tool - 2), (tool - 2, tool - 1), (tool - 1, tool - 3)]
    ends = np.array([*(member.ends for member in truss.members), *plate, (tool, tool)])
    thickness = np.full(3, manipulator.tip_plate.thickness / 2)
    radii = np.concatenate([member_radii(manipulator, truss), thickness, [payload_radius]])
    module = np.array([*(member.module for member in truss.members), *[last] * 4])
    point_radii = np.full(tool + 1, manipulator.hub.radius)
    np.maximum.at(point_radii, ends.ravel(), np.repeat(radii, 2))
    return Capsules(ends, radii, module, point_radii)
