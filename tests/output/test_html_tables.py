"""Tables of the report: members, reactions, facts."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from vgtsim.output.html_tables import describe_waste, member_rows, reaction_rows


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
