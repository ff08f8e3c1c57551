"""The words and tables of the HTML report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from vgtsim.description import Tank
from vgtsim.geometry.profile import make_profile
from vgtsim.kinematics.ties import first_greatest, order_down
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import CHECK_NAMES, Check, Report, find_holds, find_riser_reaction

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
    """Say in one line the failed checks by name, then the key figures."""
    failed = list(dict.fromkeys(check.name for check in report.checks if not check.passed)) + missing_checks(report)
    parts = [f"failed: {', '.join(failed)}"] if failed else []
    first = {check.name: check for check in reversed(report.checks)}
    for name, text in _KEY_FIGURES.items():
        if name in first:
            parts.append(f"{text} {format_quantity(first[name].measured, first[name].unit)}")
    if "real_time_factor" in report.performance:
        parts.append(f"{report.performance['real_time_factor']:.3g} times real time")
    return " · ".join(parts)


def missing_checks(report: Report) -> list[str]:
    """Names of the checks that the report should hold and does not, in the order of `CHECK_NAMES`."""
    present = {check.name for check in report.checks}
    return [name for name in CHECK_NAMES if name not in present]


def notices(log: RunLog, report: Report) -> str:
    """Write paragraphs of the report's notes and of what went wrong in the run itself; none when there is nothing to tell."""
    lines = [f"Note: {note}" for note in report.notes]
    lines += [f"The run ended early: {log.stopped}"] if log.stopped else []
    lines += [f"MuJoCo warned: {text}" for text in log.warnings]
    pairs = {tuple(sorted(pair)) for pair in log.contact_pair.tolist()}
    lines += [f"Contact: {first} with {second}" for first, second in sorted(pairs)]
    return "\n".join(f'<p class="notice">{escape(line)}</p>' for line in lines)


def check_rows(report: Report) -> str:
    """Write a row for each check; a check that is missing has one that says so."""
    rows = [_check_row(check) for check in report.checks]
    rows += [
        f'<tr class="fail"><td class="mark">✗</td><th scope="row">{name}</th><td colspan="7">not made</td></tr>'
        for name in missing_checks(report)
    ]
    return "\n".join(rows)


def _check_row(check: Check) -> str:
    sign = "≤" if check.sense == "at most" else "≥"
    when = f"{check.when:.2f} s" if np.isfinite(check.when) else ""
    detail = f"<small>{escape(check.detail)}</small>" if check.detail else ""
    cells = (
        f'<td class="mark">{"✓" if check.passed else "✗"}</td>',
        f'<th scope="row">{escape(check.name)}</th>',
        f"<td>{escape(check.quantity)}{detail}</td>",
        _figure(format_quantity(check.measured, check.unit)),
        _figure(f"{sign} {format_quantity(check.limit, check.unit)}"),
        f'<td class="share">{_share_bar(check)}</td>',
        f'<td class="where">{escape(check.where).replace("/", "/<wbr>")}</td>',
        _figure(when),
        f"<td><small>{escape(check.source)}</small></td>",
    )
    return f'<tr class="{"pass" if check.passed else "fail"}">{"".join(cells)}</tr>'


def _figure(text: str) -> str:
    return f'<td class="figure">{escape(text)}</td>'


def _share_bar(check: Check) -> str:
    """Show how much of the limit is used up."""
    over, under = (check.measured, check.limit) if check.sense == "at most" else (check.limit, check.measured)
    if not np.isfinite(check.measured) or under <= 0:
        return ""
    share = 100 * over / under
    text = f"{share:.0f} %" if 1 <= share < 1000 else "&lt; 1 %" if share < 1 else "&gt; 999 %"
    width = min(max(share, 0.0), 100.0)
    return f'<span class="bar"><i style="width:{width:.0f}%"></i></span> <small>{text}</small>'


def goal_rows(site: Site, log: RunLog, report: Report) -> str:
    """Write a row for each goal: place, stays and greatest errors, of the report's series `tool_..._error` if there."""
    stays = find_holds(log)
    rows = []
    for index, goal in enumerate(site.task.motion.goals):
        own = [hold for hold in stays if hold.goal == index]
        spans = ", ".join(f"{hold.start:.1f} to {hold.end:.1f} s" for hold in own) or "never settled"
        cells = [", ".join(f"{value:.3f}" for value in goal.position).replace("-", MINUS)]
        cells += [", ".join(f"{value:.2f}" for value in goal.direction).replace("-", MINUS)]
        errors = []
        for key, unit in (("tool_position_error", "m"), ("tool_angle_error", "rad")):
            series = report.series.get(key)
            known = [] if series is None else [float(np.max(series[h.first : h.last + 1])) for h in own]
            errors.append(format_quantity(max(known, default=np.nan), unit))
        rows.append(
            f'<tr class="{"pass" if own else "fail"}"><th scope="row">{goal.name}</th>'
            f"{''.join(map(_figure, cells))}<td>{spans}</td>{''.join(map(_figure, errors))}</tr>"
        )
    return "\n".join(rows)


def member_rows(site: Site, log: RunLog, report: Report) -> str:
    """Write rows of the most used members: tension and compression apart, with the margin.

    The report should have the series `utilisation` and its parts; the row says so where it was not measured.
    """
    used = report.series.get("utilisation", np.empty((0, 0)))
    if not np.isfinite(used).any():
        return '<tr><td colspan="9">not measured</td></tr>'
    axial = log.axial(site.truss.ends)
    peak = np.max(np.nan_to_num(used, nan=-np.inf), axis=0)
    rows = []
    for index in order_down(peak)[:_ROWS]:
        member, record = site.truss.members[index], int(np.nanargmax(used[:, index]))
        pulled, pushed = (
            float(np.nanmax(report.series[f"utilisation_{kind}"][:, index])) for kind in ("tension", "compression")
        )
        cells = (
            member.section,
            f"{max(axial[:, index].max(), 0) / 1e3:.1f}",
            f"{pulled:.3f}",
            f"{max(-axial[:, index].min(), 0) / 1e3:.1f}",
            f"{pushed:.3f}",
            f"{peak[index]:.3f}",
            f"{1 / peak[index] - 1:.2f}" if peak[index] > 0 else "",
            f"{log.time[record]:.2f} s",
        )
        rows.append(f'<tr><th scope="row">{escape(member.name)}</th>{"".join(map(_figure, cells))}</tr>')
    return "\n".join(rows)


def reaction_rows(site: Site, log: RunLog) -> str:
    """Write the peaks of the loads on mast and riser."""
    rows = []
    for name, wrench in (
        ("mast at the pivot", -log.mast_reaction),
        ("riser at the crown", find_riser_reaction(site, log)),
    ):
        lateral, bending = (np.linalg.norm(wrench[:, first : first + 2], axis=1) for first in (0, 3))
        peaks = ((-wrench[:, 2], "kN"), (lateral, "kN"), (bending, "kN·m"), (np.abs(wrench[:, 5]), "kN·m"))
        cells = []
        for values, unit in peaks:
            worst = int(first_greatest(values))
            cells.append(_figure(f"{values[worst] / 1e3:.2f} {unit} at {log.time[worst]:.2f} s"))
        rows.append(f'<tr><th scope="row">{name}</th>{"".join(cells)}</tr>')
    return "\n".join(rows)


def fact_rows(facts: Iterable[tuple[str, str]]) -> str:
    """Write pairs of name and value as table rows."""
    return "\n".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>' for name, value in facts)


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
    """List what the run cost."""
    shown = {name: _COSTS.get(name, (name, "{:.6g}")) for name in performance}
    return [(words, form.format(performance[name])) for name, (words, form) in shown.items()]
