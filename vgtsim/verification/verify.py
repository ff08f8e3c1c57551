"""Run log to report: every check made, none left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vgtsim.description import digest_scene
from vgtsim.digests import digest_code
from vgtsim.log import LogSource, Revision, cut, outline, thinning
from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence, PlannedTour
from vgtsim.verification.measures import Finding, missing
from vgtsim.verification.record import SAME_INSTANT
from vgtsim.verification.report import MEASURES, Report, judge


def verify(site: Site, log: LogSource, tour: PlannedTour | None = None, notes: tuple[str, ...] = ()) -> Report:
    """Hold a run against the description and the project's own kinematics and statics. MuJoCo takes no part.

    With a tour, which planning makes of the same scene, the commands are held against it as well. A log that is damaged,
    or of another arm, fails every check. Notes stand in the report beside its own on what the log was made of. A long log
    is read and judged in stretches; of each figure the worst counts.
    """
    truss, whole, every = site.truss, outline(log), thinning(log)
    counts = (len(truss.nodes), len(truss.members), len(truss.actuated), len(site.stages))
    heights = 0 if site.diggings is None else len(site.diggings.start)
    rows = [measure for measure in MEASURES if measure.applies(site) and (tour is not None or not measure.planned)]
    found: list[list[Finding]] = [[] for _ in rows]
    shown: list[Mapping[str, Array]] = []
    for stretch in cut(log):
        run = Evidence(site, stretch.log, tour, stretch, whole)
        fault = stretch.wide.find_fault() or stretch.wide.find_misfit(*counts, heights)
        if fault:
            found, shown = [[missing(fault, "the log")] for _ in rows], []
            break
        for row, parts in zip(rows, found, strict=True):
            parts.append(row.find(run))
        picked = slice(-stretch.first % every, None, every)
        shown.append({name: value[picked].copy() for name, value in _collect_series(run).items()})
    return Report(
        scene=site.task.name,
        checks=tuple(
            judge(site, row.check, row.quantity, row.limit, row.join(parts), unit=row.unit, sense=row.sense)
            for row, parts in zip(rows, found, strict=True)
        ),
        performance=log.performance,
        versions=log.versions,
        series={name: np.concatenate([part[name] for part in shown]) for name in shown[0]} if shown else {},
        notes=(*notes, *_tell_revisions(site, log.revisions), *_compare(site, log.digests, tour)),
    )


def _tell_revisions(site: Site, revisions: Sequence[Revision]) -> Iterator[str]:
    """Say when and why the tour was planned anew."""
    before = 0.0
    for revision in revisions:
        names = [name for name, when in site.tank.appearances.items() if before < when <= revision.time + SAME_INSTANT]
        what = f"{'step' if site.task.mission else 'way to'} {site.stages[revision.leg].name}"
        yield f"{' and '.join(names)} appeared in the tank; at {revision.time:.6g} s the {what} was planned anew"
        before = revision.time + SAME_INSTANT


def _compare(site: Site, digests: Mapping[str, str], tour: PlannedTour | None) -> Iterator[str]:
    """Say which of a log's digests are not those of site, tour and code."""
    now = {"description": digest_scene(site.scene), "code": digest_code()}
    if tour is not None:
        now["programme"] = tour.digest
    for name, found in now.items():
        if digests.get(name, found) != found:
            yield f"the {name} is not that of the run: digest {found[:12]}, in the log {digests[name][:12]}"


def _collect_series(run: Evidence) -> Mapping[str, Array]:
    """Figures over time, for plots; see `Report.series`."""
    distance, angle = run.tool_errors
    return {
        "closure": run.gaps.max(axis=1),
        "tool_position_error": distance,
        "tool_angle_error": angle,
        "utilisation": run.use.strength,
        "utilisation_tension": run.use.tension,
        "utilisation_compression": np.maximum(run.use.compression, run.use.rod),
        "clearance_time": run.log.time,
        "clearance": run.clearance,
    }
