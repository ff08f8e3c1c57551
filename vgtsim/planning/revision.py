"""A tour planned anew on its way, when something appears in the tank that nobody knew of.

The leg that runs is stopped on its own path: the speed along it falls by a fifth-order smooth step, within the acceleration of
the scene. The arm stands for the scene's hold, and the ways to this goal and the next ones are planned from where it stands.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from vgtsim.errors import PathError, ReachError, TrussError
from vgtsim.planning.halting import stop_rows
from vgtsim.planning.mission_revision import learn_until, revise_mission
from vgtsim.planning.tour import Leg, Tour, plan_goals
from vgtsim.runlog import Revision
from vgtsim.site import Site


def revise_as_run(site: Site, tour: Tour, revisions: Iterable[Revision]) -> Tour:
    """A tour as it was planned anew in a run, by the instants that its log tells."""
    for revision in revisions:
        tour = revise_tour(site, tour, revision)
    return tour


def revise_tour(site: Site, tour: Tour, revision: Revision) -> Tour:
    """The tour from an instant on with what has appeared in the tank by then.

    Legs before it and the rows up to it stay. Where there is no way on, the tour ends where the arm stopped, and says why.
    """
    if site.task.mission:
        return revise_mission(site, tour, revision)
    done, now = tour.legs[: revision.leg], tour.legs[revision.leg]
    step, goal = tour.timestep, now.goal
    stopped = stop_rows(now.lengths, revision.row, step, site.task.motion.acceleration).rows
    here = np.array(site.chain.inputs_from_lengths(stopped[-1]))
    stopped = np.concatenate([stopped, np.tile(stopped[-1], (round(site.task.motion.hold / step), 1))])
    later, blocked = learn_until(site, revision.time, step), ""
    legs: tuple[Leg, ...]
    try:
        rest = plan_goals(later, here, goal, step).legs
        legs = (replace(rest[0], lengths=np.concatenate([stopped, rest[0].lengths[1:]])), *rest[1:])
    except (PathError, ReachError, TrussError) as error:
        gap, place = later.surroundings.least(here)
        blocked = f"no way on from {revision.time:.6g} s, at which something appeared in the tank: {error}"
        legs = (replace(now, lengths=stopped, q=here, clearance=gap, place=place),)
    return replace(tour, legs=(*done, *legs), planned=tour.digest, blocked=blocked)
