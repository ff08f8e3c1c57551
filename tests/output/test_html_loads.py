"""Tables of members and reactions."""

from __future__ import annotations

import numpy as np

from vgtsim.output.html_loads import member_rows, reaction_rows


def test_peaks_of_the_reactions_are_in_the_table(site, log):
    rows = reaction_rows(site, log)
    assert f"{log.mast_reaction[:, 2].max() / 1e3:.2f} kN at" in rows
    assert rows.count("<tr>") == 2


def test_most_used_member_comes_first(site, log, report):
    used = report.series["utilisation"]
    first = site.truss.members[int(np.unravel_index(np.nanargmax(used), used.shape)[1])].name
    rows = member_rows(site, log, report)
    assert rows.index(first) < 60
    assert f"{1 / np.nanmax(used) - 1:.2f}" in rows
