from math import pi, sin
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_tank
from vgtsim.geometry import solids
from vgtsim.geometry.clearance import enclosure_distance
from vgtsim.geometry.profile import make_profile

TANK = load_tank(Path(__file__).parents[2] / "scenes/tanks/type_ii.toml")
PROFILE = make_profile(TANK.shell)
FLOOR, WALL = ("dish",), ("knuckle", "wall")
MAKERS = {
    "liner": lambda front: solids.make_liner(TANK, PROFILE, front, WALL),
    "floor": lambda front: solids.make_liner(TANK, PROFILE, front, FLOOR),
    "concrete": lambda front: solids.make_concrete(TANK, PROFILE, front, WALL),
    "dome": lambda front: solids.make_dome(TANK, PROFILE, front),
    "soil": lambda front: solids.make_soil(TANK, PROFILE, front),
    "riser": lambda front: solids.make_arm_riser(TANK, PROFILE, front),
}
ROUNDING = 1e-9  # m
# an inscribed polygon of 72 sides lacks this part of its circle
POLYGON = 1 - sin(2 * pi / 72) / (2 * pi / 72)
CHORD = 11.43 * (1 - np.cos(pi / 72)) + 2e-3  # m; sectors of 5 degrees, and chords along the arcs


@pytest.mark.parametrize("name", MAKERS)
def test_halves_are_closed_and_mirror_each_other(name):
    back, front = (MAKERS[name](side) for side in (False, True))
    for half in (back, front):
        assert half.is_watertight
        assert half.is_winding_consistent
    assert back.volume == pytest.approx(front.volume)
    assert back.volume > 0
    assert back.bounds[0, 1] > -ROUNDING
    assert front.bounds[1, 1] < ROUNDING


@pytest.mark.parametrize("name", MAKERS)
def test_solids_keep_out_of_the_tank(name):
    vertices = MAKERS[name](False).vertices
    assert enclosure_distance(TANK, PROFILE, vertices)[0].max() < ROUNDING + CHORD


def test_soil_reaches_grade_and_dome_has_its_thickness_on_the_crown():
    shell = TANK.shell
    soil, dome = MAKERS["soil"](False), MAKERS["dome"](False)
    assert soil.bounds[1, 2] == pytest.approx(shell.crown + shell.dome_thickness + shell.soil_cover)
    opening = TANK.arm_riser.bore / 2
    # at the opening the dome has fallen by opening² / (2 Rc)
    drop = opening**2 / (2 * PROFILE.pieces[-1].radius)
    assert dome.bounds[1, 2] == pytest.approx(shell.crown + shell.dome_thickness - drop, abs=2e-3)


def test_waste_fills_the_tank_to_its_level():
    for level in (TANK.waste.level, 2.5):
        waste = TANK.waste.model_copy(update={"level": level})
        solid = solids.make_waste(TANK.model_copy(update={"waste": waste}), PROFILE)
        assert solid.is_watertight
        assert solid.bounds[:, 2] == pytest.approx([0, level])
        # chords of 0.35 m in the dish take a further thousandth
        assert solid.volume == pytest.approx(PROFILE.volume(level), rel=POLYGON + 1e-3)


def test_small_risers_stand_in_their_place():
    for riser in TANK.risers:
        pipe = solids.make_riser(TANK, PROFILE, riser)
        middle = pipe.bounds.mean(axis=0)
        place = riser.radius * np.array([np.cos(riser.azimuth), np.sin(riser.azimuth)])
        assert middle[:2] == pytest.approx(place, abs=ROUNDING)
        assert pipe.bounds[1, 2] == pytest.approx(TANK.grade + riser.above_grade)
