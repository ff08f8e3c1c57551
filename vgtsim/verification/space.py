"""What came near what: clearance from the log and the descriptions, contacts from the log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.geometry.clearance import arm_clearance, obstacles, self_clearance
from vgtsim.geometry.profile import make_profile
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import member_radii
from vgtsim.kinematics.ties import first_least
from vgtsim.runlog import RunLog
from vgtsim.verification.findings import Finding
from vgtsim.verification.shape import tool_from_nodes

Array = NDArray[np.float64]


def find_clearance(log: RunLog, chain: Chain, scene: Scene) -> tuple[Array, Array, Finding]:
    """Least distance of the arm from tank, riser, equipment, waste, mast and itself.

    Args:
        log: The run.
        chain: The arm.
        scene: Gives tank, payload and mast.

    Returns:
        Times, shape (K,), s; least distances, shape (K,), m; and the worst of them.
    """
    time, nodes, truss = log.time, log.nodes, chain.truss
    radii = member_radii(chain.manipulator, truss)
    tool, _ = tool_from_nodes(nodes, chain)
    payload = (tool, scene.task.payload.radius) if scene.task.payload.mass else None
    profile = make_profile(scene.tank.shell)
    hub = chain.manipulator.hub.radius
    around = arm_clearance(nodes, truss.ends, radii, hub, scene.tank, profile, obstacles(scene.tank), payload)
    among, pair = self_clearance(*_with_mast_and_payload(nodes, tool, radii, chain, scene))
    least = np.minimum(around.least, among)
    worst = int(first_least(least))
    if among[worst] < around.least[worst]:
        names = [*truss.member_names, "mast", "payload"]
        where = " and ".join(names[i] for i in pair[worst])
    else:
        place = int(around.nearest[worst])
        names = [*truss.member_names, *truss.nodes, "payload"]
        where = f"{names[int(around.body[worst, place])]} to {around.places[place]}"
    each = dict(zip(around.places, around.distance.min(axis=0), strict=True)) | {"the arm itself": among.min()}
    detail = ", ".join(f"{place} {distance:.3f} m" for place, distance in each.items() if np.isfinite(distance))
    return time, least, Finding(float(least[worst]), where, float(time[worst]), f"least distances: {detail}")


def _with_mast_and_payload(
    nodes: Array, tool: Array, radii: Array, chain: Chain, scene: Scene
) -> tuple[Array, NDArray[np.intp], Array, NDArray[np.intp]]:
    """Nodes, ends, radii and modules with the mast (before the first module) and the payload (in the last) added."""
    radius = scene.task.mast.outer_diameter / 2
    foot = chain.mount[:3, 3] + [0, 0, radius]
    top = foot + [0, 0, scene.task.mast.pivot_depth + scene.tank.shell.soil_cover]
    shape = (len(nodes), 1, 3)
    points = [nodes, np.broadcast_to(foot, shape), np.broadcast_to(top, shape), tool[:, None]]
    count = nodes.shape[1]
    ends = np.concatenate([chain.truss.ends, [[count, count + 1], [count + 2, count + 2]]])
    module = np.concatenate([chain.truss.module, [-1, len(chain.manipulator.modules) - 1]])
    return np.concatenate(points, axis=1), ends, np.append(radii, [radius, scene.task.payload.radius]), module


def check_faults(log: RunLog) -> Finding:
    """Count kinds of warning, and a run that was ended early; they are quoted."""
    faults = [*log.warnings, *([log.stopped] if log.stopped else [])]
    return Finding(float(len(faults)), "none" if not faults else "the run", float("nan"), "; ".join(faults))


def check_contacts(log: RunLog) -> Finding:
    """Count the logged contacts; the first is named."""
    if not len(log.contact_time):
        return Finding(0.0, "none", float("nan"), log.stopped)
    first, second = log.contact_pair[0]
    return Finding(float(len(log.contact_time)), f"{first} and {second}", float(log.contact_time[0]), log.stopped)
