"""The words and tables of the report, as a template shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vgtsim.description import Tank
from vgtsim.geometry import make_profile
from vgtsim.kinematics import first_greatest, order_down
from vgtsim.log import RunLog
from vgtsim.output.folders import HTML, PHASES
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.planning import STEP_BOUND, name_bound
from vgtsim.site import Site
from vgtsim.verification import CHECK_NAMES, Check, JudgedRun, Report, find_begins

Row = dict[str, Any]  # of a table, by the names of the template

_NO_MATTER = 1e-3  # of its limit: a figure below this is as good as nothing, and `report.json` has it
_ROWS = 20  # members listed, the most used first; a page long
_KEY_FIGURES = {
    "closure": "loops closed within",
    "tracking": "tool at its goals within",
    "member_utilisation": "greatest member utilisation",
    "clearance": "least clearance",
}
_COSTS = {
    "simulated_s": ("simulated time", "{:.2f} s"),
    "wall_s": ("wall time", "{:.2f} s"),
    "real_time_factor": ("times real time", "{:.3g}"),
    "timestep_s": ("time step", "{:.4g} s"),
    "steps": ("steps", "{:.0f}"),
    "nv": ("degrees of freedom before constraints", "{:.0f}"),
}


def summarise(report: Report) -> str:
    """Say in one line the checks that failed or were not made, by name, then the key figures."""
    present = {check.name for check in report.checks}
    failed = list(dict.fromkeys(check.name for check in report.checks if not check.passed))
    failed += [name for name in CHECK_NAMES if name not in present]
    parts = [f"failed: {', '.join(failed)}"] if failed else []
    first = {check.name: check for check in reversed(report.checks)}
    for name, text in _KEY_FIGURES.items():
        if name in first:
            parts.append(f"{text} {_write_measured(first[name])}")
    if "real_time_factor" in report.performance:
        parts.append(f"{report.performance['real_time_factor']:.3g} times real time")
    return " · ".join(parts)


def list_notices(log: RunLog, report: Report) -> list[str]:
    """List the report's notes and what went wrong in the run itself; empty when there is nothing to tell."""
    lines = [f"Note: {note}" for note in report.notes]
    lines += [f"The run ended early: {log.stopped}"] if log.stopped else []
    lines += [f"MuJoCo warned: {text}" for text in log.warnings]
    pairs = {tuple(sorted(pair)) for pair in log.contact_pair.tolist()}
    return lines + [f"Contact: {first} with {second}" for first, second in sorted(pairs)]


def group_checks(report: Report) -> list[Row]:
    """Group the checks of a report by name, in the order of `CHECK_NAMES`; what is missing has no rows and no `worst` one.

    The worst row uses most of its limit, failed ones first.
    """
    found: dict[str, list[Row]] = {name: [] for name in CHECK_NAMES}
    for check in report.checks:
        found.setdefault(check.name, []).append(_describe_check(check))
    return [
        {
            "name": name,
            "rows": rows,
            "passed": bool(rows) and all(row["passed"] for row in rows),
            "worst": max(
                rows, key=lambda row: (not row["passed"], np.nan_to_num(row["share"], nan=-1.0)), default=None
            ),
        }
        for name, rows in found.items()
    ]


PHASE_FIGURES = {
    "clearance": "least clearance",
    "headroom above the mast": "headroom left",
    "force over strength": "greatest utilisation",
    "clamp force over rated force": "clamp force over rated",
}


def list_phase_rows(runs: Sequence[JudgedRun]) -> list[Row]:
    """List the phases of a mission, each with the path of its own page and the figures of `PHASE_FIGURES`.

    Figures are found by the check's name or by its quantity.
    """
    rows = []
    for number, (run, begin) in enumerate(zip(runs, find_begins(runs), strict=True), start=1):
        first = {word: check for check in reversed(run.report.checks) for word in (check.name, check.quantity)}
        row = {
            "number": number,
            "page": f"{PHASES}/{number}/{HTML}",
            "modules": len(run.site.arm.active),
            "steps": ", ".join(stage.name for stage in run.site.stages),
            "begin": f"{begin:.1f} s",
            "time": f"{run.duration:.1f} s",
            "figures": [_write_measured(first[name]) if name in first else "" for name in PHASE_FIGURES],
            "passed": run.report.passed,
        }
        rows.append(row)
    return rows


def _describe_check(check: Check) -> Row:
    """A check as the page shows it; `share` is how much of the limit is used, in per cent, NaN where none can be said."""
    over, under = (check.measured, check.limit) if check.sense == "at most" else (check.limit, check.measured)
    return vars(check) | {
        "passed": check.passed,
        "measured": _write_measured(check),
        "limit": f"{'≤' if check.sense == 'at most' else '≥'} {format_quantity(check.limit, check.unit)}",
        "when": f"{check.when:.2f} s" if np.isfinite(check.when) else "",
        "share": 100 * over / under if np.isfinite(check.measured) and under > 0 else np.nan,
    }


def _write_measured(check: Check) -> str:
    """The figure, or that it is far below its limit: more digits would not matter."""
    return _write(check.measured, check.unit, check.limit if check.sense == "at most" else 0.0)


def _write(value: float, unit: str, limit: float) -> str:
    least = _NO_MATTER * limit
    return f"< {format_quantity(least, unit)}" if 0 < value < least else format_quantity(value, unit)


def list_goal_rows(run: JudgedRun) -> list[Row]:
    """List the goals of the tour: when the arm settled there, and the greatest distance and angle of the tool from them.

    Errors are of the report's series `tool_..._error`, if there.
    """
    limits = run.site.task.limits
    judged = (
        ("tool_position_error", "m", limits.tracking_position),
        ("tool_angle_error", "rad", limits.tracking_angle),
    )
    rows = []
    for index, goal in enumerate(run.site.stages):
        held = [hold for hold in run.holds if hold.goal == index]
        errors = []
        for key, unit, limit in judged:
            series = run.report.series.get(key)
            known = [] if series is None else [float(np.max(series[h.first : h.last + 1])) for h in held]
            errors.append(_write(max(known, default=np.nan), unit, limit))
        row = {
            "name": goal.name,
            "position": ", ".join(f"{value:.3f}" for value in goal.position or ()).replace("-", MINUS),
            "direction": ", ".join(f"{value:.2f}" for value in goal.direction or ()).replace("-", MINUS),
            "stays": ", ".join(f"{hold.start:.1f} to {hold.end:.1f} s" for hold in held) or "never settled",
            "distance": errors[0],
            "angle": errors[1],
            "reached": bool(held),
        }
        rows.append(row)
    return rows


def list_members(run: JudgedRun) -> list[tuple[str, ...]]:
    """List the most used members: name, section, tension and compression, kN, each with its use, greatest use, margin, when.

    Empty where the report has no series `utilisation`.
    """
    series, axial = run.report.series, run.shown.axial
    used = series.get("utilisation", np.empty((0, 0)))
    if not np.isfinite(used).any():
        return []
    peak = np.max(np.nan_to_num(used, nan=-np.inf), axis=0)
    rows = []
    for index in order_down(peak)[:_ROWS]:
        member, record = run.site.truss.members[index], int(np.nanargmax(used[:, index]))
        pulled, pushed = (
            float(np.nanmax(series[f"utilisation_{kind}"][:, index])) for kind in ("tension", "compression")
        )
        cells = [
            member.name,
            member.section,
            f"{max(axial[:, index].max(), 0) / 1e3:.1f}",
            f"{pulled:.3f}",
            f"{max(-axial[:, index].min(), 0) / 1e3:.1f}",
            f"{pushed:.3f}",
            f"{peak[index]:.3f}",
            f"{1 / peak[index] - 1:.2f}" if peak[index] > 0 else "",
            f"{run.log.time[record]:.2f} s",
        ]
        rows.append(tuple(cells))
    return rows


def list_reactions(run: JudgedRun) -> list[tuple[str, ...]]:
    """List the peaks of the loads on mast and riser: downward, lateral, bending moment, torque."""
    rows = []
    for name, wrench in (
        ("mast at the pivot", -run.log.mast_reaction),
        ("riser at the crown", run.shown.riser_reaction),
    ):
        lateral, bending = (np.linalg.norm(wrench[:, first : first + 2], axis=1) for first in (0, 3))
        peaks = ((-wrench[:, 2], "kN"), (lateral, "kN"), (bending, "kN·m"), (np.abs(wrench[:, 5]), "kN·m"))
        row = [name]
        for values, unit in peaks:
            worst = int(first_greatest(values))
            row.append(f"{values[worst] / 1e3:.2f} {unit} at {run.log.time[worst]:.2f} s")
        rows.append(tuple(row))
    return rows


def list_settings(site: Site) -> list[tuple[str, str]]:
    """List what the run was made with."""
    task, arm, truss = site.task, site.arm, site.truss
    step, motion = task.simulation, task.motion
    rate = max(arm.cylinders[truss.members[i].section].rate for i in truss.actuated)
    sizes = f"{len(truss.actuated)} actuators, {len(truss.nodes)} nodes, {len(truss.members)} members"
    return [
        ("scene", f"{task.name} ({site.scene.file.name})"),
        ("arm", f"{arm.title}: {sizes}"),
        ("tank", site.tank.title),
        ("waste", describe_waste(site.tank)),
        ("pivot", f"{format_quantity(site.scene.pivot_height, 'm')} above the lowest floor point"),
        ("payload", f"{task.payload.mass:.4g} kg"),
        ("time step", "fixed by the scene" if step.timestep else "the longest that the plan allows"),
        ("records", f"{step.log_rate:.4g} a second"),
        ("drive", step.drive),
        ("gravity", f"{step.gravity:.5g} m/s²"),
        ("factor on inverse weights", format_quantity(step.weight_scale, "")),
        ("actuator speed", f"{format_quantity(motion.rate_fraction * rate, 'm')}/s at most"),
        ("actuator acceleration", f"{format_quantity(motion.acceleration, 'm')}/s² at most"),
        ("planned stroke margin", format_quantity(motion.stroke_margin, "m")),
        ("planned clearance", format_quantity(motion.clearance, "m")),
        ("settled below", f"{format_quantity(motion.settle_speed, 'm')}/s at every node"),
        ("safety factor on member strength", f"{task.limits.safety_factor:.4g}"),
    ]


def describe_waste(tank: Tank) -> str:
    """What is left in a tank, how much of it, and how high it stands."""
    waste, volume = tank.waste, make_profile(tank.shell).volume(tank.waste.level)
    tonnes = waste.density * volume / 1000
    return f"{waste.kind}, {volume:.3g} m³, {tonnes:.3g} t, standing at {format_quantity(waste.level, 'm')}"


def list_costs(performance: Mapping[str, float]) -> list[tuple[str, str]]:
    """List what the run cost, and what kept its step from being longer."""
    shown = {name: _COSTS.get(name, (name, "{:.6g}")) for name in performance if not name.startswith(STEP_BOUND)}
    costs = [(words, form.format(performance[name])) for name, (words, form) in shown.items()]
    bound = name_bound(performance)
    return costs if bound is None else [*costs, ("time step set by", bound.replace("_", " "))]
