"""Words in pictures: readings of an instant of a run, beside a film or page, and names of what stands in a tank."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.geometry import find_span, make_profile, obstacles
from vgtsim.kinematics import first_greatest
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, goal_name

READINGS = ("goal", "tool", "greatest force", "in member")
_NO_MATTER = 1e-3  # of its limit: an error of a settled tool below this flickers, and is as good as nothing
_AZIMUTHS = {0: "0° (+x)", 90: "90°", 180: "180°", 270: "270°"}
_MOST_NAMES = 6  # of equipment; the names of more would hide it


def read_instant(run: JudgedRun, record: int, axial: Array) -> tuple[str, str, str, str]:
    """Write one text for each of `READINGS`, at or just after a record; axial forces have shape (M,), N."""
    site, log = run.site, run.log
    goal = goal_name(site, int(log.goal[record])) or "none"
    error = run.report.series.get("tool_position_error")
    known, least = error is not None and np.isfinite(error[record]), _NO_MATTER * site.task.limits.tracking_position
    off = format_quantity(max(float(error[record]), least), "m") if error is not None and known else ""
    worst = int(first_greatest(np.abs(axial)))
    return (
        f"{goal}{' (settled)' if log.settled[record] else ''}",
        off and f"{off} {'off' if log.settled[record] else 'to goal'}",
        f"{axial[worst] / 1e3:+.1f} kN".replace("-", MINUS),
        site.truss.members[worst].name,
    )


def name_things(site: Site) -> dict[str, Array]:
    """Places of the names of what is in the tank, shape (3,), m, by name: waste, and the equipment unless it is much.

    Four azimuths stand at the foot of the wall.
    """
    tank = site.tank
    around, level, profile = obstacles(tank), tank.waste.level, make_profile(tank.shell)
    heights = np.linspace(0.8, 0.3, len(around.names))[:, None]  # of each, so that names beside one another do not meet
    count = len(around.axes)
    places = [*((1 - heights[:count]) * around.axes[:, 0] + heights[:count] * around.axes[:, 1])]
    for item in tank.solids:
        low, high = find_span(item, profile)
        places.append(
            np.array([item.radius * np.cos(item.azimuth), item.radius * np.sin(item.azimuth), (low + high) / 2])
        )
    named = len(around.names) <= _MOST_NAMES
    things = {name.replace("_", " "): place for name, place in zip(around.names, places, strict=True) if named}
    front = np.array([0.0, -tank.shell.inner_diameter / 8, level])  # where the arm seldom hides it
    foot = 0.97 * profile.inner_radius
    low = max(level, float(profile.floor_at(foot)))
    for degrees, name in _AZIMUTHS.items():
        turn = np.radians(degrees)
        things[name] = np.array([foot * np.cos(turn), foot * np.sin(turn), low])
    return things | ({tank.waste.kind: front} if level else {})
