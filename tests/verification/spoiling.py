"""The loop of all fault tests: put a fault into the model or the run, and see which rows of the report fail by it."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from faults import Fault

from vgtsim.log import RunLog
from vgtsim.mjcf import build_model
from vgtsim.planning import Tour
from vgtsim.plant import Plant, run, runs
from vgtsim.site import Site
from vgtsim.verification import Report


def each(faults: Sequence[Fault]) -> pytest.MarkDecorator:
    """A test for each fault, by its name."""
    return pytest.mark.parametrize("fault", faults, ids=lambda fault: fault.what)


def failed(report: Report) -> dict[str, float]:
    """Rows that fail, and how far each is over its limit."""
    return {row.quantity: row.measured / max(row.limit, 1e-12) for row in report.checks if not row.passed}


def judge(fault: Fault, report: Report, clean: Report) -> None:
    """The row that is there for the fault fails, and did not before; without one, nothing else fails than before."""
    before, after = failed(clean), failed(report)
    assert bool(fault.caught) is not bool(fault.reason)
    assert (fault.caught in after.keys() - before.keys()) if fault.caught else after.keys() == before.keys(), after


def run_spoilt_model(fault: Fault, site: Site, program: Tour) -> RunLog:
    """The log of a run whose model is spoilt."""
    model = build_model(site)
    fault.spoil(model)
    return run(site, program, model)


def run_spoilt_plant(fault: Fault, site: Site, program: Tour, monkeypatch: pytest.MonkeyPatch) -> RunLog:
    """The log of a run that is spoilt before each step."""

    class Spoilt(Plant):
        def _advance(self):
            fault.spoil(self)
            super()._advance()

    monkeypatch.setattr(runs, "Plant", Spoilt)
    return run(site, program)
