"""Whether the stowed arm passes the riser it enters the tank by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]

RISER_SPARE = 0.0381 - 1e-5  # 1.5 in all round, what the arm was laid out for, less rounding of its figures to five digits, m


@dataclass(frozen=True)
class RiserFit:
    """How the stowed arm sits in the bore.

    Attributes:
        spare: Least distance of the arm from the bore all round, m; negative when it does not pass at all.
        place: Node or member that is that near.
    """

    spare: float
    place: str


def riser_fit(chain: Chain, bore: float) -> RiserFit:
    """Distance of the stowed arm from a bore about the mast's axis.

    Hubs are balls and tubes capsules, both widest from the axis at their ends; a cylinder's barrel is a tube from the
    eye at its base pin to its mouth.

    Args:
        chain: The arm.
        bore: Inner diameter of the riser, m.

    Returns:
        The tightest place.
    """
    nodes = chain.nodes(chain.stowed)
    local = (nodes - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    flat = local[:, :2]
    manipulator, truss = chain.manipulator, chain.truss
    reach = [
        (float(np.hypot(*flat[n])) + manipulator.hub.radius, f"node {name}") for n, name in enumerate(truss.nodes)
    ]
    for member in truss.members:
        ends = flat[list(member.ends)]
        if member.role == "actuator":
            cylinder = manipulator.cylinders[member.section]
            length = float(np.linalg.norm(local[member.ends[1]] - local[member.ends[0]]))
            part = np.array([[cylinder.eye], [cylinder.barrel_length]]) / length
            ends = ends[0] + part * (ends[1] - ends[0])
            radius = cylinder.barrel_diameter / 2
        else:
            radius = manipulator.tubes[member.section].outer_diameter / 2
        reach.append((float(np.max(np.hypot(ends[:, 0], ends[:, 1]))) + radius, f"member {member.name}"))
    widest, place = max(reach)
    return RiserFit(bore / 2 - widest, place)


def check_riser(scene: Scene, chain: Chain) -> None:
    """Refuse an arm that does not pass the riser with the spare it is meant to have.

    Args:
        scene: The scene.
        chain: Its arm.

    Raises:
        DescriptionError: With the node or member and by how much it fails.
    """
    riser = scene.tank.arm_riser
    fit = riser_fit(chain, riser.bore)
    if fit.spare < RISER_SPARE:
        raise scene.error(
            "manipulator.stowed",
            f"an arm that does not fit {riser.name}: {fit.place} leaves {fit.spare * 1e3:.2f} mm of the bore, "
            f"{(RISER_SPARE - fit.spare) * 1e3:.2f} mm too little",
            f"a stowed arm that leaves {RISER_SPARE * 1e3:.1f} mm all round",
        )
