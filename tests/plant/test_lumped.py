"""Mass in the hubs: members carry one axial force and nothing else, whatever holds and moves the arm."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, out_of_the_tank, play, shorten

from vgtsim.mjcf import build_model, names
from vgtsim.site import Site
from vgtsim.statics import make_load_model
from vgtsim.verification import Evidence, shape, verify
from vgtsim.verification import members as checks

pytestmark = pytest.mark.long

SHEAR = 1e-6  # N
CLOSURE = 1e-6  # m
AGREEMENT = 1e-5  # m
POSES = {
    1: [([0.6], [0.4]), ([0.7], [0.8])],
    3: [([0.5, 0.5, 0.5], [0.3] * 3), ([0.4, 0.5, 0.4], [0.3] * 3)],
}
SETTINGS = {
    "rigid": {},
    "elastic": {"members": "elastic", "timestep": 2e-3, "log_rate": 100.0, "damping_ratio": 0.5},
}


def lump(scene, count, **settings):
    short = shorten(scene, count)
    motion = short.task.motion.model_copy(update={"settle_speed": 1e-6})
    short = dataclasses.replace(short, task=short.task.model_copy(update={"motion": motion}))
    return change(short, **({"log_rate": 40.0, "member_mass": "lumped"} | settings))


@pytest.mark.parametrize("count", POSES)
@pytest.mark.parametrize("members", SETTINGS)
def test_members_of_a_moving_arm_carry_no_shear(reach_scene, count, members):
    scene = lump(reach_scene, count, **SETTINGS[members])
    start, end = (bend(scene, *pose) for pose in POSES[count])
    log = play(scene, start, end, 5.0, out_of_the_tank)
    found = Evidence(Site(scene), log)
    assert log.settled.any()
    assert shape.check_closure(found).value < CLOSURE
    assert checks.check_moment(found).value < SHEAR
    assert checks.check_shear(found).value < SHEAR
    assert np.linalg.norm(found.shear, axis=-1).max() < SHEAR
    assert checks.check_axial_settled(found).value < 1e-6
    assert checks.check_axial_moving(found).value < 1e-2
    assert checks.check_reaction(found).value < 1e-2
    agreement = shape.check_kinematics if members == "rigid" else shape.check_settled_shape
    assert agreement(found).value < AGREEMENT
    assert np.abs(found.axial).max() > 1e3


def test_mass_of_the_model_is_that_of_the_description_either_way(reach_scene):
    """Hubs and tip take up what the members lose."""
    masses = []
    for kind in ("distributed", "lumped"):
        scene = change(reach_scene, member_mass=kind)
        chain, task = Site(scene).chain, scene.task
        told = make_load_model(chain, task.payload, task.simulation.gravity, lumped=kind == "lumped").mass
        model = build_model(Site(scene))
        others = [i for i in range(1, model.nbody) if model.body(i).name.startswith(("tank", names.MAST))]
        others.remove(model.body(names.FLANGE).id)
        built = model.body_mass.sum() - model.body_mass[others].sum()
        assert built == pytest.approx(told, rel=1e-9)
        masses.append(told)
    assert masses[0] == pytest.approx(masses[1], rel=1e-12)


def test_a_spread_mass_taken_for_a_lumped_one_is_found_out(reach_scene):
    spread = change(shorten(reach_scene, 1), log_rate=40.0)
    q = bend(spread, *POSES[1][0])
    log = play(spread, q, q, 0.25, out_of_the_tank)
    report = verify(Site(change(spread, member_mass="lumped")), log)
    shear = next(check for check in report.checks if "mass in the hubs" in check.quantity)
    assert not shear.passed
    assert shear.limit == SHEAR
