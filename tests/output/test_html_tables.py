"""Tables of the report: members, reactions, facts."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from vgtsim.output.html_tables import (
    describe_waste,
    group_checks,
    list_costs,
    list_members,
    list_reactions,
)


def test_peaks_of_the_reactions_are_in_the_table(judged, log):
    rows = list_reactions(judged)
    assert rows[0][1].startswith(f"{log.mast_reaction[:, 2].max() / 1e3:.2f} kN at")
    assert len(rows) == 2


def test_most_used_member_comes_first(judged, site, report):
    used = report.series["utilisation"]
    first = site.truss.members[int(np.unravel_index(np.nanargmax(used), used.shape)[1])].name
    rows = list_members(judged)
    assert rows[0][0] == first
    assert f"{1 / np.nanmax(used) - 1:.2f}" in rows[0]


def test_a_figure_far_below_its_limit_is_said_to_be_so(report):
    small = dataclasses.replace(report.checks[0], measured=3.97e-15, limit=1e-6, unit="m", sense="at most")
    just = dataclasses.replace(small, measured=2e-9)
    groups = group_checks(dataclasses.replace(report, checks=(small, just)))
    assert [row["measured"] for row in groups[0]["rows"]] == ["< 1 nm", "2 nm"]
    assert [row["share"] for row in groups[0]["rows"]] == [pytest.approx(3.97e-7), pytest.approx(0.2)]
    assert not any(group["rows"] or group["passed"] for group in groups[1:])


def test_waste_in_the_dish_is_a_spherical_cap(scene):
    """A cap of a sphere that is tangent to the knuckle: V = pi h² (3 R - h) / 3."""
    shell = scene.tank.shell
    # the dish meets the knuckle's arc tangentially at the dish depth: both centres and the joint are on one line
    inner, knuckle, depth = shell.inner_diameter / 2, shell.knuckle_radius, shell.dish_depth

    def sag(radius):
        return radius - math.sqrt(radius**2 - (radius * (inner - knuckle) / (radius - knuckle)) ** 2) - depth

    radius = brentq(sag, 1.001 * inner, 1e5)
    waste = scene.tank.waste
    assert waste.level < depth
    volume = math.pi * waste.level**2 * (3 * radius - waste.level) / 3
    said = describe_waste(scene.tank)
    assert f"{waste.kind}, {volume:.3g} m³, {waste.density * volume / 1000:.3g} t, " in said


def test_what_set_the_step_is_said_in_place_of_all_bounds():
    performance = {"timestep_s": 0.01, "step_bound_s_closure": 0.02, "step_bound_s_kinematics_agreement": 0.01}
    assert list_costs(performance) == [("time step", "0.01 s"), ("time step set by", "kinematics agreement")]
    assert list_costs({"timestep_s": 0.01}) == [("time step", "0.01 s")]
