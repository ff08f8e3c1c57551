"""Readings of an instant of a run, in words: film and page show them beside the picture."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.kinematics import first_greatest
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report, goal_name

READINGS = ("goal", "tool", "greatest force", "in member")
_NO_MATTER = 1e-3  # of its limit: an error of a settled tool below this flickers, and is as good as nothing


def read_instant(site: Site, log: RunLog, report: Report, record: int, axial: Array) -> tuple[str, str, str, str]:
    """Write one text for each of `READINGS`, at or just after a record; axial forces have shape (M,), N."""
    goal = goal_name(site, int(log.goal[record])) or "none"
    error = report.series.get("tool_position_error")
    known, least = error is not None and np.isfinite(error[record]), _NO_MATTER * site.task.limits.tracking_position
    off = format_quantity(max(float(error[record]), least), "m") if error is not None and known else ""
    worst = int(first_greatest(np.abs(axial)))
    return (
        f"{goal}{' (settled)' if log.settled[record] else ''}",
        off and f"{off} {'off' if log.settled[record] else 'to goal'}",
        f"{axial[worst] / 1e3:+.1f} kN".replace("-", MINUS),
        site.truss.members[worst].name,
    )
