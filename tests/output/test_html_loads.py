"""Tables of members and reactions."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.output.html_loads import member_rows, reaction_rows, riser_reaction


def test_riser_carries_the_mast_too_and_more_moment_by_its_height(scene, log):
    riser, depth = riser_reaction(scene, log), scene.task.mast.pivot_depth
    pivot = -log.mast_reaction
    mast = riser[:, 2] - pivot[:, 2]
    assert np.ptp(mast) == pytest.approx(0.0, abs=1e-6)
    assert mast[0] < 0
    assert riser[:, :2] == pytest.approx(pivot[:, :2])
    assert riser[:, 3] == pytest.approx(pivot[:, 3] + depth * pivot[:, 1])
    assert riser[:, 4] == pytest.approx(pivot[:, 4] - depth * pivot[:, 0])
    assert riser[:, 5] == pytest.approx(pivot[:, 5])


def test_peaks_of_the_reactions_are_in_the_table(scene, log):
    rows = reaction_rows(scene, log)
    assert f"{log.mast_reaction[:, 2].max() / 1e3:.2f} kN at" in rows
    assert rows.count("<tr>") == 2


def test_most_used_member_comes_first(log, report, chain):
    used = report.series["utilisation"]
    first = chain.truss.members[int(np.unravel_index(np.nanargmax(used), used.shape)[1])].name
    rows = member_rows(log, report, chain.truss)
    assert rows.index(first) < 60
    assert f"{1 / np.nanmax(used) - 1:.2f}" in rows
