"""The step that a plan needs: the longest within its bounds, and shorter near things and at speed."""

from __future__ import annotations

import numpy as np
import pytest
from playing import bend, change, shorten
from scipy.interpolate import make_interp_spline

from vgtsim.planning.pace import STEP_BOUND, choose_step, find_bounds, find_speed, name_bound
from vgtsim.planning.timing import make_limits, time_path
from vgtsim.site import Site


@pytest.fixture(scope="module")
def scene(reach_scene):
    return shorten(reach_scene, 1)


@pytest.fixture(scope="module")
def site(scene):
    return Site(scene)


@pytest.fixture(scope="module")
def way(scene, site):
    """From one bend of the module to another."""
    inputs = np.linspace(bend(scene, [0.2], [0.0]), bend(scene, [0.5], [0.8]), 8)
    motion = scene.task.motion
    limits = make_limits(site.chain, motion.rate_fraction, motion.acceleration)
    return time_path(site.chain, make_interp_spline(np.linspace(0, 1, 8), inputs, k=5), limits)


def test_a_scene_may_fix_its_step(scene, way):
    fixed = Site(change(scene, timestep=5e-3))
    assert choose_step(fixed, find_bounds(fixed, [(way, 0.1)])) == fixed.timestep == 5e-3


def test_without_need_the_step_is_the_longest_of_members_and_drives(scene, site, way):
    assert choose_step(site, find_bounds(site, [(way, 10.0)])) == site.timestep == pytest.approx(0.02)
    servo = Site(change(scene, drive="servo"))
    assert choose_step(servo, find_bounds(servo, [(way, 10.0)])) == pytest.approx(0.01)


@pytest.mark.parametrize("clearance", [0.005, 0.002, 0.001])
def test_near_things_nothing_travels_more_than_half_of_the_clearance_between_two_looks(site, way, clearance):
    step = choose_step(site, find_bounds(site, [(way, 10.0), (way, clearance)]))
    period, speed = 1 / site.task.simulation.log_rate, find_speed(site, way, 0.02)
    assert period / step == pytest.approx(round(period / step))
    assert step * speed <= clearance / 2
    assert period / (period / step - 1) * speed > clearance / 2  # a longer one would not do


def test_tight_limits_shorten_the_step(scene, way):
    limits = scene.task.limits.model_copy(update={"closure": 1e-11})
    task = scene.task.model_copy(update={"limits": limits})
    tight = Site(type(scene)(task, scene.manipulator, scene.tank, scene.file))
    assert choose_step(tight, find_bounds(tight, [(way, 10.0)])) < 0.02


@pytest.mark.parametrize(
    ("simulation", "limits", "clearance", "bound"),
    [
        ({}, {}, 10.0, "members_and_drives"),
        ({"log_rate": 100.0}, {}, 10.0, "records"),
        ({}, {"closure": 1e-11}, 10.0, "closure"),
        ({}, {"kinematics_agreement": 1e-10}, 10.0, "kinematics_agreement"),
        ({}, {}, 1e-3, "clearance"),
        ({"timestep": 1e-3}, {}, 10.0, "scene"),
    ],
)
def test_a_log_names_what_set_its_step(scene, way, simulation, limits, clearance, bound):
    changed = change(scene, **simulation)
    task = changed.task.model_copy(update={"limits": changed.task.limits.model_copy(update=limits)})
    site = Site(type(scene)(task, scene.manipulator, scene.tank, scene.file))
    bounds = find_bounds(site, [(way, clearance)])
    assert name_bound({STEP_BOUND + name: value for name, value in bounds.items()} | {"timestep_s": 1e-9}) == bound
    assert choose_step(site, bounds) <= bounds[bound] * (1 + 1e-9)
    assert name_bound({"timestep_s": 0.01}) is None


def test_a_light_damping_holds_only_at_short_steps(scene):
    """The least damping of a step grows with it, so a smaller ratio asks for a shorter one."""
    steps = [
        Site(change(scene, members="elastic", log_rate=50.0, damping_ratio=ratio)).timestep for ratio in (0.2, 0.01)
    ]
    assert steps[1] < steps[0] <= 0.01
