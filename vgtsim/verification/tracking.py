"""Did the tool and the cylinders go where they were sent?"""

from __future__ import annotations

import numpy as np

from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import Finding, missing, report_as, when, worst_of


@report_as("tracking", "tool position at a settled goal", unit="m", limit="tracking_position")
def check_tool_position(run: Evidence) -> Finding:
    """Greatest distance of the tool from a settled goal."""
    return _find_worst_held(run, run.tool_errors[0])


@report_as("tracking", "tool direction at a settled goal", unit="rad", limit="tracking_angle")
def check_tool_direction(run: Evidence) -> Finding:
    """Greatest angle of the tool from a settled goal's direction."""
    return _find_worst_held(run, run.tool_errors[1])


@report_as(
    "tracking",
    "cylinder length to its command",
    unit="m",
    limit="tracking_position",
    applies=when(drive="rigid", members="rigid"),
)
def check_command(run: Evidence) -> Finding:
    """Greatest distance of a cylinder's length from its command.

    Rigid drives of a rigid arm have no excuse to trail; others may, and are judged at the goals.
    """
    return worst_of(np.abs(run.log.actual - run.log.commanded), run.log.time, run.actuator_names)


def _find_worst_held(run: Evidence, errors: Array) -> Finding:
    """Greatest of errors of shape (T,) at settled goals; not measured when a goal was never settled."""
    log, task = run.log, run.site.task
    labels = [goal.name for goal in task.motion.goals]
    least = max(int(task.motion.hold * task.simulation.log_rate) - 1, 1)  # records of a whole hold, less the first
    missed = [name for goal, name in enumerate(labels) if np.sum(log.settled & (log.goal == goal)) < least]
    if missed:
        return missing(f"not held, settled, at {', '.join(missed)}", missed[0])
    held = np.flatnonzero(log.settled)
    worst = held[np.argmax(errors[held])]
    return Finding(float(errors[worst]), labels[int(log.goal[worst])], float(log.time[worst]))
