"""A run of an offset arm: its bending is held against statics, and reported; a wrong one is found and named."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from offset_arms import OFFSET, with_offset
from playing import bend, change, out_of_the_tank, play, shorten

from vgtsim.site import Site
from vgtsim.verification import Evidence, members, verify

pytestmark = pytest.mark.long

AT_REST = 1e-6  # of the greatest bending moment of the run
MOVING = 1e-4  # the same: differences of positions, spin of barrels about their axes, friction of pins


@pytest.fixture(scope="module")
def scene(reach_scene):
    """One module of the arm, with offset."""
    whole = dataclasses.replace(reach_scene, manipulator=with_offset(reach_scene.manipulator))
    return change(shorten(whole, 1), log_rate=40.0)


@pytest.fixture(scope="module")
def log(scene):
    return play(scene, bend(scene, [0.6], [0.4]), bend(scene, [0.7], [-2.0]), 20.0, out_of_the_tank)


def bending_rows(scene, log):
    return [check for check in verify(Site(scene), log).checks if check.quantity.startswith("bending")]


def test_a_run_reports_its_bending_and_passes(scene, log):
    rest, moving = bending_rows(scene, log)
    assert rest.passed
    assert moving.passed
    assert rest.measured < AT_REST
    assert moving.measured < MOVING
    assert rest.name == "axial_purity"
    greatest = np.linalg.norm(log.member_moment, axis=-1).max()
    force = np.abs(log.axial(Site(scene).chain.truss.ends)).max()
    assert 10.0 < greatest < force * OFFSET
    assert "bending moment up to " in moving.detail
    assert float(moving.detail.split()[4]) >= 0.999 * greatest


def test_all_purity_of_the_other_members_is_kept(scene, log):
    found = Evidence(Site(scene), log)
    assert members.check_moment(found).value < 1e-6
    assert members.check_shear(found).value < 1e-2


@pytest.mark.parametrize("field", ["member_moment", "member_force"])
def test_bending_that_statics_do_not_give_is_found(scene, log, field):
    """A tenth more moment, or shear, in one actuator."""
    truss = Site(scene).chain.truss
    index = int(truss.ring_actuators[0, 1])
    wrong = np.array(getattr(log, field))
    wrong[:, index] *= 1.1
    rest, moving = bending_rows(scene, dataclasses.replace(log, **{field: wrong}))
    assert not rest.passed
    assert not moving.passed
    assert rest.where == moving.where == truss.member_names[index]


def test_torsion_is_found(scene, log):
    truss = Site(scene).chain.truss
    index = int(truss.ring_actuators[0, 2])
    wrong = np.array(log.member_moment)
    wrong[:, index] += 0.05 * np.abs(wrong).max() * log.directions(truss.ends)[:, index]
    rest, moving = bending_rows(scene, dataclasses.replace(log, member_moment=wrong))
    assert not rest.passed
    assert not moving.passed


def test_an_arm_without_offset_has_no_such_rows(reach_scene):
    plain = change(shorten(reach_scene, 1), log_rate=40.0)
    pose = bend(plain, [0.6], [0.4])
    assert bending_rows(plain, play(plain, pose, pose, 0.25)) == []
