"""Whether the stowed arm passes its riser.

Double octahedra are stowed with retracted actuators. Octahedra and hinges pass in their straight pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import member_radii
from vgtsim.site import Site

Array = NDArray[np.float64]

# The shipped arms are laid out to leave 1.5 in all round; their figures are rounded to five digits, m.
RISER_SPARE = 0.0381 - 1e-5


@dataclass(frozen=True)
class RiserFit:
    """Least distance of the stowed arm from the bore, m, negative when it does not pass, and the nearest node or member."""

    spare: float
    place: str


def riser_fit(chain: Chain, bore: float) -> RiserFit:
    """Least distance of the stowed arm from a bore about the mast's axis; the bore is its inner diameter, m.

    Hubs are balls. Tubes are capsules, which are widest from the axis at their ends. The barrel of a cylinder runs from
    the eye at its base pin to its mouth. The rod is not looked at: it is thinner than the hub at its end.
    """
    local = (chain.nodes(chain.stowed) - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    manipulator, truss = chain.manipulator, chain.truss
    hubs = np.hypot(local[:, 0], local[:, 1]) + manipulator.hub.radius
    widest, place = max((float(reach), f"node {name}") for reach, name in zip(hubs, truss.nodes, strict=True))
    for member, radius in zip(truss.members, member_radii(manipulator, truss), strict=True):
        ends = local[list(member.ends)]
        if member.role == "actuator":
            cylinder = manipulator.cylinders[member.section]
            length = np.linalg.norm(ends[1] - ends[0])
            part = np.array([[cylinder.eye], [cylinder.barrel_length]]) / length
            ends = ends[0] + part * (ends[1] - ends[0])
        reach = float(np.max(np.hypot(ends[:, 0], ends[:, 1])) + radius)
        if reach > widest:
            widest, place = reach, f"member {member.name}"
    return RiserFit(bore / 2 - widest, place)


def asked_spare(site: Site) -> float:
    """Least distance of the stowed arm from the riser that a scene asks for, m."""
    return site.task.mast.riser_spare or RISER_SPARE


def check_riser(site: Site) -> None:
    """Refuse an arm that does not pass the riser with the spare it is meant to have.

    Raises:
        DescriptionError: The stowed length is outside a stroke; or a node or member does not fit: by how much.
    """
    scene = site.scene
    cylinders = [scene.manipulator.cylinders[module.cylinder] for module in scene.manipulator.stowable]
    least, greatest = np.array([[item.retracted, item.extended] for item in cylinders]).reshape(-1, 2).T
    wanted = scene.manipulator.stowed_length if cylinders else 0.0
    if not np.all((least <= wanted) & (wanted <= greatest)):
        allowed = f"a length that every cylinder has, {least.max():.4f} to {greatest.min():.4f} m"
        raise scene.error("manipulator.stowed.cylinder_length", f"{wanted:.4f} m", allowed)
    riser = scene.tank.arm_riser
    fit, asked = riser_fit(site.chain, riser.bore), asked_spare(site)
    if fit.spare < asked:
        left = f"leaves {fit.spare * 1e3:.2f} mm of the bore all round, {(asked - fit.spare) * 1e3:.2f} mm too little"
        found = f"an arm that does not fit {riser.name}: {fit.place} {left}"
        raise scene.error("manipulator.stowed", found, f"a stowed arm that leaves {asked * 1e3:.1f} mm all round")
