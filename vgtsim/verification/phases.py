"""The verdict on a mission in phases: the worst figures of all, and what one phase hands over to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from vgtsim.description import begins_anew
from vgtsim.verification.evidence import Array
from vgtsim.verification.judged import JudgedRun
from vgtsim.verification.measures import Finding
from vgtsim.verification.report import CHECK_NAMES, Check, Report, judge

_ADDED = ("simulated_s", "wall_s", "steps")


def find_begins(runs: Sequence[JudgedRun]) -> list[float]:
    """When each phase of a mission began, s."""
    return np.cumsum([0.0, *(run.duration for run in runs[:-1])]).tolist()


def join_phases(runs: Sequence[JudgedRun]) -> Report:
    """Join the reports of a mission's phases into one; times of it count from the begin of the mission.

    Beside the rows of the phases it has those of the hand-overs, and one that counts the phases that were not run.
    """
    site, begins = runs[0].site, find_begins(runs)
    moved = [
        replace(check, where=f"phase {number}: {check.where}", when=check.when + begin)
        for number, (run, begin) in enumerate(zip(runs, begins, strict=True), start=1)
        for check in run.report.checks
    ]
    rows = [*moved, *_hand_over(runs, begins), _count_phases(runs)]
    groups: dict[tuple[int, str], list[Check]] = {}
    for row in rows:
        groups.setdefault((CHECK_NAMES.index(row.name), row.quantity), []).append(row)
    performance = dict(runs[0].report.performance)
    performance |= {name: sum(run.report.performance[name] for run in runs) for name in _ADDED}
    performance["nv"] = max(run.report.performance["nv"] for run in runs)
    performance["real_time_factor"] = performance["simulated_s"] / performance["wall_s"]
    notes = dict.fromkeys(note for run in runs for note in run.report.notes)
    return Report(
        scene=site.task.name,
        checks=tuple(_find_worst(group) for _, group in sorted(groups.items(), key=lambda item: item[0][0])),
        performance=performance,
        versions=runs[0].report.versions,
        notes=tuple(notes),
        phases=tuple(run.report for run in runs),
    )


def _find_worst(rows: Sequence[Check]) -> Check:
    sign = -1 if rows[0].sense == "at least" else 1
    return max(rows, key=lambda row: np.inf if np.isnan(row.measured) else sign * row.measured)


def _count_phases(runs: Sequence[JudgedRun]) -> Check:
    phase = runs[0].site.task.phase
    assert phase is not None  # of a mission in phases
    lacking = [number for number in range(1, phase.count + 1) if number > len(runs)]
    return Check(
        name="record",
        quantity="phases of the mission that are missing",
        measured=float(len(lacking)),
        limit=0.0,
        unit="1",
        sense="at most",
        where=f"phase {lacking[0]}" if lacking else "none",
        when=float("nan"),
        source=f"{phase.count} phases in {runs[0].site.scene.file.name}",
    )


def _hand_over(runs: Sequence[JudgedRun], begins: Sequence[float]) -> list[Check]:
    """Hubs and commands of the part that is in the tank, at the end of a phase and at the begin of the next, and the waste.

    The waste of the first phase is held against the description.
    """
    ground = runs[0].site.diggings
    found = [] if ground is None else [_hold_waste(runs[0], ground.start, "begin of phase 1", 0.0)]
    for number, (before, after) in enumerate(pairwise(runs), start=1):
        last = before.source.read(before.source.count - 1, before.source.count)
        if ground is not None:
            waste = last.bed[0] if last.bed.size else ground.start
            found.append(_hold_waste(after, waste, f"phase {number} to {number + 1}", begins[number]))
        if begins_anew(after.site.scene):
            continue
        first = after.source.read(0, 1)
        hubs = min(last.nodes.shape[1], first.nodes.shape[1])
        drives = min(last.commanded.shape[1], first.commanded.shape[1])
        apart = np.linalg.norm(last.nodes[0, -hubs:] - first.nodes[0, -hubs:], axis=-1).max()
        changed = np.abs(last.commanded[0, -drives:] - first.commanded[0, -drives:]).max()
        for quantity, value, limit in (
            ("hubs of the standing part, phase to phase", apart, "kinematics_agreement"),
            ("commanded lengths, phase to phase", changed, "command"),
        ):
            worst = Finding(value=float(value), where=f"phase {number} to {number + 1}", when=begins[number])
            found.append(judge(after.site, "record", quantity, limit, worst))
    return found


def _hold_waste(run: JudgedRun, before: Array, where: str, when: float) -> Check:
    """Greatest difference of the heights with which a phase begins, from those before, shape (P,), m; NaN without heights."""
    first = run.source.read(0, 1)
    changed = float(np.abs(first.bed[0] - before).max()) if first.bed.size else float("nan")
    found = Finding(value=changed, where=where, when=when)
    return judge(run.site, "record", "waste, phase to phase", "command", found)
