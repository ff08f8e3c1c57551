"""The shipped records of operators, played whole: each run passes every check, and the limits were reached."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.control import Controller, apply, rehearse
from vgtsim.plant import operate
from vgtsim.site import load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.slow

LIMITS = {"clearance: ", "lost direction ", "rate: ", "rating: ", "stroke: "}


@pytest.mark.parametrize("scene", ["live_raster", "live_limits"])
def test_a_record_runs_and_passes_every_check(scene):
    site = load_site(scene)
    log = operate(site)
    report = verify(site, log, rehearse(site, log))
    assert [(check.quantity, check.measured, check.limit) for check in report.checks if not check.passed] == []
    if scene == "live_limits":
        assert find_limits(site, log) == LIMITS
    else:
        assert np.linalg.norm(np.diff(log.tool_position, axis=0), axis=1).sum() > 3.0  # m of way over the waste


def find_limits(site, log):
    """Kinds of limits that held the arm, from the controller over the log."""
    controller, found = Controller(site), set()
    controller.start(log.commanded[0], site.start)
    waiting = list(site.scene.commands)

    class Seen:
        contacts, stopped = (), ""

    for k in range(log.count):
        while waiting and waiting[0].time <= log.time[k] + 1e-9:
            apply(controller, waiting.pop(0))
        Seen.commanded, Seen.lengths = log.commanded[k], log.actual[k]
        controller.step(Seen)
        found |= set(controller.report.held_by)
    return {limit for limit in LIMITS if any(word.startswith(limit) for word in found)}
