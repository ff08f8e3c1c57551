"""Among the circulators of the type IV tank: where the arm is sent, there is one between it and the mast."""

from __future__ import annotations

import numpy as np
import pytest

import vgtsim


def test_goals_lie_behind_circulators():
    site = vgtsim.load("type_iv_circulators")
    goals = {goal.name: np.array(goal.position[:2]) for goal in site.task.motion.goals}
    places = {
        item.name: item.radius * np.array([np.cos(item.azimuth), np.sin(item.azimuth)]) for item in site.tank.standing
    }
    assert sum(name.startswith("alc_") for name in places) == 22
    for name in ("alc_1", "alc_2"):
        goal, item = goals[f"behind_{name}"], places[name]
        along = goal / np.linalg.norm(goal)
        assert along @ item < np.linalg.norm(goal) - 1  # the circulator stands before it
        assert np.linalg.norm(item - along * (along @ item)) < 0.381  # and the line from the mast goes through it


@pytest.mark.slow
def test_the_arm_comes_in_between_circulators_and_leaves():
    site = vgtsim.load("type_iv_circulators")
    plan = vgtsim.plan(site)
    assert [leg.name for leg in plan.legs] == [stage.name for stage in site.task.stages]
    way_in, way_out = plan.legs[0], plan.legs[-1]
    assert way_in.feed is not None
    assert way_out.feed is not None
    assert way_out.feed[-1] == pytest.approx(way_in.feed[0], abs=1e-9)
    assert way_out.lengths[-1] == pytest.approx(way_in.lengths[0], abs=1e-9)
    for leg in plan.legs[1:-1]:
        assert leg.clearance >= site.clearance
        worst, places = site.surroundings.clearance(site.chain.inputs_from_lengths(leg.lengths[::50]))
        assert worst.min() >= leg.clearance - 1e-3, places[int(worst.argmin())]  # places between those that were judged
    low = way_out.feed == 0  # back to the end of the way in, among the circulators
    q = site.chain.inputs_from_lengths(way_out.lengths[low][::50])
    assert site.surroundings.clearance(q)[0].min() >= site.clearance - 1e-3
