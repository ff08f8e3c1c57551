"""How near an arm in given postures comes to the tank with all that is in it, to the mast and to itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import Clearance, arm_clearance, make_profile, obstacles, self_clearance
from vgtsim.kinematics.inertia import member_radii
from vgtsim.site import Site

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def find_around(site: Site, nodes: Array, tool: Array) -> Clearance:
    """Distances of the arm from tank, riser, equipment and waste.

    Nodes have shape (..., N, 3) and tool points shape (..., 3), m, in frame G.
    """
    tank, payload = site.tank, site.task.payload
    ball, radii = (tool, payload.radius) if payload.mass else None, member_radii(site.arm, site.truss)
    around = (tank, make_profile(tank.shell), obstacles(tank), ball)
    return arm_clearance(nodes, site.truss.ends, radii, site.arm.hub.radius, *around)


def find_among(site: Site, nodes: Array, tool: Array) -> tuple[Array, Index]:
    """Least distance of the arm from itself and the mast, shape (...), m, and the pair of parts, shape (..., 2).

    Arguments are those of `find_around`. Parts are members, then the mast, then the payload: `part_names` has their names.
    """
    radius, pivot, count = site.mast.outer_diameter / 2, site.chain.mount[:3, 3], nodes.shape[-2]
    axis = [np.broadcast_to(pivot + [0, 0, up], (*nodes.shape[:-2], 1, 3)) for up in (radius, site.mast.length)]
    points = np.concatenate([nodes, *axis, tool[..., None, :]], axis=-2)
    ends = np.concatenate([site.truss.ends, [[count, count + 1], [count + 2, count + 2]]])
    radii = np.append(member_radii(site.arm, site.truss), [radius, site.task.payload.radius])
    module = np.append(site.truss.module, [-1, len(site.arm.modules) - 1])  # the mast is before the first module
    return self_clearance(points, ends, radii, module)


def name_around(site: Site, part: int) -> str:
    """Name of a part in `Clearance.body`: members, then nodes, then the payload."""
    return [*site.truss.member_names, *site.truss.nodes, "payload"][part]


def name_among(site: Site, part: int) -> str:
    """Name of a part in the pairs of `find_among`."""
    return [*site.truss.member_names, "mast", "payload"][part]
