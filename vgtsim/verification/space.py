"""What came near what: clearance from the log and the descriptions, contacts and faults from the log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.kinematics import find_axis, first_least, measure_passage, member_radii
from vgtsim.site import Site
from vgtsim.touches import Parts
from vgtsim.verification.evidence import Evidence
from vgtsim.verification.hoist import has_feed
from vgtsim.verification.measures import Finding, least_of, report_as, worst_of


@report_as("clearance", "least distance to anything", limit="clearance", sense="at least")
def check_clearance(run: Evidence) -> Finding:
    """Least distance of the arm from tank, riser, equipment, waste, mast and itself.

    The riser of an arm that is fed through it is judged apart, see `check_bore`.
    """
    around, (among, pair) = run.around, run.among
    worst = int(first_least(run.clearance))
    if among[worst] < around.least[worst]:
        where = " and ".join(run.proximity.name_among(i) for i in pair[worst])
    else:
        place = int(around.nearest[worst])
        where = f"{run.proximity.name_around(int(around.body[worst, place]))} to {around.places[place]}"
    each = dict(zip(around.places, around.distance.min(axis=0), strict=True)) | {"the arm itself": among.min()}
    found = Finding(
        value=float(run.clearance[worst]), where=where, when=float(run.log.time[worst]), detail="least distances: "
    )
    return replace(found, least={place: float(distance) for place, distance in each.items() if np.isfinite(distance)})


@report_as("clearance", "least distance from the riser", limit="bore_clearance", applies=has_feed, sense="at least")
def check_bore(run: Evidence) -> Finding:
    """Least distance of each module from the riser's bore and rim; the detail has that of every module."""
    gaps = run.bore.min(axis=0)
    names = tuple(module.name for module in run.site.arm.modules)
    found = least_of(run.bore, run.log.time, names)
    least = {name: float(gap) for name, gap in zip(names, gaps, strict=True) if np.isfinite(gap)}
    return replace(found, detail="least distances: ", least=least)


def _has_line(site: Site) -> bool:
    return site.task.conveyance is not None


@report_as("clearance", "room in the truss about the line", limit="passage", applies=_has_line, sense="at least")
def check_passage(run: Evidence) -> Finding:
    """Least diameter that a member leaves about the axis, less the diameter of the line of conveyance."""
    line, chain = run.site.task.conveyance, run.site.chain
    assert line is not None  # the row is for scenes with a line
    free = measure_passage(chain.truss, member_radii(chain), run.log.nodes, jointed=line.kind == "screws")
    found = least_of(free - line.diameter, run.log.time, run.names)
    return replace(found, detail=f"the truss leaves {found.value + line.diameter:.3f} m")


@report_as("clearance", "bend of the line over its greatest", limit="line_bend", applies=_has_line)
def check_line_bend(run: Evidence) -> Finding:
    """Greatest curvature of a hose over its rated one, or angle of a universal joint over its rated one, by module."""
    line, axis = run.site.task.conveyance, find_axis(run.site.truss, run.log.nodes)
    assert line is not None  # the row is for scenes with a line
    used = line.bend_radius / axis.radius if line.joint_angle is None else axis.angle / line.joint_angle
    found = worst_of(used, run.log.time, [module.name for module in run.site.arm.modules])
    record, module = np.unravel_index(int(np.argmax(used)), used.shape)
    angle, radius = np.degrees(axis.angle[record, module]), axis.radius[record, module]
    return replace(found, detail=f"a bend of {angle:.1f} deg, radius {radius:.3g} m")


@report_as("contacts", "logged contacts", limit="contacts")
def check_contacts(run: Evidence) -> Finding:
    """Count the logged contacts that the scene does not allow; the first is named."""
    log, parts = run.log, Parts(run.site)
    pairs = {pair: parts.find_rule(pair) is None for pair in {tuple(pair) for pair in log.contact_pair.tolist()}}
    wrong = np.flatnonzero([pairs[tuple(pair)] for pair in log.contact_pair.tolist()])
    if not len(wrong):
        return Finding(value=0.0, detail=log.stopped)
    first, second = log.contact_pair[wrong[0]]
    return Finding(
        value=float(len(wrong)),
        where=f"{first} and {second}",
        when=float(log.contact_time[wrong[0]]),
        detail=log.stopped,
    )


def _allows_contacts(site: Site) -> bool:
    return bool(site.task.contacts)


@report_as("contacts", "allowed contact force over its limit", limit="contact_force", applies=_allows_contacts)
def check_contact_forces(run: Evidence) -> Finding:
    """Greatest sum of forces of an allowed contact over its limit; contacts without a limit are told of in the detail."""
    rules = run.site.task.contacts
    names = [f"{rule.part} on {rule.place}" for rule in rules]
    force = np.zeros((run.log.count, len(rules)))
    if run.touches is not None:
        force = np.linalg.norm(run.touches.by_rule, axis=-1)
    limits = np.array([rule.force or np.inf for rule in rules])
    greatest = ", ".join(f"{name} {most / 1e3:.4g} kN" for name, most in zip(names, force.max(axis=0), strict=True))
    return replace(worst_of(force / limits, run.log.time, names), detail=greatest)


@report_as("contacts", "warnings and early ends", limit="contacts")
def check_faults(run: Evidence) -> Finding:
    """Count kinds of warning, and a run that was ended early; they are quoted."""
    faults = [*run.log.warnings, *([run.log.stopped] if run.log.stopped else [])]
    return Finding(value=float(len(faults)), where="the run" if faults else "none", detail="; ".join(faults))
