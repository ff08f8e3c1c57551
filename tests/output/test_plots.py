"""Plots show the figures they are given, beside their limits, with units."""

import dataclasses
import re

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from vgtsim.log import outline
from vgtsim.output.colours import force_colours, scale_end
from vgtsim.output.figure import styled, to_svg
from vgtsim.output.html_report import list_plots
from vgtsim.output.run_plots import (
    plot_actuator_forces,
    plot_actuator_lengths,
    plot_axial_forces,
    plot_clearance,
    plot_closure,
)
from vgtsim.output.truss_plot import plot_truss, worst_instant
from vgtsim.verification import Evidence, goal_name

UNIT = re.compile(r", (m|mm|kN|kN·m|s|°)\b|, °|^m$|over capacity| kN ")


def flat_lines(axes):
    """Ordinates of the horizontal lines."""
    return {
        float(line.get_ydata()[0])
        for line in axes.lines
        if np.ptp(line.get_ydata()) == 0 and len(line.get_ydata()) == 2
    }


def test_holds_are_the_settled_records(log):
    held = np.zeros(len(log.time), bool)
    for hold in outline(log).holds:
        held[hold.first : hold.last + 1] = True
        assert (log.goal[hold.first : hold.last + 1] == hold.goal).all()
    np.testing.assert_array_equal(held, log.settled)


@pytest.mark.parametrize("settled", [True, False])
def test_a_run_that_never_changes_has_one_hold_or_none(log, settled):
    same = dataclasses.replace(log, settled=np.full(len(log.time), settled), goal=np.zeros(len(log.time), np.int64))
    assert len(outline(same).holds) == settled


def test_before_the_first_goal_there_is_no_name(site):
    assert goal_name(site, -1) == ""
    assert goal_name(site, 0) == site.task.motion.goals[0].name


def test_every_ordinate_has_its_unit(judged):
    for plot in list_plots(judged):
        with styled():
            figure = plot.plot(judged)
        labels = [axes.get_ylabel() for axes in figure.axes if axes.axison and axes.get_ylabel()]
        assert labels
        assert all(UNIT.search(label) for label in labels), labels


def test_limits_are_drawn(judged, site):
    limits = site.task.limits
    assert limits.closure in flat_lines(plot_closure(judged).axes[0])
    assert limits.clearance * 1e3 in flat_lines(plot_clearance(judged).axes[0])
    lengths, forces = plot_actuator_lengths(judged), plot_actuator_forces(judged)
    for index, module in enumerate(site.arm.active):
        cylinder = site.arm.cylinders[module.cylinder]
        assert {cylinder.retracted, cylinder.extended} <= flat_lines(lengths.axes[index])
        assert {-cylinder.push / 1e3, cylinder.pull / 1e3} <= flat_lines(forces.axes[index])


def test_members_that_carry_most_are_named_and_the_others_enveloped(judged, site, log):
    axes = plot_axial_forces(judged).axes[0]
    axial = log.axial(site.truss.ends) / 1e3
    order = np.argsort(-np.abs(axial).max(axis=0))
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert [site.truss.members[index].name for index in order[: len(names) - 1]] == names[1:]
    others = axial[:, order[len(names) - 1 :]]
    (band,) = axes.collections
    drawn = band.get_paths()[0].vertices[:, 1]
    assert drawn.max() == pytest.approx(others.max())
    assert drawn.min() == pytest.approx(others.min())


def test_the_truss_is_drawn_at_the_instant_of_greatest_utilisation(judged, site, log, report):
    record, member = worst_instant(judged)
    assert report.series["utilisation"][record, member] == report.series["utilisation"].max()
    axial = log.axial(site.truss.ends)[record]
    wanted = np.unique(force_colours(axial, scale_end(axial)).round(9), axis=0)
    views = [
        item
        for axes in plot_truss(judged).axes
        for item in axes.collections
        if isinstance(item, LineCollection) and len(item.get_segments()) == len(site.truss.members)
    ]
    assert len(views) == 3
    for view in views:
        np.testing.assert_array_equal(np.unique(view.get_colors().round(9), axis=0), wanted)


def test_svg_takes_the_colour_of_the_page(judged):
    with styled():
        svg = to_svg(plot_closure(judged), "closure", "Closure")
    assert "currentColor" in svg
    assert "#010203" not in svg
    assert svg.startswith("<svg")
    assert svg.endswith("</svg>")


def test_history_of_the_load_on_the_riser_is_drawn(judged, site, log):
    (riser,) = [item for item in list_plots(judged) if item.name == "riser"]
    with styled():
        force, moment = riser.plot(judged).axes
    expected = Evidence(site, log).riser_reaction / 1e3
    for axes, part in ((force, expected[:, :3]), (moment, expected[:, 3:])):
        drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
        for axis, name in enumerate("xyz"):
            np.testing.assert_allclose(drawn[name], part[:, axis])
        np.testing.assert_allclose(drawn["magnitude"], np.linalg.norm(part, axis=1))
