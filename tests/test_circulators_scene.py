"""Among the circulators of the type IV tank: where the arm is sent, there is one between it and the mast."""

from __future__ import annotations

import numpy as np

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
