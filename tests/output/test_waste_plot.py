"""The report of a run that cuts has the removed waste over time."""

from __future__ import annotations

import numpy as np
import pytest
from digging import over_waste, sweep

from vgtsim.output.html_report import list_plots
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, verify


@pytest.mark.long
def test_report_draws_the_waste_that_went(reach_scene):
    site = Site(over_waste(reach_scene, members="sections"))
    program = sweep(site)
    log = run(site, program)
    judged = JudgedRun(site, log, verify(site, log, program))
    plots = {plot.name: plot for plot in list_plots(judged)}
    assert f"{log.removed[-1]:.4g} m³ removed" in plots["waste"].caption
    volume, push = (axes.lines[0].get_ydata() for axes in plots["waste"].plot(judged).axes)
    assert volume == pytest.approx(1e3 * log.removed)
    assert np.max(push) == pytest.approx(site.diggings.tool.push)
