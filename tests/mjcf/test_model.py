"""The generated model against the description: what it weighs, what it is called, what may touch what."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from vgtsim.description.waste import Mound
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import bend_start
from vgtsim.mjcf import build_spec, finish_model, load_model, names, qpos_from_nodes, write_scene_files
from vgtsim.mjcf.files import measure_sag
from vgtsim.mjcf.fittings import set_point_masses
from vgtsim.mjcf.keyframes import withdrawn_poses
from vgtsim.mjcf.rigging import contact_bits
from vgtsim.site import Site
from vgtsim.statics.loads import make_load_model

pytestmark = pytest.mark.long

PLACED = 1e-12  # m: nodes written into coordinates and read back
XML_DIGITS = 1e-4  # m: six digits of coordinates of some ten metres, in three directions


@pytest.fixture(scope="module")
def chain(reach_scene):
    return Site(reach_scene).chain


@pytest.fixture(scope="module")
def pose(reach_scene, chain):
    return bend_start(chain, reach_scene.task.motion.start)


@pytest.fixture(scope="module")
def model(reach_scene, pose):
    return finish_model(build_spec(Site(reach_scene), {"first_goal": pose}), Site(reach_scene))


@pytest.fixture(scope="module")
def files(reach_scene, pose, tmp_path_factory):
    return write_scene_files(Site(reach_scene), pose, tmp_path_factory.mktemp("model"))


def test_model_weighs_what_the_description_says(model, chain, reach_scene):
    task = reach_scene.task
    expected = make_load_model(chain, task.payload, task.simulation.gravity).mass
    others = [i for i in range(model.nbody) if model.body(i).name.startswith(("tank", names.MAST)) and i]
    others.remove(model.body(names.FLANGE).id)
    assert model.body_mass.sum() - model.body_mass[others].sum() == pytest.approx(expected, rel=1e-12)


def test_every_member_has_its_parts(model, chain):
    for member in chain.truss.members:
        assert model.joint(member.name).type[0] == mujoco.mjtJoint.mjJNT_BALL
        assert model.equality(names.closure(member.name)).type[0] == mujoco.mjtEq.mjEQ_CONNECT
        assert model.sensor(names.force(member.name)).dim[0] == 3
        assert model.sensor(names.torque(member.name)).dim[0] == 3
        if member.role == "actuator":
            assert model.joint(names.slide(member.name)).type[0] == mujoco.mjtJoint.mjJNT_SLIDE
            assert model.equality(names.drive(member.name)).type[0] == mujoco.mjtEq.mjEQ_JOINT
            assert model.actuator(names.servo(member.name)).id >= 0


def test_cameras_and_keyframes_are_there(model):
    assert {model.camera(i).name for i in range(model.ncam)} >= {"overview", "cutaway", "riser", "tool"}
    assert {model.key(i).name for i in range(model.nkey)} == {"stowed", "straight", "first_goal"}


def test_coordinates_put_every_node_where_kinematics_says(model, chain, pose):
    nodes = chain.nodes(pose)
    data = mujoco.MjData(model)
    data.qpos[:] = qpos_from_nodes(model, chain.truss, nodes)
    mujoco.mj_kinematics(model, data)
    for name, node in zip(chain.truss.nodes, nodes, strict=True):
        assert np.allclose(data.site(name).xpos, node, atol=PLACED)
    for member, (_, far) in zip(chain.truss.members, chain.truss.ends, strict=True):
        assert np.allclose(data.site(names.far(member.name)).xpos, nodes[far], atol=PLACED)


def test_keyframes_touch_nothing(model):
    data = mujoco.MjData(model)
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_forward(model, data)
        touching = {(model.geom(c.geom[0]).name, model.geom(c.geom[1]).name) for c in data.contact if c.dist <= 0}
        assert not touching, model.key(key).name


def test_a_straight_arm_hangs_over_the_top_of_uneven_waste(reach_scene):
    """A mound on the axis lifts the keyframe by its height at the nearest of the bed's heights, which is its top."""
    level, tank = Site(reach_scene), reach_scene.tank
    mound = Mound(radius=0.0, azimuth=0.0, height=0.8, foot=2.0)
    waste = tank.waste.model_copy(update={"mounds": (mound,)})
    uneven = Site(replace(reach_scene, tank=tank.model_copy(update={"waste": waste})))
    lifted = withdrawn_poses(uneven)["straight"][1] - withdrawn_poses(level)["straight"][1]
    assert lifted == pytest.approx(0.8, abs=1e-9)
    assert withdrawn_poses(uneven)["stowed"][1] == withdrawn_poses(level)["stowed"][1]


def test_neighbours_never_meet_and_others_do():
    parts = 11
    bits = [contact_bits(part, parts) for part in range(parts)]
    for i, (type_i, seek_i) in enumerate(bits):
        for j, (type_j, seek_j) in enumerate(bits):
            meets = bool(type_i & seek_j or type_j & seek_i)
            assert meets == (abs(i - j) >= 2)


def test_contact_bits_of_a_long_chain_fit_in_31():
    for part in range(81):
        contype, affinity = contact_bits(part, 81)
        assert 0 <= contype < 2**31
        assert 0 < affinity < 2**31


def test_arm_meets_tank_waste_equipment_and_itself(model, chain, reach_scene):
    """Drop the arm on each: MuJoCo reports the contact."""
    data = mujoco.MjData(model)
    nodes = chain.nodes(chain.straight)
    data.qpos[:] = qpos_from_nodes(model, chain.truss, nodes)
    mujoco.mj_forward(model, data)
    touched = {model.geom(g).name for c in data.contact for g in c.geom}
    assert any(name.startswith("tank/") for name in touched)


@pytest.mark.parametrize("index", [0, 1])
def test_written_files_step_without_warning_in_plain_mujoco(files, index):
    file = str(files[index])
    model = (mujoco.MjModel.from_xml_path if index == 0 else mujoco.MjModel.from_binary_path)(file)
    data = mujoco.MjData(model)
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        for _ in range(40):
            mujoco.mj_step(model, data)
        assert not np.any(data.warning.number)
        assert np.isfinite(data.qpos).all()


def test_xml_says_what_it_lacks(files):
    header = files[0].read_text().split("-->")[0]
    assert "Time step 0.001 s" in header
    assert "tool" in header
    assert "vgtsim.load_model" in header


def test_loading_applies_the_scaled_weights(files):
    plain = mujoco.MjModel.from_xml_path(str(files[0]))
    scaled = load_model(files[0])
    assert np.allclose(scaled.dof_invweight0, 1e-5 * plain.dof_invweight0, rtol=1e-12)
    assert measure_sag(scaled, "first_goal")[1] < 0.01 * measure_sag(plain, "first_goal")[1]


def test_mjb_is_the_simulated_model(files, model):
    loaded = load_model(files[1])
    assert np.array_equal(loaded.body_invweight0, model.body_invweight0)
    assert loaded.opt.timestep == model.opt.timestep


def test_xml_poses_are_good_to_its_digits(files, chain, pose):
    model = mujoco.MjModel.from_xml_path(str(files[0]))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("first_goal").id)
    mujoco.mj_kinematics(model, data)
    sites = np.array([data.site(name).xpos for name in chain.truss.nodes])
    assert np.abs(sites - chain.nodes(pose)).max() < XML_DIGITS


@pytest.mark.parametrize("name", ["missing.xml", "other.txt"])
def test_a_file_that_is_no_model_is_refused(tmp_path, name):
    (tmp_path / "other.txt").write_text("x")
    with pytest.raises(DescriptionError, match=r"generated \.xml or \.mjb"):
        load_model(tmp_path / name)


@pytest.mark.parametrize("left", [0, 7, 5000])
def test_a_damaged_model_is_refused(files, tmp_path, left):
    for file in files:
        (tmp_path / file.name).write_bytes(file.read_bytes()[:left])
        with pytest.raises(DescriptionError, match="a model that MuJoCo can read"):
            load_model(tmp_path / file.name)


def test_foreign_xml_is_refused_by_name_of_what_it_lacks(tmp_path):
    (tmp_path / "foreign.xml").write_text("<mujoco><worldbody/></mujoco>")
    with pytest.raises(DescriptionError, match=names.WEIGHT_SCALE):
        load_model(tmp_path / "foreign.xml")


@pytest.mark.parametrize("mass", [2.0, 3.5, 5.0])  # thirds: two of the rounded moments are less than the other
def test_a_plate_without_thickness_is_read_back(mass):
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="plate")
    turn = 2 * np.pi * np.arange(3) / 3
    corners = np.stack([np.cos(turn), np.sin(turn), np.zeros(3)], axis=1) / 3
    set_point_masses(body, np.full(3, mass), corners, np.zeros((3, 3)))
    spec.compile()
    back = mujoco.MjModel.from_xml_string(spec.to_xml())
    moments = mass / 3 * np.array([0.5, 0.5, 1.0])  # m r² / 2 about a diameter, m r² about the axis
    np.testing.assert_allclose(np.sort(back.body_inertia[1]), moments, rtol=5e-5)
