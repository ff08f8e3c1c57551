"""The reference tour on rigid sections passes every check of its scene."""

from __future__ import annotations

import pytest

import vgtsim


@pytest.mark.slow
def test_every_check_passes():
    site = vgtsim.load("type_ii_sections")
    tour = vgtsim.plan(site)
    report = vgtsim.verify(site, vgtsim.run(site, tour))
    assert [check.quantity for check in report.checks if not check.passed] == []
    assert report.performance["timestep_s"] == 0.04
