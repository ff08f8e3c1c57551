"""Did the tool and the cylinders go where they were sent? And when did they stay at which goal?"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence, Index
from vgtsim.verification.measures import (
    Finding,
    Measure,
    absent,
    has_operator,
    has_paths,
    has_poses,
    is_imposed,
    missing,
    report_as,
    worst_of,
)


def _report(
    position: str, direction: str, applies: Callable[[Site], bool]
) -> Callable[[Callable[[Evidence, int], Finding]], tuple[Measure, ...]]:
    """Make two rows of the function below, which is given 0 for a distance and 1 for an angle."""
    words = ((position, "tracking_position"), (direction, "tracking_angle"))
    return lambda find: tuple(
        report_as("tracking", quantity, limit=limit, applies=applies)(lambda run, which=which: find(run, which))
        for which, (quantity, limit) in enumerate(words)
    )


@_report("tool position at a settled goal", "tool direction at a settled goal", has_poses)
def check_tool(run: Evidence, which: int) -> Finding:
    """Greatest error of the tool at settled goals; not measured when a goal was never settled."""
    log, task, errors = run.log, run.site.task, run.tool_errors[which]
    labels = [stage.name for stage in run.site.stages]
    least = max(int(task.motion.hold * task.simulation.log_rate) - 1, 1)  # records of a whole hold, less the first
    whole = run.outline
    missed = [name for goal, name in enumerate(labels) if np.sum(whole.settled & (whole.goal == goal)) < least]
    if missed:
        return missing(f"not held, settled, at {', '.join(missed)}", missed[0])
    held = np.flatnonzero(log.settled & np.isfinite(errors))  # a stage may have no pose to hold
    if not len(held):
        return absent("the arm never settled")
    worst = held[np.argmax(errors[held])]
    return Finding(value=float(errors[worst]), where=labels[int(log.goal[worst])], when=float(log.time[worst]))


@_report("tool position to the operator's target", "tool direction to the operator's target", has_operator)
def check_target(run: Evidence, which: int) -> Finding:
    """Greatest distance of the tool from where the operator's filtered target was, or angle from its direction."""
    if not run.log.target.size:
        return missing("the log has no targets of an operator")
    return worst_of(run.target_errors[which][:, None], run.log.time, ("the tool",))


@_report("tool to its path", "tool direction to that of its path", has_paths)
def check_path(run: Evidence, which: int) -> Finding:
    """Greatest distance of the tool from a path that it follows, or angle from its direction where it is nearest."""
    errors = run.path_errors[which]
    rows = np.flatnonzero(np.isfinite(errors))
    if not len(rows):
        return absent("the tool never followed a path")
    worst = rows[np.argmax(errors[rows])]
    where = goal_name(run.site, int(run.log.goal[worst]))
    return Finding(value=float(errors[worst]), where=where, when=float(run.log.time[worst]))


@report_as("tracking", "cylinder length to its command", limit="command", applies=is_imposed)
def check_command(run: Evidence) -> Finding:
    """Greatest distance of a cylinder's length from its command.

    Rigid drives of a rigid arm have no excuse to trail; others may, and are judged at the goals.
    """
    return worst_of(np.abs(run.log.actual - run.log.commanded), run.log.time, run.actuator_names)


@report_as("tracking", "commanded length to the plan", limit="command", planned=True)
def check_plan(run: Evidence) -> Finding:
    """Greatest distance of a logged command from the planned one of its instant."""
    assert run.tour is not None  # the row is for reports with a plan
    error = measure_plan_error(run, run.log.commanded, [leg.lengths for leg in run.tour.legs])
    return worst_of(error, run.log.time, run.actuator_names)


def measure_plan_error(run: Evidence, commanded: Array, planned: Sequence[Array]) -> Array:
    """Distances of logged commands, shape (T, K), from planned ones of their instants, one array (S, K) a leg.

    A leg begins at some step between the last record before it and its first one. The log does not say which, so every
    step between is tried.
    """
    log, tour = run.log, run.tour
    assert tour is not None
    every = round(1 / (run.site.task.simulation.log_rate * tour.timestep))  # steps between records
    error = np.abs(commanded - planned[0][0])
    for leg, wanted in zip(tour.legs, planned, strict=True):
        rows = np.flatnonzero(log.goal == leg.goal)
        before = np.count_nonzero(run.outline.goal[: run.first] == leg.goal)
        ways = (_follow(wanted, every * (before + np.arange(len(rows))) + begun) for begun in range(every))
        error[rows] = min((np.abs(commanded[rows] - way) for way in ways), key=lambda off: off.max(initial=0.0))
    return error


def _follow(lengths: Array, steps: Index) -> Array:
    """Lengths at some steps of a leg, the last ones after its end."""
    return lengths[np.minimum(steps, len(lengths) - 1)]


def goal_name(site: Site, index: int) -> str:
    """Name of a logged goal; empty for the index -1, which stands before the first goal."""
    stages = site.stages
    return stages[index].name if 0 <= index < len(stages) else ""
