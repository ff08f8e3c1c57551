"""The words and tables of the HTML report."""

from __future__ import annotations

from html import escape

import numpy as np

from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import CHECK_NAMES, Check, Report, find_holds


def summarise(report: Report) -> str:
    """Say in one line what the reader wants to know first.

    Returns:
        Failed checks by name, then the key figures.
    """
    parts = []
    failed = list(dict.fromkeys(check.name for check in report.checks if not check.passed)) + missing_checks(report)
    if failed:
        parts.append(f"failed: {', '.join(failed)}")
    first: dict[str, Check] = {}
    for check in report.checks:
        first.setdefault(check.name, check)
    words = {
        "closure": "loops closed within",
        "tracking": "tool at its goals within",
        "member_utilisation": "greatest member utilisation",
        "clearance": "least clearance",
    }
    for name, text in words.items():
        if name in first:
            parts.append(f"{text} {format_quantity(first[name].measured, first[name].unit)}")
    if "real_time_factor" in report.performance:
        parts.append(f"{report.performance['real_time_factor']:.3g} times real time")
    return " · ".join(parts)


def missing_checks(report: Report) -> list[str]:
    """Names of the checks that the report should hold and does not.

    Returns:
        In the order of `CHECK_NAMES`.
    """
    present = {check.name for check in report.checks}
    return [name for name in CHECK_NAMES if name not in present]


def check_rows(report: Report) -> str:
    """Write the rows of the table of checks.

    Returns:
        Table rows; a check that is missing has one that says so.
    """
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
        f'<td class="figure">{escape(format_quantity(check.measured, check.unit))}</td>',
        f'<td class="figure">{sign} {escape(format_quantity(check.limit, check.unit))}</td>',
        f'<td class="share">{_share_bar(check)}</td>',
        f'<td class="where">{escape(check.where).replace("/", "/<wbr>")}</td>',
        f'<td class="figure">{when}</td>',
        f"<td><small>{escape(check.source)}</small></td>",
    )
    return f'<tr class="{"pass" if check.passed else "fail"}">{"".join(cells)}</tr>'


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
    """Write a row for each goal: where it is, when it was held, how well.

    Args:
        report: With the series `tool_position_error` and `tool_angle_error` when tracking was measured.
    """
    stays = find_holds(log)
    rows = []
    for index, goal in enumerate(site.task.motion.goals):
        own = [hold for hold in stays if hold.goal == index]
        spans = ", ".join(f"{hold.start:.1f} to {hold.end:.1f} s" for hold in own) or "never settled"
        errors = []
        for key, unit in (("tool_position_error", "m"), ("tool_angle_error", "rad")):
            series = report.series.get(key)
            worst = (
                max((float(np.max(series[h.first : h.last + 1])) for h in own), default=np.nan)
                if series is not None
                else np.nan
            )
            errors.append(f'<td class="figure">{escape(format_quantity(worst, unit))}</td>')
        place = ", ".join(f"{value:.3f}" for value in goal.position).replace("-", MINUS)
        normal = ", ".join(f"{value:.2f}" for value in goal.direction).replace("-", MINUS)
        rows.append(
            f'<tr class="{"pass" if own else "fail"}"><th scope="row">{goal.name}</th>'
            f'<td class="figure">{place}</td><td class="figure">{normal}</td>'
            f"<td>{spans}</td>{''.join(errors)}</tr>"
        )
    return "\n".join(rows)


def notices(log: RunLog) -> str:
    """Write what went wrong in the run itself.

    Returns:
        Paragraphs; empty when nothing did.
    """
    lines = [f"The run ended early: {log.stopped}"] if log.stopped else []
    lines += [f"MuJoCo warned: {text}" for text in log.warnings]
    pairs = {tuple(sorted(pair)) for pair in log.contact_pair.tolist()}
    lines += [f"Contact: {first} with {second}" for first, second in sorted(pairs)]
    return "\n".join(f'<p class="notice">{escape(line)}</p>' for line in lines)
