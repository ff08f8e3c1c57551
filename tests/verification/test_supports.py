"""The mast and what it loads: the same in report, site and simulated model."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, play, shorten

from vgtsim.mjcf import build_spec, names
from vgtsim.site import Site
from vgtsim.verification import Evidence
from vgtsim.verification.hoist import check_guide, find_guide_forces

pytestmark = pytest.mark.long

ROUNDING = 1e-9  # relative: sums of some hundred masses
HELD = 1e-5  # of the weight: an arm that settles still moves a little


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(reach_scene)


@pytest.fixture(scope="module")
def log(reach_scene):
    short = change(shorten(reach_scene, 1), log_rate=40.0)
    return play(short, bend(short, [0.4], [0.4]), bend(short, [0.6], [0.8]), 6.0)


def moving_mass(model):
    """Mass of everything but the tank, kg."""
    return float(model.body_mass[model.body_weldid != 0].sum())


def test_model_and_site_have_one_mast(site):
    model = build_spec(site).compile()
    assert model.body(names.MAST).mass[0] == pytest.approx(site.mast.mass, rel=ROUNDING)
    assert site.mast.mass == pytest.approx(1432, abs=0.5)  # reference scene, kg
    assert site.load_model.mass + site.mast.mass == pytest.approx(moving_mass(model), rel=ROUNDING)


def test_reported_reaction_at_rest_is_the_weight_of_all_that_the_model_hangs_in_the_riser(reach_scene, log):
    site = Site(shorten(reach_scene, 1))
    model = build_spec(site).compile()
    weight = moving_mass(model) * site.task.simulation.gravity
    found = Evidence(site, log).riser_reaction[-1]
    assert -found[2] == pytest.approx(weight, rel=HELD)
    assert np.abs(found[:2]).max() < HELD * weight


def test_riser_carries_the_mast_too_and_more_moment_by_its_height(reach_scene, log):
    site = Site(shorten(reach_scene, 1))
    rng = np.random.default_rng(3)
    log = dataclasses.replace(log, mast_reaction=1e4 * rng.standard_normal(log.mast_reaction.shape))
    riser, pivot, depth = Evidence(site, log).riser_reaction, -log.mast_reaction, site.task.mast.pivot_depth
    assert riser[:, 2] - pivot[:, 2] == pytest.approx(-site.mast.mass * site.task.simulation.gravity)
    assert riser[:, :2] == pytest.approx(pivot[:, :2])
    assert riser[:, 3] == pytest.approx(pivot[:, 3] + depth * pivot[:, 1])
    assert riser[:, 4] == pytest.approx(pivot[:, 4] - depth * pivot[:, 0])
    assert riser[:, 5] == pytest.approx(pivot[:, 5])


def test_rollers_of_a_guide_hold_the_mast_against_what_the_arm_does_to_it(reach_scene, log):
    """Forces and moments of arm and rollers on the mast add up to nothing sideways."""
    guide = reach_scene.tank.guide.model_copy(update={"force": 1e6})
    tank = reach_scene.tank.model_copy(update={"guide": guide})
    site = Site(dataclasses.replace(shorten(reach_scene, 1), tank=tank))
    rng = np.random.default_rng(4)
    feed = np.where(np.arange(log.count) < 3, 0.0, 2.5)
    log = dataclasses.replace(log, mast_reaction=1e4 * rng.standard_normal(log.mast_reaction.shape), feed=feed)
    run = Evidence(site, log)
    rollers = find_guide_forces(run)
    assert np.isnan(rollers[3:]).all()  # its foot stands above the lower ring
    for record in range(3):
        force, moment = -log.mast_reaction[record, :3], -log.mast_reaction[record, 3:]
        for height, roller in zip((guide.lower, guide.upper), rollers[record], strict=True):
            push = np.append(roller, 0.0)
            force = force + push
            moment = moment + np.cross([0, 0, tank.grade + height - site.scene.pivot_height], push)
        assert np.abs(force[:2]).max() < ROUNDING * 1e5
        assert np.abs(moment[:2]).max() < ROUNDING * 1e6
    greatest = np.linalg.norm(rollers[:3], axis=-1).max()
    assert check_guide.find(run).value == pytest.approx(greatest / 1e6)
