"""The step of the simulation that a plan needs: as long as loops, nodes and looks at contact allow."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from vgtsim.planning.timing import TimedPath
from vgtsim.site import Site

_SHARE = 0.5  # of the planned clearance, that a node may travel between two looks at contact: nothing is jumped over
# What a node is off and a loop opens by, over the cube of the travel in a step, 1/m²: the foresight is exact but for the
# change of accelerations. The reference tour needs half of both at 40 ms and two fifths at 20 ms (1.34 m/s).
_OFF, _OPEN = 1e-2, 2e-3


def choose_step(site: Site, ways: Iterable[tuple[TimedPath, float]]) -> float:
    """Step, s: the scene's, or the longest that its plan allows, from the ways in time and their least clearances, m.

    The fastest node of each way counts against that way's clearance and the limits of closure and kinematics.
    """
    if (fixed := site.task.simulation.timestep) is not None:
        return fixed
    limits = site.task.limits
    error = min(np.cbrt(limits.kinematics_agreement / _OFF), np.cbrt(limits.closure / _OPEN))
    bound = longest = site.timestep
    for way, clearance in ways:
        speed = find_speed(site, way, longest)
        if speed > 0:
            bound = min(bound, min(error, _SHARE * clearance) / speed)
    return site.fit_step(bound)


def find_speed(site: Site, way: TimedPath, timestep: float) -> float:
    """Greatest speed of a node or the tool point on a way, m/s, looked at in every time step, s."""
    q = way.inputs(timestep)
    points = np.concatenate([site.chain.nodes(q), site.chain.tool(q)[0][:, None]], axis=1)
    return float(np.linalg.norm(np.diff(points, axis=0), axis=-1).max()) / timestep if way.duration else 0.0
