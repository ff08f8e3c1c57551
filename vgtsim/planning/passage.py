"""Refusal of a line of conveyance that the open truss does not let pass."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.kinematics import find_axis, measure_passage, member_radii
from vgtsim.site import Site


def check_passage(site: Site, q: Array) -> None:
    """Refuse a line that the arm does not pass in some posture, inputs of shape (T, n).

    Raises:
        DescriptionError: It is too thick, or too stiff for a bend: by how much, and where.
    """
    line = site.task.conveyance
    if line is None:
        return
    arm, truss, nodes = site.arm, site.truss, site.chain.nodes(q)
    room, key = site.task.limits.passage, "conveyance.diameter"
    free = measure_passage(truss, member_radii(site.chain), nodes, jointed=line.kind == "screws").min(axis=0)
    narrow, names = int(np.argmin(free)), [module.name for module in arm.modules]
    excess = line.diameter + room - free[narrow]
    if excess > 0:
        over = f"{line.diameter:.4g} m, {excess:.4g} m too thick to pass {truss.member_names[narrow]}"
        raise site.scene.error(key, over, f"at most {free[narrow] - room:.4g} m, the passage of {arm.name}")
    axis = find_axis(truss, nodes)
    if line.joint_angle is not None:
        bent = axis.angle.max(axis=0)
        most = int(np.argmax(bent))
        if bent[most] > line.joint_angle:
            over, allowed = np.degrees([line.joint_angle, bent[most]])
            found = f"{over:.4g} deg, while {names[most]} bends its axis by {allowed:.4g} deg"
            raise site.scene.error("conveyance.joint_angle", found, f"at least {allowed:.4g} deg")
    radius = axis.radius.min(axis=0)
    tight = int(np.argmin(radius))
    if line.bend_radius > radius[tight]:
        over = f"{line.bend_radius:.4g} m, while {names[tight]} bends its axis to {radius[tight]:.4g} m"
        raise site.scene.error("conveyance.bend_radius", over, f"at most {radius[tight]:.4g} m")
