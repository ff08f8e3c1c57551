"""The part of an arm that stands in the clamp while a module is set on it: does it stand still, and what does it weigh?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.description import Clamp
from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence, Index
from vgtsim.verification.measures import Finding, absent, report_as, worst_of

_THERE = 1e-6  # m of the held face from its height in the clamp
_LEAST_FORCE = 1.0  # N, of an arm without weight


def stands(site: Site) -> bool:
    """Whether a part of the arm stands in the clamp in this phase of the mission."""
    return site.task.phase is not None and site.task.phase.stands


def _has_rated_clamp(site: Site) -> bool:
    return stands(site) and _clamp(site).force is not None


def _clamp(site: Site) -> Clamp:
    clamp = site.tank.clamp
    assert clamp is not None  # the rows are for phases in which a part stands in it
    return clamp


def _find_held(run: Evidence) -> Index:
    """Records in which the face at the top of the part is in the clamp and is to stay there; an arm that rings has settled."""
    log, site = run.log, run.site
    top = log.nodes[:, site.truss.base, 2].mean(axis=1)
    held = np.abs(top - site.tank.clamp_height) < _THERE
    held[1:] &= log.feed_commanded[1:] == log.feed_commanded[:-1]
    return run.settled[held[run.settled]] if run.rings else np.flatnonzero(held)


def find_clamp_forces(run: Evidence) -> tuple[Index, Array]:
    """Settled records in the clamp, and the force of the clamp on the standing part there, shape (S, 3), N, in frame G."""
    rows = np.intersect1d(_find_held(run), run.settled)
    return rows, run.log.mast_reaction[rows, :3]


@report_as("kinematics_agreement", "movement in the clamp", limit="kinematics_agreement", applies=stands)
def check_stillness(run: Evidence) -> Finding:
    """Greatest distance of a hub from where it was when the clamp took the part."""
    rows = _find_held(run)
    if not len(rows):
        return absent("nothing stood in the clamp")
    moved = np.linalg.norm(run.log.nodes[rows] - run.log.nodes[rows[0]], axis=-1)
    found = worst_of(moved, run.log.time[rows], run.site.truss.nodes)
    return replace(found, detail=f"{len(rows) / run.site.task.simulation.log_rate:.3g} s in {_clamp(run.site).name}")


@report_as("axial_force", "clamp force error over the weight", limit="axial_force_settled", applies=stands)
def check_weight(run: Evidence) -> Finding:
    """Greatest error of the clamp's force against the weight of what stands in it, by masses, over that weight."""
    rows, force = find_clamp_forces(run)
    if not len(rows):
        return absent("nothing stood in the clamp")
    weight = run.site.load_model.mass * run.site.gravity
    error = np.linalg.norm(force - [0.0, 0.0, weight], axis=-1) / max(weight, _LEAST_FORCE)
    found = worst_of(error[:, None], run.log.time[rows], (_clamp(run.site).name,))
    return replace(found, detail=f"a weight of {weight:.6g} N")


@report_as("actuator_force", "clamp force over rated force", limit="actuator_force", applies=_has_rated_clamp)
def check_clamp(run: Evidence) -> Finding:
    """Greatest force of the clamp over its rated one."""
    rows, force = find_clamp_forces(run)
    clamp = _clamp(run.site)
    if not len(rows) or clamp.force is None:
        return absent("nothing stood in the clamp")
    return worst_of(np.linalg.norm(force, axis=-1)[:, None] / clamp.force, run.log.time[rows], (clamp.name,))
