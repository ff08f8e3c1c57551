"""A tour planned anew on its way, when something appears in the tank that nobody knew of.

The leg that runs is stopped on its own path: the speed along it falls by a fifth-order smooth step, within the acceleration of
the scene. The arm stands for the scene's hold, and the ways to this goal and the next ones are planned from where it stands.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import PathError, ReachError, TrussError
from vgtsim.planning.tour import Leg, Tour, plan_goals
from vgtsim.runlog import Revision
from vgtsim.site import Site

Array = NDArray[np.float64]

_SOONEST = 0.2  # s: the shortest stop that is tried
_LONGER = 1.15  # the next one that is tried
_BEFORE = 6  # rows before the stop that its spline goes through, too: its ends are less true than its middle
_SAME_INSTANT = 1e-6  # of a step: rounding in the clock of a run must not hide what appeared at this very instant
_ALREADY = 1e-12  # m in a step: a cylinder that goes no farther stands, as rounding moves it as much


def revise_as_run(site: Site, tour: Tour, revisions: Iterable[Revision]) -> Tour:
    """A tour as it was planned anew in a run, by the instants that its log tells."""
    for revision in revisions:
        tour = revise_tour(site, tour, revision)
    return tour


def revise_tour(site: Site, tour: Tour, revision: Revision) -> Tour:
    """The tour from an instant on with what has appeared in the tank by then.

    Legs before it and the rows up to it stay. Where there is no way on, the tour ends where the arm stopped, and says why.
    """
    done, now = tour.legs[: revision.leg], tour.legs[revision.leg]
    step, goal = tour.timestep, now.goal
    stopped = stop_rows(now.lengths, revision.row, step, site.task.motion.acceleration)
    here = np.array(site.chain.inputs_from_lengths(stopped[-1]))
    stopped = np.concatenate([stopped, np.tile(stopped[-1], (round(site.task.motion.hold / step), 1))])
    later, blocked = site.learn(revision.time + _SAME_INSTANT * step), ""
    legs: tuple[Leg, ...]
    try:
        rest = plan_goals(later, here, goal, step).legs
        legs = (replace(rest[0], lengths=np.concatenate([stopped, rest[0].lengths[1:]])), *rest[1:])
    except (PathError, ReachError, TrussError) as error:
        gap, place = later.surroundings.least(here)
        blocked = f"no way on from {revision.time:.6g} s, at which something appeared in the tank: {error}"
        legs = (replace(now, lengths=stopped, q=here, clearance=gap, place=place),)
    return replace(tour, legs=(*done, *legs), planned=tour.digest, blocked=blocked)


def stop_rows(lengths: Array, row: int, timestep: float, acceleration: float) -> Array:
    """Rows of lengths, shape (T, J), m, up to a row, and on along the same path to rest, the soonest that an acceleration allows.

    A stop that takes longer than the rest of the path ends with it.
    """
    from scipy.interpolate import make_interp_spline  # slow to load, and few runs need it

    ahead = len(lengths) - 1 - row
    if row == 0 or np.abs(lengths[row] - lengths[row - 1]).max() < _ALREADY:
        return lengths[: row + 1]
    first = max(row - _BEFORE, 0)
    path = make_interp_spline(np.arange(first, len(lengths)), lengths[first:], k=min(5, len(lengths) - first - 1))
    count = max(int(np.ceil(_SOONEST / timestep)), 2)
    while count / 2 <= ahead:
        part = np.arange(1, count + 1) / count
        places = row + count * (part - 2.5 * part**4 + 3 * part**5 - part**6)
        rows = np.concatenate([lengths[: row + 1], path(places)])
        asked = np.abs(np.diff(rows[max(row - 1, 0) :], n=2, axis=0)).max() / timestep**2
        if asked <= acceleration:
            return rows
        count = int(np.ceil(_LONGER * count))
    return lengths
