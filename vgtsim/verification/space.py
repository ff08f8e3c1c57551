"""What came near what: clearance from the log and the descriptions, contacts and faults from the log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.kinematics.ties import first_least
from vgtsim.verification.evidence import Evidence
from vgtsim.verification.measures import Finding, report_as


@report_as("clearance", "least distance to anything", unit="m", limit="clearance", sense="at least")
def check_clearance(run: Evidence) -> Finding:
    """Least distance of the arm from tank, riser, equipment, waste, mast and itself."""
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


@report_as("contacts", "logged contacts", unit="1", limit="contacts")
def check_contacts(run: Evidence) -> Finding:
    """Count the logged contacts; the first is named."""
    log = run.log
    if not len(log.contact_time):
        return Finding(value=0.0, detail=log.stopped)
    first, second = log.contact_pair[0]
    return Finding(
        value=float(len(log.contact_time)),
        where=f"{first} and {second}",
        when=float(log.contact_time[0]),
        detail=log.stopped,
    )


@report_as("contacts", "warnings and early ends", unit="1", limit="contacts")
def check_faults(run: Evidence) -> Finding:
    """Count kinds of warning, and a run that was ended early; they are quoted."""
    faults = [*run.log.warnings, *([run.log.stopped] if run.log.stopped else [])]
    return Finding(value=float(len(faults)), where="the run" if faults else "none", detail="; ".join(faults))
