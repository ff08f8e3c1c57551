"""What members, mast and riser carry, as tables of the HTML report."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.ties import first_greatest, order_down
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report, find_riser_reaction

Array = NDArray[np.float64]

_ROWS = 20  # members listed, the most used first


def member_rows(site: Site, log: RunLog, report: Report) -> str:
    """Write what the most used members carry: tension and compression apart, with the margin.

    Args:
        report: With the series `utilisation` and its parts.

    Returns:
        Table rows; one that says so when nothing was measured.
    """
    used = report.series.get("utilisation", np.empty((0, 0)))
    if not np.isfinite(used).any():
        return '<tr><td colspan="9">not measured</td></tr>'
    axial = log.axial(site.truss.ends)
    peak = np.max(np.nan_to_num(used, nan=-np.inf), axis=0)
    rows = []
    for index in order_down(peak)[:_ROWS]:
        record = int(np.nanargmax(used[:, index]))
        member = site.truss.members[index]
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
        body = "".join(f'<td class="figure">{escape(cell)}</td>' for cell in cells)
        rows.append(f'<tr><th scope="row">{escape(member.name)}</th>{body}</tr>')
    return "\n".join(rows)


def reaction_rows(site: Site, log: RunLog) -> str:
    """Write the peaks of the loads on mast and riser."""
    places = (("mast at the pivot", -log.mast_reaction), ("riser at the crown", find_riser_reaction(site, log)))
    rows = []
    for name, wrench in places:
        lateral = np.linalg.norm(wrench[:, :2], axis=1)
        bending = np.linalg.norm(wrench[:, 3:5], axis=1)
        cells = []
        for values, unit in (
            (-wrench[:, 2], "kN"),
            (lateral, "kN"),
            (bending, "kN·m"),
            (np.abs(wrench[:, 5]), "kN·m"),
        ):
            worst = int(first_greatest(values))
            cells.append(f"{values[worst] / 1e3:.2f} {unit} at {log.time[worst]:.2f} s")
        body = "".join(f'<td class="figure">{cell}</td>' for cell in cells)
        rows.append(f'<tr><th scope="row">{name}</th>{body}</tr>')
    return "\n".join(rows)
