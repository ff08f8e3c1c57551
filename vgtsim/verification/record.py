"""Is the log whole: no record is missing, moved or doubled, and every stage of the tour is there, in its order?"""

from __future__ import annotations

import numpy as np

from vgtsim.site import Site
from vgtsim.verification.evidence import Evidence
from vgtsim.verification.measures import Finding, has_goals, has_operator, report_as, worst_of
from vgtsim.verification.tracking import goal_name

_ROUNDING = 1e-6  # of a record: times are sums of steps
SAME_INSTANT = 1e-6  # s by which the clock of a run may be off where it is compared with a time of the scene
_STILL = 1e-12  # m that commands of an arm at rest may change by
_BESIDE = 1  # records by which a stage may be longer or shorter than its time: it begins between two records


@report_as("record", "record from its instant", limit="record_time")
def check_instants(run: Evidence) -> Finding:
    """Greatest distance of a record from its instant: the first is at zero, the others follow at the scene's rate."""
    due = (run.first + np.arange(len(run.log.time))) / run.site.task.simulation.log_rate
    return worst_of(np.abs(run.log.time - due)[:, None], run.log.time, ("the log",))


@report_as("record", "records missing or too many", limit="missing_records")
def check_count(run: Evidence) -> Finding:
    """Difference of the number of records from that of the simulated time."""
    simulated = run.log.performance["simulated_s"]
    due, count = int(np.ceil(simulated * run.site.task.simulation.log_rate - _ROUNDING)), len(run.outline.time)
    return Finding(
        value=float(abs(count - due)), where="the log", detail=f"{count} records of {simulated:.6g} s, {due} are due"
    )


@report_as("record", "stages of the tour missing or out of place", limit="missing_records", applies=has_goals)
def check_stages(run: Evidence) -> Finding:
    """Count the stages that are not as the scene has them: rest, then the way to each goal in turn and a hold there.

    The rest and each hold must last the scene's `hold`.
    """
    log, site = run.outline, run.site
    count, due = len(site.stages), site.task.motion.hold * site.task.simulation.log_rate
    holds, faults = log.holds, []
    if log.goal[0] != -1 or abs(np.argmax(log.goal != -1) - due) > _BESIDE:
        faults.append("the rest before the first goal")
    leaps = np.flatnonzero(~np.isin(np.diff(log.goal), (0, 1)))
    faults += [f"goals out of order at {log.time[i + 1]:.6g} s" for i in leaps]
    for goal in range(count):
        there = [hold for hold in holds if hold.goal == goal]
        last = np.flatnonzero(log.goal == goal)[-1:]
        if len(there) != 1 or there[0].last != last[0] or abs(there[0].last + 1 - there[0].first - due) > _BESIDE:
            faults.append(f"the hold at {goal_name(site, goal)}")
    return Finding(value=float(len(faults)), where=faults[0] if faults else "none", detail="; ".join(faults))


def _has_appearances(site: Site) -> bool:
    return bool(site.tank.appearances)


@report_as("record", "appearances without a new plan", limit="missing_records", applies=_has_appearances)
def check_revisions(run: Evidence) -> Finding:
    """Count the instants at which something appeared in the tank and the arm went on as it was planned before.

    Between the appearance and the new plan the commands must stand still. An arm at its last goal needs no new plan.
    """
    log, whole, site = run.log, run.outline, run.site
    last, faults = len(site.stages) - 1, []
    for when in sorted(set(site.tank.appearances.values())):
        here = int(np.searchsorted(whole.time, when - SAME_INSTANT))
        if here >= len(whole.time) or (whole.settled[here] and whole.goal[here] == last):
            continue
        planned = [item.time for item in log.revisions if item.time >= when - SAME_INSTANT]
        between = log.commanded[(log.time >= when) & (log.time <= min(planned, default=np.inf))]
        if not planned or (len(between) > 1 and np.ptp(between, axis=0).max() > _STILL):
            faults.append(f"what appeared at {when:.6g} s")
    return Finding(value=float(len(faults)), where=faults[0] if faults else "none", detail="; ".join(faults))


@report_as("record", "stages of the operation missing or out of place", limit="missing_records", applies=has_operator)
def check_operation(run: Evidence) -> Finding:
    """Count the stages that are not as they should be: all commands come first, then the arm is held, settled, to the end.

    The hold must last the scene's `hold`.
    """
    log, site = run.outline, run.site
    last = max((command.time for command in site.scene.commands), default=0.0)
    rest, due = np.flatnonzero(log.settled), site.task.motion.hold * site.task.simulation.log_rate
    faults = ["a goal, which an operator has not"] if (log.goal != -1).any() else []
    if not len(rest) or rest[-1] != len(log.time) - 1 or len(rest) != rest[-1] + 1 - rest[0]:
        faults.append("the hold at the end")
    elif abs(len(rest) - due) > _BESIDE or log.time[rest[0]] < last:
        faults.append("the time of the hold at the end")
    return Finding(value=float(len(faults)), where=faults[0] if faults else "none", detail="; ".join(faults))
