from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.checks import RISER_SPARE, check_riser, riser_fit
from vgtsim.site import Site

INCH = 0.0254
ROUNDING = 1e-9


def with_arm(scene, **updates):
    arm = scene.manipulator.model_copy(update=updates)
    changed = dataclasses.replace(scene, manipulator=arm)
    return changed, Chain(arm, hanging_mount(scene.pivot_height))


def test_shipped_arm_leaves_an_inch_and_a_half(reach_scene):
    scene, chain = with_arm(reach_scene)
    fit = riser_fit(chain, scene.tank.arm_riser.bore)
    circle = scene.manipulator.face_side / np.sqrt(3)
    assert fit.spare == pytest.approx(21 * INCH - circle - 1.5 * INCH, abs=ROUNDING)
    assert fit.spare == pytest.approx(1.5 * INCH, abs=2e-6)
    check_riser(Site(scene))


def test_wider_hubs_do_not_fit_and_are_named_with_the_amount(reach_scene):
    hub = reach_scene.manipulator.hub.model_copy(update={"radius": 2 * INCH})
    scene, _ = with_arm(reach_scene, hub=hub)
    with pytest.raises(DescriptionError, match=r"node \w+/\w+/\d.*25\.40 mm.*12\.69 mm too little"):
        check_riser(Site(scene))


def test_longer_stowed_cylinders_push_the_mid_nodes_out(reach_scene):
    stowed = reach_scene.manipulator.stowed.model_copy(update={"cylinder_length": 0.85})
    scene, chain = with_arm(reach_scene, stowed=stowed)
    fit = riser_fit(chain, scene.tank.arm_riser.bore)
    assert "/mid/" in fit.place
    assert fit.spare == pytest.approx(21 * INCH - 0.85 / np.sqrt(3) - 1.5 * INCH, abs=ROUNDING)
    with pytest.raises(DescriptionError, match="mid"):
        check_riser(Site(scene))


def test_fat_tubes_do_not_fit_and_are_named(reach_scene):
    tubes = dict(reach_scene.manipulator.tubes)
    name = reach_scene.manipulator.active[0].longeron_tube
    tubes[name] = tubes[name].model_copy(update={"outer_diameter": 4 * INCH})
    scene, chain = with_arm(reach_scene, tubes=tubes)
    fit = riser_fit(chain, scene.tank.arm_riser.bore)
    assert fit.place.startswith("member ")
    assert fit.spare == pytest.approx(21 * INCH - scene.manipulator.face_side / np.sqrt(3) - 2 * INCH, abs=ROUNDING)


def test_fat_barrels_count_between_eye_and_mouth(reach_scene):
    cylinders = dict(reach_scene.manipulator.cylinders)
    name = reach_scene.manipulator.active[0].cylinder
    fat = cylinders[name] = cylinders[name].model_copy(update={"bore": 10 * INCH})
    scene, chain = with_arm(reach_scene, cylinders=cylinders)
    fit = riser_fit(chain, scene.tank.arm_riser.bore)
    side = scene.manipulator.stowed.cylinder_length
    along, apothem = (
        side / 2 - fat.eye,
        side / (2 * np.sqrt(3)),
    )  # the barrel's end from the middle of its pin line
    assert "actuator" in fit.place
    expected = 21 * INCH - np.hypot(along, apothem) - fat.barrel_diameter / 2
    assert fit.spare == pytest.approx(expected, abs=ROUNDING)


def test_stowed_length_outside_the_stroke_is_refused(reach_scene):
    stowed = reach_scene.manipulator.stowed.model_copy(update={"cylinder_length": 0.7})
    scene, _ = with_arm(reach_scene, stowed=stowed)
    with pytest.raises(DescriptionError, match=r"stowed\.cylinder_length"):
        check_riser(Site(scene))


def test_required_spare_is_an_inch_and_a_half_less_rounding():
    assert pytest.approx(1.5 * INCH, abs=1.1e-5) == RISER_SPARE
