"""Contacts that a scene allows are loads: logged with their forces, put on the arm, and judged; falsified ones are found out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, climb, shorten

from vgtsim.control import Controller
from vgtsim.description import AllowedContact
from vgtsim.errors import DescriptionError
from vgtsim.log import open_log, save_log
from vgtsim.mjcf import build_spec, finish_model
from vgtsim.plant import Plant
from vgtsim.site import Site, load_site
from vgtsim.touches import find_touches
from vgtsim.verification import members, shape, space
from vgtsim.verification.evidence import Evidence

pytestmark = pytest.mark.long

AGREES = 1e-3  # of the largest force, in motion and with knocks; asked is a hundredth
CAUGHT = 1e-2  # a contact force that is wrong by a tenth
MOMENTS = 1e-9  # relative: sums of forces and moments
SETTINGS = {
    "servo": {"drive": "servo", "timestep": 0.01, "log_rate": 25.0},
    "hydraulic": {
        "drive": "hydraulic",
        "members": "elastic",
        "timestep": 5e-3,
        "log_rate": 25.0,
        "damping_ratio": 0.3,
        "member_mass": "lumped",
    },
}
CHECKS = (members.check_axial_moving, members.check_drives, members.check_reaction)


def allow(scene, **rule):
    task = scene.task.model_copy(update={"contacts": (AllowedContact(**rule),)})
    return dataclasses.replace(scene, task=task)


def reach_down(chain, q, way):
    """Inputs with the tool lower by a way, m."""
    goal, small = chain.tool(q)[0] - [0, 0, way], 1e-6
    for _ in range(12):
        place = chain.tool(q)[0]
        slope = (chain.tool(q + small * np.eye(len(q)))[0] - place).T / small
        q = q + np.linalg.pinv(slope) @ (goal - place)
    return q


@pytest.fixture(scope="module", params=SETTINGS)
def above(request, nine):
    """The nine-actuator arm with its tool 5 cm over the waste, which the tool may touch; and the inputs of that posture."""
    scene = change(nine, **SETTINGS[request.param])
    chain, q = Site(scene).chain, bend(scene, [0.7, 0.4, -0.3], [0.0, 0.0, 0.0])
    level = float(chain.tool(q)[0][2]) - scene.task.payload.radius - 0.05
    waste = scene.tank.waste.model_copy(update={"level": level})
    scene = dataclasses.replace(scene, tank=scene.tank.model_copy(update={"waste": waste}))
    return Site(allow(scene, part="tool", place="waste", force=2e5)), q


@pytest.fixture(scope="module")
def leaning(above):
    """The arm lowers its tool by 5 cm, of which the last ones are into the waste, and stays there."""
    site, q = above
    plant = Plant(site)
    plant.reset(inputs=q)
    first, last = site.chain.lengths(q), site.chain.lengths(reach_down(site.chain, q, 0.05))
    for s in climb(1.0, 2.0, plant.timestep):
        plant.command(first + s * (last - first))
        plant.step()
    plant.step(round(0.4 / plant.timestep))
    return site, plant


@pytest.fixture(scope="module")
def nine():
    return load_site("arm9_nullspace").scene


def test_forces_agree_while_the_tool_leans_on_the_waste(leaning):
    site, plant = leaning
    log, state = plant.log, plant.state
    assert not plant.stopped
    assert {contact.first for contact in state.contacts} | {contact.second for contact in state.contacts} >= {
        "tank/waste"
    }
    run = Evidence(site, log)
    assert run.touches is not None
    most = np.linalg.norm(run.touches.by_rule[:, 0], axis=-1).max()
    assert most > 5e3
    assert run.touches.by_rule[-1, 0, 2] > 0
    assert max(check.find(run).value for check in CHECKS) < AGREES
    assert space.check_contacts.find(run).value == 0
    assert space.check_contact_forces.find(run).value == pytest.approx(most / 2e5)
    assert space.check_clearance.find(run).value > 0.05  # of all that may not touch
    without = dataclasses.replace(log, contact_force=0 * log.contact_force)
    assert members.check_axial_moving.find(Evidence(site, without)).value > 0.1


def test_an_operator_leans_on_the_waste_drags_the_tool_along_it_and_lifts_it(above):
    """Down until the arm leans, along the waste while it does, up again: the contact is a load, and holds nothing."""
    site, q = above
    plant = Plant(site, record_rate=0)
    controller = Controller(site, plant.timestep)
    controller.start(plant.reset(inputs=q).commanded, q)

    def go(seconds, velocity):
        """Part of the steps with a contact, and the places of the tool."""
        controller.command(twist=[*velocity, 0, 0, 0])
        touched, ways = 0, []
        for _ in range(round(seconds / plant.timestep)):
            plant.command(controller.step(plant.state))
            plant.step()
            ways.append(plant.state.tool_position)
            touched += bool(plant.state.contacts)
            assert not any(word.startswith("contact") for word in controller.report.held_by)
        return touched / len(ways), np.array(ways)

    go(1.5 if site.task.simulation.drive == "servo" else 4.5, [0, 0, -0.05])
    names = {name for contact in plant.state.contacts for name in (contact.first, contact.second)}
    assert names == {"payload", "tank/waste"}
    depth = controller.target[2]
    touched, ways = go(1.0, [0.05, 0, 0])
    assert touched > 0.5
    assert ways[-1, 0] - ways[0, 0] > 0.01
    assert depth - controller.target[2] < 0.02 * 1.1  # m/s: where bodies may touch they come together at a creep
    for _ in range(9):  # what the weight and the contact bent comes back first
        touched, _ = go(1.0, [0, 0, 0.08])
        if not touched:
            break
    assert not touched
    assert not plant.stopped


@pytest.mark.parametrize("name", ["force", "direction", "place"])
def test_a_falsified_contact_is_caught(leaning, name):
    site, plant = leaning
    log = plant.log
    force, point = log.contact_force, log.contact_point
    if name == "force":
        wrong = dataclasses.replace(log, contact_force=1.1 * force)
    elif name == "direction":
        wrong = dataclasses.replace(log, contact_force=force[:, [1, 0, 2]] + [0.1 * np.abs(force).max(), 0, 0])
    else:
        wrong = dataclasses.replace(log, contact_point=point + [0, 0.5, 0])
    assert members.check_axial_moving.find(Evidence(site, wrong)).value > CAUGHT


def test_the_log_of_contacts_survives_its_file(leaning, tmp_path):
    site, plant = leaning
    log = plant.log
    save_log(tmp_path, site.scene, log)
    again = open_log(tmp_path)
    back = again.read(0, again.count)
    for field in ("contact_time", "contact_force", "contact_point", "contact_pair", "acceleration"):
        assert np.array_equal(getattr(back, field), getattr(log, field)), field


def test_an_elastic_arm_is_bent_by_what_it_leans_on(leaning):
    site, plant = leaning
    if site.task.simulation.members != "elastic":
        pytest.skip("members are rigid")
    plant.step(round(3.0 / plant.timestep))
    log = plant.log
    rest = dataclasses.replace(log, settled=log.time > log.time[-1] - 0.3, goal=np.where(log.time > 1, 0, -1))
    run = Evidence(site, rest)
    found = shape.check_settled_shape.find(run).value
    blind = dataclasses.replace(rest, contact_force=0 * log.contact_force)
    assert found < 1e-4
    assert shape.check_settled_shape.find(Evidence(site, blind)).value > 10 * found


@pytest.mark.parametrize("part", ["longeron", "actuator"])
def test_forces_agree_while_a_member_leans_on_a_post(nine, part):
    """A ball beside a member's middle is in the way of the module that bends."""
    scene = allow(change(shorten(nine, 2), **SETTINGS["servo"]), part="members", place="shell", force=1e6)
    site = Site(scene)
    chain, q, end = site.chain, bend(scene, [0.2, 0.2], [0.0, 0.0]), bend(scene, [0.22, 0.2], [0.0, 0.0])
    names = [i for i, name in enumerate(site.truss.member_names) if name.startswith("m2/" + part)]
    middle = {i: chain.nodes(q)[site.truss.ends[i]].mean(axis=0) for i in names}
    move = {i: chain.nodes(end)[site.truss.ends[i]].mean(axis=0) - middle[i] for i in names}
    member = max(names, key=lambda i: middle[i][0])
    way = move[member] / np.linalg.norm(move[member])
    unit = site.truss.spans(chain.nodes(q))[member]
    way -= (way @ unit) * unit / (unit @ unit)
    way /= np.linalg.norm(way)
    spec = build_spec(site)
    post = spec.worldbody.add_geom(name="tank/post", type=2, size=[0.02, 0, 0], contype=1, conaffinity=0)
    thick = spec.geom(site.truss.member_names[member]).size[0]
    post.pos = middle[member] + (thick + 0.02 + 0.008) * way
    plant = Plant(site, model=finish_model(spec, site))
    plant.reset(inputs=q)
    first, last = chain.lengths(q), chain.lengths(end)
    for s in climb(1.0, 1.0, plant.timestep):
        plant.command(first + s * (last - first))
        plant.step()
        if plant.stopped:
            break
    log = plant.log
    assert len(log.contact_time) > 3, plant.stopped
    run = Evidence(site, log)
    assert run.touches is not None
    assert np.abs(run.touches.shares).max() > 100
    assert max(check.find(run).value for check in CHECKS) < AGREES
    blind = Evidence(site, dataclasses.replace(log, contact_force=0 * log.contact_force))
    assert members.check_axial_moving.find(blind).value > 10 * AGREES


def test_forces_on_nodes_add_up_to_those_of_the_contacts(leaning):
    """Seeded forces on tool, hubs and middles of members."""
    site, plant = leaning
    log, truss, rng = plant.log, site.truss, np.random.default_rng(2)
    nodes, count = log.nodes[7], 12
    index = rng.integers(0, len(truss.members), count)
    middle = nodes[truss.ends[index]]
    s = rng.uniform(0.1, 0.9, (count, 1))
    points = middle[:, 0] + s * (middle[:, 1] - middle[:, 0])
    names = [truss.member_names[i] + ("/rod" if truss.members[i].role == "actuator" else "") for i in index]
    points[:3], names[:3] = log.tool_position[7], ["payload"] * 3
    points[3:6], names[3:6] = nodes[5:8], truss.nodes[5:8]
    force = 1e3 * rng.standard_normal((count, 3))
    fake = dataclasses.replace(
        log,
        contact_time=np.full(count, log.time[7]),
        contact_pair=np.array([[name, "tank/waste"] for name in names]),
        contact_distance=np.zeros(count),
        contact_force=force,
        contact_point=points,
    )
    touches = find_touches(site, site.load_model, fake)
    assert touches is not None
    total = touches.total(truss.ends)
    assert np.abs(total[:7]).max() == np.abs(total[8:]).max() == 0
    assert total[7].sum(axis=0) == pytest.approx(force.sum(axis=0), rel=MOMENTS)
    moment = np.cross(points, force).sum(axis=0)
    assert np.cross(nodes, total[7]).sum(axis=0) == pytest.approx(moment, rel=MOMENTS * 1e3)


def test_an_unknown_place_is_named_with_the_nearest_one(nine):
    with pytest.raises(DescriptionError, match=r"contacts\.0\.place: found unknown place 'wast'; .*'waste'"):
        allow(nine, part="tool", place="wast")
