"""A run that cuts waste passes, and each fault in it is caught by the row that is there for it."""

from __future__ import annotations

import pytest
from cutting_faults import CUT_LOG_FAULTS, CUT_RUN_FAULTS
from digging import over_waste, sweep
from faults import MOVING
from spoiling import each, failed, judge, run_spoilt_plant

from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import verify
from vgtsim.verification.measures import Finding
from vgtsim.verification.report import MEASURES

ROWS = (
    "waste removed a second over the tool's rate",
    "removed waste against the bed",
    "removed waste against path and rate of the tool",
    "waste removed beyond the tool's reach",
    "tool force error over its rating",
    "commanded tool to the plan",
)
# of an arm that is lifted by no hoist and asked for no goal here: stages and goals are those of a whole mission
LEADER = "axis from the leader's path over the planned"  # a programme that is made by hand follows none
BESIDE = {LEADER, "tool position at a settled goal", "tool direction at a settled goal", "least distance to anything"}


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(over_waste(reach_scene))


@pytest.fixture(scope="module")
def program(site):
    return sweep(site)


@pytest.fixture(scope="module")
def log(site, program):
    return run(site, program)


@pytest.fixture(scope="module")
def clean(site, log, program):
    return verify(site, log, program)


def test_run_without_a_fault_passes(site, log, clean):
    assert {row for row in ROWS if row not in {check.quantity for check in clean.checks}} == set()
    assert failed(clean).keys() <= BESIDE
    rows = {check.quantity: check for check in clean.checks}
    assert rows[MOVING].measured < 1e-6  # by the accelerations in the log of a mission, not by records 40 ms apart
    path = rows[ROWS[2]]
    assert f"{log.removed[-1]:.4g} m³ removed" in path.detail
    assert f"{log.removed[-1] * site.tank.waste.density:.4g} kg" in path.detail


@each(CUT_LOG_FAULTS)
def test_fault_in_the_log(site, log, program, clean, fault):
    judge(fault, verify(site, fault.spoil(log), program), clean)


@each(CUT_RUN_FAULTS)
def test_fault_in_the_run(site, program, clean, monkeypatch, fault):
    judge(fault, verify(site, run_spoilt_plant(fault, site, program, monkeypatch), program), clean)


def test_what_was_removed_is_told_by_the_last_stretch_of_a_long_log():
    row = next(measure for measure in MEASURES if measure.quantity == "removed waste against path and rate of the tool")
    joined = row.join([Finding(value=2.0, summary="half"), Finding(value=1.0, summary="whole")])
    assert (joined.value, joined.detail) == (2.0, "whole")
