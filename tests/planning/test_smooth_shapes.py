"""Where waste is cut away, the shapes of a way in are held to what is left of it."""

from __future__ import annotations

import numpy as np
import pytest
from digging import BENT, over_waste
from playing import bend

from vgtsim.kinematics import azimuth
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.insertion import make_guide
from vgtsim.planning.smooth_shapes import Track, sum_up
from vgtsim.site import Site

CURVE = make_directrix(6.0, [(6.0, 1 / 4.0)])
NEAR, DEEP, ROUND = 1.5, 0.3, 1e-5  # m: within which nodes count, and of the pit; of a step of the coefficients


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(over_waste(reach_scene))


@pytest.fixture(scope="module")
def towards(site):
    return azimuth(site.chain, site.chain.tool(bend(site.scene, *BENT))[0])


@pytest.fixture(scope="module")
def dug(site):
    return site.lower_waste(site.diggings.start - DEEP)


def make_track(site, towards):
    guide = make_guide(site, CURVE, towards)
    return Track(guide=guide, aim=10.0, around=site.surroundings, clearance=NEAR)


def bent(track):
    """Coefficients of an arm that bends more and more."""
    half = track.basis[0].shape[2]
    return np.concatenate([np.full(half, 0.35), np.full(half, -0.2)])


def test_room_that_is_cut_counts(site, dug, towards):
    whole, less = make_track(site, towards), make_track(dug, towards)
    weights = bent(whole)
    assert sum_up(less, weights, sloped=False).value < 0.999 * sum_up(whole, weights, sloped=False).value


def test_slope_of_the_sum_over_a_pit_is_its_difference(dug, towards):
    track = make_track(dug, towards)
    weights = bent(track)
    aside = np.random.default_rng(3).normal(size=len(weights))
    ahead, behind = (sum_up(track, weights + sign * ROUND * aside, sloped=False).value for sign in (1, -1))
    slope = sum_up(track, weights, sloped=True).slope @ aside
    assert slope == pytest.approx((ahead - behind) / (2 * ROUND), rel=0.01)  # it takes rates of lengths as linear
