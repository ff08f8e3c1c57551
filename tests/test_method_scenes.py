"""Scenes whose goals are met by the dissertation's methods: planned whole, and their first leg run and judged."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import Method, load_scene
from vgtsim.planning import plan_tour, solve_first_goal
from vgtsim.planning.timing import make_limits
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
SCENES = ("arm9_nullspace", "arm15_coupled")
GOAL = 2e-9  # each row is met to 1e-9 m and rad
ROUNDING = 1e-12
SOLVED = 1e-10  # rad and m, of inputs that are found from lengths again


def with_motion(scene, **updates):
    motion = scene.task.motion.model_copy(update=updates)
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))


@pytest.fixture(scope="module", params=SCENES)
def scene(request):
    return load_scene(ROOT / f"scenes/{request.param}.toml")


@pytest.fixture(scope="module")
def program(scene):
    return plan_tour(Site(scene))


def test_every_goal_is_met_and_every_leg_is_clear(scene, program):
    chain, motion = Site(scene).chain, scene.task.motion
    for leg, goal in zip(program.legs, motion.goals, strict=True):
        position, direction = chain.tool(leg.q)
        assert np.linalg.norm(position - goal.position) < GOAL
        assert np.linalg.norm(np.cross(direction, goal.direction)) < GOAL
        assert leg.clearance >= motion.clearance


def test_coupled_goals_are_met_by_coupled_modules(scene, program):
    pairs = scene.coupled_modules() if scene.task.motion.method is Method.COUPLED else ()
    apart = [np.ptp(leg.q.reshape(-1, 3)[list(pair)], axis=0).max() for leg in program.legs for pair in pairs]
    assert len(apart) == (6 if scene.task.name == "arm15_coupled" else 0)
    assert all(gap < ROUNDING for gap in apart)


def test_coupled_modules_stay_coupled_on_the_way(scene, program):
    """At every step of the plan, from the commanded lengths alone."""
    pairs = scene.coupled_modules() if scene.task.motion.method is Method.COUPLED else ()
    for leg in program.legs:
        shapes = Site(scene).chain.inputs_from_lengths(leg.lengths).reshape(len(leg.lengths), -1, 3)
        assert np.ptp(shapes, axis=0).max() > 0.05
        for follower, leader in pairs:
            assert np.abs(shapes[:, follower] - shapes[:, leader]).max() < SOLVED


def test_few_modules_move_at_a_time_on_an_anchored_way():
    """Three at most between any two steps, the strokes and the clearance kept; each comes to rest before the next ones start."""
    scene = with_motion(load_scene(ROOT / "scenes/arm15_coupled.toml"), method=Method.ANCHORED, coupling=None)
    site = Site(with_motion(scene, goals=scene.task.motion.goals[:1]))
    tour = plan_tour(site)
    q = site.chain.inputs_from_lengths(tour.legs[0].lengths)
    moving = np.abs(np.diff(q.reshape(len(q), -1, 3), axis=0)).max(axis=2) > SOLVED
    assert moving.sum(axis=1).max() == 3
    assert moving.any(axis=0).all()
    assert site.surroundings.clearance(q[::20])[0].min() >= site.clearance - 1e-3
    assert np.linalg.norm(site.chain.tool(q[-1])[0] - site.task.motion.goals[0].position) < GOAL
    rates = np.abs(np.diff(tour.legs[0].lengths, axis=0)) / tour.timestep
    limits = make_limits(site.chain, site.task.motion.rate_fraction, site.task.motion.acceleration)
    assert np.all(rates <= 1.01 * limits.rate)
    hardest = np.abs(np.diff(tour.legs[0].lengths, n=2, axis=0)).max() / tour.timestep**2
    assert hardest <= 1.01 * limits.acceleration


def test_coupled_modules_move_and_rest_together_on_an_anchored_way():
    """Modules m1 and m2 are one group, so the windows of three groups have four modules, and the last one goes by itself."""
    scene = with_motion(
        load_scene(ROOT / "scenes/arm15_coupled.toml"), method=Method.ANCHORED, coupling=(("m2", "m1"),)
    )
    site = Site(with_motion(scene, goals=scene.task.motion.goals[:1]))
    tour = plan_tour(site)
    q = site.chain.inputs_from_lengths(tour.legs[0].lengths)
    shapes = q.reshape(len(q), -1, 3)
    assert np.abs(shapes[:, 0] - shapes[:, 1]).max() < SOLVED
    moving = np.abs(np.diff(shapes, axis=0)).max(axis=2) > SOLVED
    assert {tuple(row) for row in moving} <= {(True,) * 4 + (False,), (False,) * 4 + (True,), (False,) * 5}
    assert moving.any(axis=0).all()
    assert np.linalg.norm(site.chain.tool(q[-1])[0] - site.task.motion.goals[0].position) < GOAL


@pytest.mark.slow
def test_first_leg_passes_every_check(scene, program):
    first = with_motion(scene, goals=scene.task.motion.goals[:1])
    part = dataclasses.replace(program, legs=program.legs[:1])
    report = verify(Site(first), run(Site(first), part))
    assert report.passed, [check for check in report.checks if not check.passed]


@pytest.mark.parametrize("method", ["anchored", "shape"])
def test_other_methods_find_the_first_goal_of_a_scene(method):
    scene = load_scene(ROOT / "scenes/arm15_coupled.toml")
    scene = with_motion(scene, method=Method(method), coupling=None)
    q, goal = solve_first_goal(Site(scene)), scene.task.motion.goals[0]
    assert np.linalg.norm(Site(scene).chain.tool(q)[0] - goal.position) < GOAL
    assert np.abs(q[:3] - q[3:6]).max() > 0.01  # not coupled
