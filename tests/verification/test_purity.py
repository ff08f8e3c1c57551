"""Every member carries axial force and its own weight, nothing else: one module and the whole arm, at rest and moving.

The measured forces are MuJoCo's; the expected ones are the method of joints' and, as a third opinion, a finite-element
program's. The same checks must fail, and name the member, when the truss is spoilt.
"""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from frame_analysis import solve_with_pynite
from playing import bend, change, out_of_the_tank, play, shorten

from vgtsim.kinematics import bend_start
from vgtsim.site import Site
from vgtsim.statics import make_load_model, solve_members
from vgtsim.verification import Evidence, members, shape

END_MOMENT = 1e-6  # N·m; forces are of the order of 1e5 N, arms of 1 m
EXCESS_SHEAR = 1e-2  # N
AXIAL_AT_REST = 1e-6  # of the largest force
AXIAL_IN_MOTION = 1e-2  # of the largest force
AGAINST_FINITE_ELEMENTS = 1e-6  # of the largest force: what that program's bending stiffness of nearly zero leaves
CLOSURE = 1e-6  # m
MODULE, ARM = 1, 5

POSES = {
    MODULE: [([0.0], [0.0]), ([0.6], [0.4]), ([0.7], [-2.0])],
    ARM: [
        ([0.0] * 5, [0.0] * 5),
        ([0.5, 0.5, 0.5, 0.1, 0.0], [0.3] * 5),
        ([0.3, 0.6, 0.4, -0.5, 0.4], [2.0] * 5),
    ],
}


@pytest.fixture(scope="module")
def scenes(reach_scene):
    """The module and the arm in free air: the poses need not fit the tank."""
    return {count: change(shorten(reach_scene, count), log_rate=40.0) for count in (MODULE, ARM)}


def rest(scene, pose, edit=None):
    def both(spec):
        out_of_the_tank(spec)
        edit(spec)

    q = bend(scene, *pose)
    log = play(scene, q, q, 0.25, out_of_the_tank if edit is None else both)
    return Evidence(Site(scene), log)


@pytest.mark.long
@pytest.mark.parametrize("count", [MODULE, ARM])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_members_at_rest_carry_axial_force_alone(scenes, count, index):
    found = rest(scenes[count], POSES[count][index])
    assert found.log.settled.any()
    assert members.check_moment(found).value < END_MOMENT
    assert members.check_shear(found).value < EXCESS_SHEAR
    assert members.check_axial_settled(found).value < AXIAL_AT_REST
    assert np.abs(found.axial).max() > 1e3


@pytest.mark.long
@pytest.mark.parametrize("count", [MODULE, ARM])
def test_members_in_motion_carry_axial_force_alone(scenes, count):
    scene = scenes[count]
    start, end = (bend(scene, *pose) for pose in POSES[count][1:])
    log = play(scene, start, end, 20.0, out_of_the_tank)
    found = Evidence(Site(scene), log)
    assert members.check_moment(found).value < END_MOMENT
    assert members.check_shear(found).value < EXCESS_SHEAR
    assert members.check_axial_moving(found).value < AXIAL_IN_MOTION


def test_inertia_is_part_of_the_expected_force(scenes):
    """Without it the expectation for a fast motion is wrong by far more than with it."""
    scene, chain = scenes[MODULE], Site(scenes[MODULE]).chain
    start, end = (bend(scene, *pose) for pose in POSES[MODULE][1:])
    log = play(scene, start, end, 3.0, out_of_the_tank)
    found = Evidence(Site(scene), log)
    with_inertia = members.check_axial_moving(found).value
    model = make_load_model(chain, scene.task.payload, scene.task.simulation.gravity)
    without = members.relative_error(found.axial, solve_members(model, log.nodes).near_axial).max()
    assert with_inertia < AXIAL_IN_MOTION
    assert without > 10 * with_inertia


@pytest.mark.long
@pytest.mark.parametrize("count", [MODULE, ARM])
def test_forces_agree_with_finite_elements(scenes, count):
    found = rest(scenes[count], POSES[count][1])
    record = int(found.settled[0])
    expected = solve_with_pynite(found.site.chain, scenes[count], found.log.nodes[record])
    assert np.abs(found.axial[record] - expected).max() < AGAINST_FINITE_ELEMENTS * np.abs(expected).max()


def seize_ball(spec, member):
    """The ball joint is welded: the member may no longer turn against the hub."""
    weld = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=member)
    weld.name2 = spec.joint(member).parent.parent.name
    weld.data[10] = 1.0


def stiffen_ball(spec, member):
    """The ball joint has seized: it turns only against a spring of 1e4 N·m/rad."""
    spec.joint(member).stiffness[0] = 1e4


def push_middle(spec, member):
    """200 N across the middle of a member."""
    body = spec.body(member)
    body.add_site(name="middle", pos=[0, 0, 0.4])
    push = spec.add_actuator(
        name="push",
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target="middle",
        gear=[1, 0, 0, 0, 0, 0],
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
    )
    push.biasprm[0] = 200.0


def misplace(spec, member):
    """Its ball ten times the limit off its hub; a soft closure would be taken up by the closure correction."""
    spec.body(member).pos = np.array(spec.body(member).pos) + [10 * CLOSURE, 0.0, 0.0]


VICTIM = "m1/longeron/8"
VICTIMS = [(MODULE, VICTIM), (ARM, "m3/longeron/8"), (ARM, "s4/cross_longeron/2")]


def test_a_welded_ball_joint_fails_purity_and_names_the_member(scenes):
    scene, chain = scenes[MODULE], Site(scenes[MODULE]).chain
    start = bend_start(chain, scene.task.motion.start)  # the reference pose, which the weld keeps
    end = start + np.array([0.01, 0.0, 0.0])

    def spoil(spec):
        out_of_the_tank(spec)
        seize_ball(spec, VICTIM)

    log = play(scene, start, end, 0.5, spoil)
    shear = members.check_shear(Evidence(Site(scene), log))
    assert shear.value > 1.0
    assert shear.where == VICTIM


@pytest.mark.long
@pytest.mark.parametrize(("count", "victim"), VICTIMS)
def test_a_seized_ball_joint_fails_purity_and_names_the_member(scenes, count, victim):
    found = rest(scenes[count], POSES[count][1], lambda spec: stiffen_ball(spec, victim))
    moment = members.check_moment(found)
    assert moment.value > 1.0
    assert moment.where == victim


@pytest.mark.long
@pytest.mark.parametrize(("count", "victim"), VICTIMS)
def test_a_lateral_force_fails_purity_and_names_the_member(scenes, count, victim):
    found = rest(scenes[count], POSES[count][1], lambda spec: push_middle(spec, victim))
    shear = members.check_shear(found)
    assert shear.value > 10.0
    assert shear.where == victim


@pytest.mark.long
@pytest.mark.parametrize(("count", "victim"), VICTIMS)
def test_a_ball_beside_its_hub_fails_closure_and_names_the_member(scenes, count, victim):
    found = rest(scenes[count], POSES[count][1], lambda spec: misplace(spec, victim))
    gap = shape.check_closure(found)
    assert gap.value > CLOSURE
    assert gap.where == victim
