"""The shipped records of operators, played whole: each run passes every check, and the limits were reached."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.control import Controller, rehearse
from vgtsim.plant import operate
from vgtsim.site import load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.slow

LIMITS = {"clearance: ", "lost direction ", "rate: ", "rating: ", "stroke: "}


@pytest.fixture
def held(monkeypatch):
    """Kinds of limits that held the arm in any step of a controller, from its own reports."""
    step, found = Controller.step, set()

    def watch(controller, state):
        lengths = step(controller, state)
        found.update(limit for limit in LIMITS if any(word.startswith(limit) for word in controller.report.held_by))
        return lengths

    monkeypatch.setattr(Controller, "step", watch)
    return found


@pytest.mark.parametrize("scene", ["live_raster", "live_limits"])
def test_a_record_runs_and_passes_every_check(scene, held):
    site = load_site(scene)
    log = operate(site)
    met = set(held)
    report = verify(site, log, rehearse(site, log))
    assert [(check.quantity, check.measured, check.limit) for check in report.checks if not check.passed] == []
    if scene == "live_limits":
        assert met == LIMITS
    else:
        assert np.linalg.norm(np.diff(log.tool_position, axis=0), axis=1).sum() > 3.0  # m of way over the waste
