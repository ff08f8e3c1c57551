"""The model of a scene whose arm hangs beside the tank's axis, among things of every shape: ours against MuJoCo's distances."""

import mujoco
import numpy as np
import pytest

from vgtsim import load
from vgtsim.geometry import make_profile
from vgtsim.mjcf import build_spec
from vgtsim.mjcf.tank import add_tank
from vgtsim.proximity import Proximity

APART = 2e-6  # m: what MuJoCo's search for the distance of convex solids leaves
STANDS_BACK = 0.002  # m: of the wedges about the bore, at the most


@pytest.fixture(scope="module")
def site():
    return load("side_riser")


@pytest.fixture(scope="module")
def model(site):
    return build_spec(site, {"start": site.start}).compile()


@pytest.fixture(scope="module")
def data(site, model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_kinematics(model, data)
    return data


def test_the_arm_hangs_from_its_riser(site, model, data):
    place = site.tank.arm_riser.place
    assert model.body("mast").pos[:2] == pytest.approx(place)
    found = np.array([data.site(name).xpos for name in site.truss.nodes])
    assert np.abs(found - site.chain.nodes(site.start)).max() < 1e-9


def test_distances_from_solids_are_those_of_mujoco(site, model, data):
    """Of the hubs' balls, and of capsules between them that the test puts there: MuJoCo's own members end at the hubs' skins."""
    around, nodes, radius = site.surroundings.obstacles, site.chain.nodes(site.start), site.arm.hub.radius
    spec = mujoco.MjSpec()
    add_tank(spec, site.tank)
    for k, (i, j) in enumerate(site.truss.ends[::7]):
        body = spec.worldbody.add_body(name=f"{k}")
        ends = [*nodes[i], *nodes[j]]
        body.add_geom(name=f"{k}", type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[radius, 0, 0], mass=1)
    apart = spec.compile()
    still, pair = mujoco.MjData(apart), np.empty(6)
    mujoco.mj_kinematics(apart, still)
    for item in site.tank.solids:
        column = around.names.index(item.name)
        felt = f"tank/{item.name}"
        for name, node in zip(site.truss.nodes, nodes, strict=True):
            theirs = mujoco.mj_geomDistance(model, data, model.geom(felt).id, model.geom(name).id, 50.0, pair)
            assert around.distances(node, node)[column] - radius == pytest.approx(theirs, abs=APART)
        for k, (i, j) in enumerate(site.truss.ends[::7]):
            theirs = mujoco.mj_geomDistance(apart, still, apart.geom(felt).id, apart.geom(f"{k}").id, 50.0, pair)
            assert around.distances(nodes[i], nodes[j])[column] - radius == pytest.approx(theirs, abs=APART)


def test_the_payload_is_as_far_from_everything_as_measured(site):
    found = Proximity(site).around(site.chain.nodes(site.start), site.chain.tool(site.start)[0])
    gap, _ = site.surroundings.least(site.start)
    assert set(found.places) >= {"analyser", "pump_1", "pump_2", "fallen_lance", "riser"}
    assert found.distance.min() > 0
    assert gap > site.clearance


def test_the_bore_is_felt_where_it_is(site, model):
    """A ball pushed from the bore's axis to its wall touches within what the wedges stand back."""
    spec = build_spec(site)
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint(name="ball")
    ball.add_geom(name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], contype=0, conaffinity=1, mass=1)
    probe = spec.compile()
    data, riser = mujoco.MjData(probe), site.tank.arm_riser
    address = probe.jnt_qposadr[probe.joint("ball").id]
    (x, y), rim = riser.place, make_profile(site.tank.shell).rim(riser.bore / 2, riser.radius)
    for turn in np.linspace(0, 2 * np.pi, 9):
        for height in (rim + 0.35, site.tank.grade - 0.2):
            for room, touches in ((0.001, False), (-STANDS_BACK, True)):
                away = riser.bore / 2 - 0.05 - room
                data.qpos[address : address + 7] = [
                    x + away * np.cos(turn),
                    y + away * np.sin(turn),
                    height,
                    1,
                    0,
                    0,
                    0,
                ]
                mujoco.mj_kinematics(probe, data)
                mujoco.mj_comPos(probe, data)
                mujoco.mj_collision(probe, data)
                pairs = {name for c in data.contact for name in (probe.geom(c.geom1).name, probe.geom(c.geom2).name)}
                assert ("ball" in pairs) == touches
