from pathlib import Path

import mujoco
import numpy as np
import pytest

from vgtsim.description import load_tank
from vgtsim.geometry import make_bed
from vgtsim.geometry.clearance import enclosure_distance
from vgtsim.geometry.panels import TOLERANCE
from vgtsim.geometry.profile import make_profile
from vgtsim.mjcf import names
from vgtsim.mjcf import tank as tank_mjcf
from vgtsim.mjcf.views import light_tank

TANK = load_tank(Path(__file__).parents[2] / "scenes/tanks/type_ii.toml")
PROFILE = make_profile(TANK.shell)
STANDS_BACK = 2.1 * TOLERANCE  # m; the tolerance for sectors and for rings, and a twentieth
XML_BYTES = 3e6
SIX_DIGITS = 1e-4  # m; what an XML file keeps of some ten metres
SINK = 0.02  # m; penetration of a ball at rest under MuJoCo's default contact softness


def make_model(tank=TANK, balls=(), radius=0.3):
    spec = mujoco.MjSpec()
    tank_mjcf.add_tank(spec, tank)
    light_tank(spec, tank)
    for index, ball in enumerate(balls):
        body = spec.worldbody.add_body(name=f"ball{index}", pos=ball)
        body.add_freejoint()
        body.add_geom(
            name=f"ball{index}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0, 0],
            contype=0,
            conaffinity=1,
        )
    return spec, spec.compile()


@pytest.fixture(scope="module")
def model():
    return make_model()[1]


def test_the_tank_compiles_and_steps_without_a_warning(capfd):
    _, model = make_model()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    assert model.nv == 0
    assert not np.any([warning.number for warning in data.warning])
    assert capfd.readouterr() == ("", "")


def test_the_xml_holds_the_whole_tank(model):
    spec, _ = make_model()
    text = spec.to_xml()
    assert len(text) < XML_BYTES
    again = mujoco.MjModel.from_xml_string(text)
    assert again.ngeom == model.ngeom
    assert again.nmeshvert == model.nmeshvert
    assert np.abs(again.geom_pos - model.geom_pos).max() < SIX_DIGITS
    assert np.array_equal(again.geom_group, model.geom_group)
    assert np.array_equal(again.geom_contype, model.geom_contype)


def test_geoms_are_either_seen_or_felt_but_for_the_equipment(model):
    equipment = {names.equipment(item.name) for item in TANK.equipment}
    for index in range(model.ngeom):
        geom = model.geom(index)
        assert geom.conaffinity[0] == 0
        assert geom.name.startswith("tank/")
        felt = geom.group[0] == tank_mjcf.CONTACT_GROUP or geom.name in equipment
        assert geom.contype[0] == int(felt), geom.name
        assert (geom.type[0] == mujoco.mjtGeom.mjGEOM_MESH) == (not felt), geom.name


def test_the_front_can_be_left_out_of_a_picture(model):
    hidden = (tank_mjcf.FRONT_GROUP, tank_mjcf.FRONT_COVER_GROUP)
    for index in range(model.ngeom):
        geom = model.geom(index)
        if geom.name.endswith("/front") and "floor" not in geom.name and "base" not in geom.name:
            assert geom.group[0] in hidden, geom.name
        if geom.name.endswith("/back"):
            assert geom.group[0] not in (*hidden, tank_mjcf.CONTACT_GROUP), geom.name


def test_lights_cast_no_shadow(model):
    assert model.nlight >= 1
    assert not model.light_castshadow.any()


def test_mujoco_measures_the_distance_of_the_profile():
    rng = np.random.default_rng(1)
    points = rng.uniform([-11, -11, 0.2], [11, 11, 8.5], (40, 3))
    points = np.concatenate([points, rng.uniform([-0.3, -0.3, 8.5], [0.3, 0.3, 11], (10, 3))])
    radius = 0.01
    room = enclosure_distance(TANK, PROFILE, points)[0] - radius
    points, room = points[room > 0.05], room[room > 0.05]
    assert len(points) > 30
    _, model = make_model(TANK, points, radius)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    boxes = [i for i in range(model.ngeom) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
    for index, ours in enumerate(room):
        ball = model.body(f"ball{index}").geomadr[0]
        theirs = min(mujoco.mj_geomDistance(model, data, box, ball, 20.0, None) for box in boxes)
        assert ours - 1e-6 < theirs < ours + STANDS_BACK


def test_balls_let_go_in_the_tank_stay_in_it():
    heights, turns = np.linspace(2, 5, 8), np.linspace(0, 2 * np.pi, 8, endpoint=False)
    balls = [(9 * np.cos(turn), 9 * np.sin(turn), height) for turn, height in zip(turns, heights, strict=True)]
    radius = 0.3
    _, model = make_model(TANK, balls, radius)
    model.opt.timestep = 0.004
    data = mujoco.MjData(model)
    data.qvel[0::6] = 6.0 * np.cos(turns)
    data.qvel[1::6] = 6.0 * np.sin(turns)
    places = set()
    for _ in range(1000):
        mujoco.mj_step(model, data)
        touched = {model.geom(geom).name for geom in data.contact.geom.ravel()}
        places |= {name.split("/")[1] for name in touched if name.startswith("tank/")}
        room = enclosure_distance(TANK, PROFILE, data.qpos.reshape(-1, 7)[:, :3])[0] - radius
        assert room.min() > -STANDS_BACK - 0.25  # a rebound at 6 m/s sinks in by its speed times two steps and more
    assert {"wall", "knuckle", "dish"} <= places
    assert room.min() > -SINK


def test_a_ball_falls_through_the_riser_onto_the_waste():
    _, model = make_model(TANK, [(0.0, 0.0, 11.5)], 0.5)
    model.opt.timestep = 0.004
    data = mujoco.MjData(model)
    for _ in range(1500):
        mujoco.mj_step(model, data)
    assert data.qpos[2] == pytest.approx(TANK.waste.level + 0.5, abs=SINK)
    assert names.WASTE in {model.geom(geom).name for geom in data.contact.geom.ravel()}


def test_a_tank_without_waste_has_no_waste_geom():
    empty = TANK.model_copy(update={"waste": TANK.waste.model_copy(update={"level": 0.0})})
    _, model = make_model(empty)
    with pytest.raises(KeyError):
        model.geom(names.WASTE)


def test_equipment_stands_where_it_is_described(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for item in TANK.equipment:
        index = model.geom(names.equipment(item.name)).id
        top = float(PROFILE.ceiling_at(item.radius)) if item.top is None else item.top
        expected = (
            item.radius * np.cos(item.azimuth),
            item.radius * np.sin(item.azimuth),
            (item.bottom + top) / 2,
        )
        assert data.geom_xpos[index] == pytest.approx(expected)
        assert model.geom_size[index][:2] == pytest.approx((item.diameter / 2, (top - item.bottom) / 2))


def test_uneven_waste_is_felt_where_its_bed_is():
    bed, spec = make_bed(load_tank("type_iv")), mujoco.MjSpec()
    tank_mjcf.add_tank(spec, load_tank("type_iv"))
    model = spec.compile()
    data, hit = mujoco.MjData(model), np.zeros(1, np.int32)
    mujoco.mj_forward(model, data)
    felt = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, names.WASTE)
    group = np.array([model.geom_group[felt] == k for k in range(6)], np.uint8)
    for x, y in np.random.default_rng(0).uniform(-6, 6, (40, 2)):
        top = np.array([x, y, 5.0])
        while True:  # past equipment and panels of the same group
            down = mujoco.mj_ray(model, data, top, [0.0, 0.0, -1.0], group, 1, -1, hit)
            if hit[0] in (felt, -1):
                break
            top[2] -= down + 1e-3
        height = bed.height_at(x, y)
        assert hit[0] == felt
        assert abs(top[2] - down - height) < 0.02  # MuJoCo cuts its cells along the other diagonal
