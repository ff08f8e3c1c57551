"""The calculation sheet against formulas written out by hand."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from vgtsim.output.calculation import make_sheet
from vgtsim.output.truss_plot import worst_instant
from vgtsim.statics import effective_area, find_use
from vgtsim.verification import JudgedRun

pytestmark = pytest.mark.long

DIGITS = 5e-3  # relative: three digits are written


def use(site, log, report, role):
    """The run judged with the use of the members of one role alone, from statics."""
    found = find_use(site.load_model, site.sections, log.nodes, site.safety_factor)
    wanted = np.array([member.role == role for member in site.truss.members])
    series = {
        "utilisation": found.strength * wanted,
        "utilisation_tension": found.tension * wanted,
        "utilisation_compression": np.maximum(found.compression, found.rod) * wanted,
    }
    return JudgedRun(site, log, dataclasses.replace(report, series=dict(report.series) | series))


def read(sheet, quantity):
    """Value of a line in SI."""
    (text,) = (line[2] for line in sheet.lines if line[0] == quantity)
    figure, prefix = re.fullmatch(r"([\d.]+)(?: ([kMGm]?)(?:N|Pa|m|mm²))?", text).groups()
    return float(figure) * {"k": 1e3, "M": 1e6, "G": 1e9, "m": 1e-3}.get(prefix or "", 1.0)


def test_a_tube_is_calculated_as_by_hand(site, log, report):
    only = use(site, log, report, "longeron")
    sheet = make_sheet(only)
    record, index = worst_instant(only)
    tube = site.arm.tubes[sheet.section]
    steel = site.arm.materials[tube.material]
    wall = steel.design_wall * tube.wall
    area = math.pi / 4 * (tube.outer_diameter**2 - (tube.outer_diameter - 2 * wall) ** 2)
    radius = math.hypot(tube.outer_diameter, tube.outer_diameter - 2 * wall) / 4
    length = float(np.linalg.norm(np.subtract(*log.nodes[record, site.truss.ends[index]])))
    euler = math.pi**2 * steel.youngs_modulus / (length / radius) ** 2
    inelastic = length / radius <= 4.71 * math.sqrt(steel.youngs_modulus / steel.yield_strength)
    critical = 0.658 ** (steel.yield_strength / euler) * steel.yield_strength if inelastic else 0.877 * euler
    counted = effective_area(area, tube.outer_diameter / wall, steel.yield_strength, steel.youngs_modulus)
    assert sheet.member == site.truss.members[index].name
    assert read(sheet, "allowable compression") == pytest.approx(critical * counted / 1.67, rel=DIGITS)
    assert read(sheet, "allowable tension") == pytest.approx(steel.yield_strength * area / 1.67, rel=DIGITS)
    assert sheet.used == only.report.series["utilisation"].max()


@pytest.mark.parametrize("role", ["longeron", "actuator"])
def test_demand_over_capacity_is_the_use_in_the_report(site, log, report, role):
    only = use(site, log, report, role)
    sheet = make_sheet(only)
    uses = {line[0]: float(line[2]) for line in sheet.lines if line[0].startswith("use by")}
    assert uses[f"use by {sheet.mode}"] == max(uses.values())
    assert max(uses.values()) == pytest.approx(sheet.used, abs=5e-4)


def test_a_rod_has_its_own_lines(site, log, report):
    only = use(site, log, report, "actuator")
    sheet = make_sheet(only)
    record, index = worst_instant(only)
    part = site.arm.cylinders[sheet.section]
    length = float(np.linalg.norm(np.subtract(*log.nodes[record, site.truss.ends[index]])))
    modulus = site.arm.materials[part.material].youngs_modulus
    euler = math.pi**2 * modulus * math.pi * part.rod**4 / 64 / length**2
    assert read(sheet, "Euler load of the rod") == pytest.approx(euler, rel=DIGITS)
    assert read(sheet, "push at supply pressure") == pytest.approx(
        part.pressure * math.pi * part.bore**2 / 4, rel=DIGITS
    )


def test_without_figures_there_is_no_sheet(site, log, report):
    assert make_sheet(JudgedRun(site, log, dataclasses.replace(report, series={}))) is None
