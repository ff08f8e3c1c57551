"""The open test stand: nothing covers it, a tour is planned among its dummies, and the run passes every check."""

from __future__ import annotations

import mujoco
import pytest

import vgtsim
from vgtsim.mjcf import build_spec


@pytest.fixture(scope="module")
def site():
    return vgtsim.load("mockup")


@pytest.fixture(scope="module")
def tour(site):
    return vgtsim.plan(site)


def test_wall_and_dome_are_not_drawn_but_felt(site):
    model = build_spec(site).compile()
    names = {model.geom(k).name for k in range(model.ngeom)}
    assert {f"tank/{part}/back" for part in ("floor", "base", "sleeve_42in")} <= names
    assert (
        not {f"tank/{part}/{side}" for part in ("liner", "wall", "dome", "soil") for side in ("back", "front")} & names
    )
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "tank/wall/0/0") >= 0


@pytest.mark.long
def test_the_tour_keeps_clear(site, tour):
    assert [leg.name for leg in tour.legs] == ["low", "over_wall", "behind_dummy", "far_side"]
    assert min(leg.clearance for leg in tour.legs) >= site.clearance


@pytest.mark.slow
def test_every_check_passes(site, tour):
    report = vgtsim.verify(site, vgtsim.run(site, tour), tour)
    assert [check.quantity for check in report.checks if not check.passed] == []
