"""An arm for the eye as round bars between its nodes: one shape in many sizes, so that a page draws them at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.kinematics import Chain, cross, member_radii, quaternions_to

NOBODY = -1  # owner of a bar that is no member


@dataclass(frozen=True, eq=False)
class Bars:
    """P round bars that lie along lines between two points of an arm each; points are nodes, then the tip's middle and the tool.

    A bar keeps its length. It begins `offset` after the first point, or ends that much before the second one.

    Attributes:
        ends: Points of each bar, shape (P, 2).
        from_far: Whether the offset is taken from the second point, shape (P,).
        offset: Shape (P,), m.
        length, radius: Shape (P,), m.
        owner: Member of each bar, or `NOBODY`, shape (P,).
    """

    ends: Index
    from_far: Mask
    offset: Array
    length: Array
    radius: Array
    owner: Index

    @property
    def scales(self) -> Array:
        """Factors along x, y and z, shape (P, 3), of a bar along z of radius and length 1."""
        return np.stack([self.radius, self.radius, self.length], axis=-1)

    def place(self, points: Array) -> tuple[Array, Array]:
        """Middles, shape (P, 3), m, and turns of z along the bars, shape (P, 4), for points of shape (N + 2, 3), m."""
        near, far = points[self.ends[:, 0]], points[self.ends[:, 1]]
        along = far - near
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        shift = (self.offset + self.length / 2)[:, None] * along
        return np.where(self.from_far[:, None], far - shift, near + shift), quaternions_to(along)


def make_bars(chain: Chain) -> Bars:
    """The bars of an arm: tubes, barrels and rods of cylinders, posts of joint blocks, and the tool's stem."""
    truss, arm = chain.truss, chain.manipulator
    points = place_points(chain, chain.nodes(chain.straight))
    spans = np.linalg.norm(points[truss.ends[:, 1]] - points[truss.ends[:, 0]], axis=-1)
    rows = []
    for k, (member, radius) in enumerate(zip(truss.members, member_radii(chain).tolist(), strict=True)):
        if member.role != "actuator":
            rows.append((member.ends, False, (0.0, float(spans[k])), radius, k))
            continue
        part = arm.cylinders[member.section]
        rows.append((member.ends, False, (part.eye, part.barrel_length - part.eye), radius, k))
        rows.append((member.ends, True, (0.0, part.rod_length), part.rod / 2, k))
    for foot, middle, head in truss.rings.reshape(-1, 3).tolist():
        span, block = float(np.linalg.norm(points[head] - points[foot])), arm.block_of(int(truss.node_module[middle]))
        rows.append(((foot, head), False, (0.0, span), block.diameter / 2, NOBODY))
    if arm.tip_plate.tool_offset:
        count = len(truss.nodes)
        rows.append(((count, count + 1), False, (0.0, arm.tip_plate.tool_offset), arm.hub.radius, NOBODY))
    ends, from_far, reach, radius, owner = zip(*rows, strict=True)
    offset, length = np.array(reach, float).T.copy()
    return Bars(
        ends=np.array(ends, np.intp),
        from_far=np.array(from_far, bool),
        offset=offset,
        length=length,
        radius=np.array(radius, float),
        owner=np.array(owner, np.intp),
    )


def place_points(chain: Chain, nodes: Array) -> Array:
    """Nodes, then the middle of the tip plate and the tool point, shape (N + 2, 3), m, for nodes of shape (N, 3), m."""
    middle, R = turn_plate(chain, nodes)
    return np.concatenate([nodes, [middle, middle + chain.manipulator.tip_plate.tool_offset * R[:, 2]]])


def turn_plate(chain: Chain, nodes: Array) -> tuple[Array, Array]:
    """Middle of the tip plate, shape (3,), m, and its rotation, shape (3, 3): z along the tool, x toward the first corner."""
    corners = nodes[chain.truss.tip]
    middle = corners.mean(axis=0)
    z = cross(corners[1] - corners[0], corners[2] - corners[0])
    z /= np.linalg.norm(z)
    x = (corners[0] - middle) / np.linalg.norm(corners[0] - middle)
    return middle, np.stack([x, cross(z, x), z], axis=-1)
