"""The line of conveyance in the simulated arm: its weight and its couples are those of statics, whatever the members are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, play, shorten

from vgtsim.description.conveyance import Conveyance
from vgtsim.mjcf import build_model
from vgtsim.plant import Plant
from vgtsim.site import Site, load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

HOSE = Conveyance(diameter=0.13, bore=0.1, mass=4.0, contents=1300.0, bend_radius=0.5, bending_stiffness=5000.0)
FORCES = (
    "error at rest over largest force",
    "error in motion over largest force",
    "mast reaction error at rest over the reaction",
    "room in the truss about the line",
    "bend of the line over its greatest",
)


@pytest.fixture(scope="module")
def scene():
    scene = change(shorten(load_site("arm9_nullspace").scene, 2), log_rate=25.0)
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"conveyance": HOSE}))


@pytest.mark.parametrize("members", ["rigid", "sections"])
def test_forces_of_members_hold_the_hose(scene, members):
    scene = change(scene, members=members, timestep=0.02)
    log = play(scene, bend(scene, [0.5, 0.3], [0.4, 0.9]), bend(scene, [0.55, 0.25], [0.5, 0.8]), 1.5)
    report = verify(Site(scene), log)
    rows = {check.quantity: check for check in report.checks}
    for name in FORCES:
        assert rows[name].passed, rows[name]
    held = np.abs(log.actuator_force).max()
    bare = dataclasses.replace(scene, task=scene.task.model_copy(update={"conveyance": None}))
    other = play(bare, bend(scene, [0.5, 0.3], [0.4, 0.9]), bend(scene, [0.55, 0.25], [0.5, 0.8]), 1.5)
    assert held > 1.05 * np.abs(other.actuator_force).max()


def test_the_model_weighs_what_statics_weighs(scene):
    site = Site(scene)
    model = build_model(site)
    bare = build_model(Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"conveyance": None}))))
    nodes = [model.body(name).id for name in ("m1/top/1", "m2/top/1")]
    assert (np.array(model.body_mass) > np.array(bare.body_mass))[nodes[0]]
    line = HOSE.density * np.linalg.norm(np.diff(site.chain.frames(site.chain.straight)[1], axis=0), axis=1)
    assert model.body_mass.sum() - bare.body_mass.sum() == pytest.approx(line.sum() - line[0] / 2, rel=1e-9)


def test_an_elastic_arm_stands_where_it_settles_under_its_hose(scene):
    """It starts at rest and stays so; without the couples in the simulation it would leave by some micrometres and ring."""
    scene = change(scene, members="elastic", timestep=0.01, damping_ratio=0.0)
    plant = Plant(Site(scene))
    stood = plant.reset(inputs=bend(scene, [0.5, 0.3], [0.4, 0.9])).nodes.copy()
    plant.step(40)
    stays = np.abs(plant.state.nodes - stood).max()
    plant._correction._loads = ()
    plant.data.xfrc_applied[:] = 0.0
    plant.step(40)
    assert np.abs(plant.state.nodes - stood).max() > 100 * stays
