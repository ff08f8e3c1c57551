"""The step of the simulation that a plan needs: as long as loops, nodes and looks at contact allow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from vgtsim.kinematics import move_points
from vgtsim.planning.timing import TimedPath
from vgtsim.site import Site

STEP_BOUND = "step_bound_s_"  # before the name of a bound in a log's performance
_SHARE = 0.5  # of the planned clearance, that a node may travel between two looks at contact: nothing is jumped over
# What a node is off and a loop opens by, over the cube of the travel in a step, 1/m², where no command tells the lengths at its
# end: the change of accelerations is not foreseen. A whole tour at 40 ms and 1.34 m/s needs half of both.
_OFF, _OPEN = 1e-2, 2e-3
# The same over the travel, of rigid sections, whose lengths are commanded: what is foreseen is off by a bounded way, and a turn
# of that opens a loop (`plant.correction`). The reference tour needs half of both at 40 ms.
_OFF_FORESEEN, _OPEN_FORESEEN = 6.5e-6, 5e-7


def choose_step(site: Site, bounds: Mapping[str, float]) -> float:
    """Step, s: the scene's, or the longest within bounds, see `find_bounds`, that divides the time between records."""
    return site.task.simulation.timestep or site.fit_step(min(bounds.values()))


def find_bounds(site: Site, ways: Iterable[tuple[TimedPath, float]]) -> dict[str, float]:
    """Longest step, s, by what bounds it, for the ways in time and their least clearances, m.

    A scene's own step is the one bound of it. Otherwise those of the site stand beside three of the plan: the fastest node of
    each way counts against the limits of closure and kinematics and against that way's clearance.
    """
    simulation, limits = site.task.simulation, site.task.limits
    if simulation.timestep is not None:
        return {"scene": simulation.timestep}
    bounds = site.step_bounds | dict.fromkeys(("closure", "kinematics_agreement", "clearance"), np.inf)
    if simulation.members == "sections":
        most = limits.closure / _OPEN_FORESEEN, limits.kinematics_agreement / _OFF_FORESEEN
    else:
        most = np.cbrt(limits.closure / _OPEN), np.cbrt(limits.kinematics_agreement / _OFF)
    travel = dict(zip(("closure", "kinematics_agreement"), most, strict=True))
    for way, clearance in ways:
        speed = find_speed(site, way, site.timestep)
        if speed > 0:
            for name, reach in (travel | {"clearance": _SHARE * clearance}).items():
                bounds[name] = min(bounds[name], float(reach / speed))
    return bounds


def name_bound(performance: Mapping[str, float]) -> str | None:
    """What set the step of a run, one of the names of `find_bounds`, from a log's performance; None of a log without a plan."""
    given = {name.removeprefix(STEP_BOUND): value for name, value in performance.items() if name.startswith(STEP_BOUND)}
    return min(given, key=lambda name: given[name], default=None)


def find_speed(site: Site, way: TimedPath, timestep: float) -> float:
    """Greatest speed of a node or the tool point on a way, m/s, looked at in every time step, s."""
    q = way.inputs(timestep)
    points = np.concatenate([site.chain.nodes(q), site.chain.tool(q)[0][:, None]], axis=1)
    feed, turn = (0.0 if places is None else places for places in way.mast(timestep))
    points = move_points(site.chain, points, feed, turn)
    return float(np.linalg.norm(np.diff(points, axis=0), axis=-1).max()) / timestep if way.duration else 0.0
