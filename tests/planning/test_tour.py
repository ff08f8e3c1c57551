from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.description.mast import Mast
from vgtsim.description.motion import Bend, StartPosture
from vgtsim.errors import DescriptionError, ReachError, TrussError
from vgtsim.kinematics import Chain, bend_start, hanging_mount
from vgtsim.planning import check_site, plan_tour, solve_first_goal
from vgtsim.site import Site
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.loads import tool_point
from vgtsim.statics.stiffness import settle

pytestmark = pytest.mark.long

GOAL = 1e-9  # m and rad
ROUNDING = 1e-9
FIRST_ORDER = 0.01  # m, by which the sag of one linear solve may miss that at the deformed pose


def chain_of(scene):
    return Chain(scene.manipulator, hanging_mount(scene.pivot_height))


def with_motion(scene, **updates):
    motion = scene.task.motion.model_copy(update=updates)
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))


def with_simulation(scene, **updates):
    simulation = scene.task.simulation.model_copy(update=updates)
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"simulation": simulation}))


def with_goal(scene, **updates):
    """The scene with its second goal changed, so that the index in the key is seen to be right."""
    first, second, *_ = scene.task.motion.goals
    return with_motion(scene, goals=(first, second.model_copy(update=updates)))


@pytest.fixture(scope="module")
def short_tour(reach_scene):
    return with_motion(reach_scene, goals=reach_scene.task.motion.goals[:2])


@pytest.fixture(scope="module")
def program(short_tour):
    return plan_tour(Site(short_tour))


def test_legs_end_at_their_goals(short_tour, program):
    chain, q = chain_of(short_tour), program.start
    for leg, goal in zip(program.legs, short_tour.task.motion.goals, strict=True):
        assert short_tour.task.motion.goals[leg.goal].name == leg.name == goal.name
        q = chain.inputs_from_lengths(leg.lengths[-1], start=leg.q)
        position, direction = chain.tool(q)
        assert np.linalg.norm(position - goal.position) < GOAL
        assert np.linalg.norm(np.cross(direction, goal.direction)) < GOAL
        np.testing.assert_allclose(q, leg.q, atol=ROUNDING)


def test_each_leg_begins_where_the_last_one_ended(short_tour, program):
    chain = chain_of(short_tour)
    before = chain.lengths(program.start)
    for leg in program.legs:
        np.testing.assert_allclose(leg.lengths[0], before, atol=1e-12)
        before = leg.lengths[-1]


def test_legs_keep_the_planned_clearance_and_strokes(short_tour, program):
    motion, chain = short_tour.task.motion, chain_of(short_tour)
    for leg in program.legs:
        assert leg.clearance >= motion.clearance
        assert np.all(leg.lengths >= chain.stroke[0] + motion.stroke_margin)
        assert np.all(leg.lengths <= chain.stroke[1] - motion.stroke_margin)


def test_duration_counts_the_steps_in_motion(program):
    steps = sum(len(leg.lengths) - 1 for leg in program.legs)
    assert program.duration == pytest.approx(steps * program.timestep)
    assert 10 < program.duration < 60


def test_same_scene_gives_the_same_program_bit_for_bit(short_tour, program):
    again = plan_tour(Site(short_tour))
    assert again.start.tobytes() == program.start.tobytes()
    for one, other in zip(again.legs, program.legs, strict=True):
        assert one.lengths.tobytes() == other.lengths.tobytes()
        assert one.q.tobytes() == other.q.tobytes()


def test_first_goal_is_that_of_the_program(short_tour, program):
    assert solve_first_goal(Site(short_tour)).tobytes() == program.legs[0].q.tobytes()


def test_clearance_on_servos_is_that_of_the_settled_arm(reach_scene, program):
    chain, q = chain_of(reach_scene), program.legs[1].q
    scene = with_simulation(reach_scene, drive="servo")
    elastic, nodes = Site(scene).held_model, chain.nodes(q)
    settled = settle(elastic, nodes)
    tool = tool_point(elastic.loads, settled) - tool_point(elastic.loads, nodes)
    sag = np.concatenate([settled - nodes, tool[None]])
    found = Site(scene).surroundings.least(q)[0]
    exact = dataclasses.replace(Site(scene).surroundings, sag=lambda _: sag).least(q)[0]
    assert found == pytest.approx(exact, abs=FIRST_ORDER)
    assert abs(found - Site(reach_scene).surroundings.least(q)[0]) > 4 * FIRST_ORDER


def test_start_has_the_bends_of_the_scene(reach_scene):
    scene = with_motion(reach_scene, start=(Bend(angle=0.5, azimuth=0.3, extension=1.0), *[Bend()] * 4))
    chain = chain_of(scene)
    R, P = chain.frames(bend_start(chain, scene.task.motion.start))
    local = chain.mount[:3, :3].T @ R[1, :, 2]
    assert np.arccos(local[2]) == pytest.approx(0.5)
    assert np.arctan2(local[1], local[0]) == pytest.approx(0.3)
    assert np.linalg.norm(P[1] - P[0]) == pytest.approx(1.0)


def test_shipped_scene_passes_its_checks(reach_scene):
    check_site(Site(reach_scene))


@pytest.mark.parametrize(
    ("position", "found"),
    [
        ((6.1 * np.cos(np.pi / 3), 6.1 * np.sin(np.pi / 3), 3.0), "inside thermocouple_tree"),
        ((2.4 * np.cos(np.radians(50)) + 0.25, 2.4 * np.sin(np.radians(50)), 3.0), "from saltwell_screen"),
        ((12.0, 0.0, 3.0), "inside the tank's shell"),
        ((-1.0, 0.0, 0.1), "inside the waste"),
        ((0.0, 5.0, 0.3), "m from the waste"),
    ],
)
def test_goal_in_something_is_refused_by_key(reach_scene, position, found):
    scene = with_goal(reach_scene, position=position)
    with pytest.raises(DescriptionError, match=found) as caught:
        check_site(Site(scene))
    assert caught.value.key == "motion.goals.1.position"


def test_goal_out_of_reach_is_named(reach_scene):
    scene = with_goal(reach_scene, position=(-3.0, 0.0, 3.0), direction=(1.0, 0.0, 0.0))
    with pytest.raises(ReachError) as caught:
        plan_tour(Site(scene))
    assert caught.value.goal == scene.task.motion.goals[1].name
    assert caught.value.shortfall > 0.01
    assert caught.value.binding


@pytest.mark.parametrize(
    ("bend", "key"),
    [
        (Bend(angle=np.radians(75), extension=0.95), "motion.start.0"),
        (Bend(angle=np.radians(10), extension=0.6), "motion.start.0"),
        (Bend(angle=np.radians(170)), "motion.start.0"),
        (Bend(), "motion.start"),
    ],
)
def test_start_that_does_not_work_is_refused_by_key(reach_scene, bend, key):
    scene = with_motion(reach_scene, start=(bend, *[Bend()] * 4))  # all straight, the arm goes through the floor
    with pytest.raises(DescriptionError) as caught:
        check_site(Site(scene))
    assert caught.value.key == key


@pytest.mark.parametrize("given", ["inputs", "lengths"])
def test_a_start_out_of_its_strokes_is_refused_by_what_gave_it(reach_scene, given):
    chain = chain_of(reach_scene)
    q = np.array(chain.straight)
    q[2] *= 0.75  # cylinders of the first module longer than their strokes
    values = {"inputs": q, "lengths": chain.lengths(q)}[given]
    assert (chain.lengths(q) > chain.stroke[1]).any()
    with pytest.raises(DescriptionError) as caught:
        check_site(Site(with_motion(reach_scene, start=StartPosture(**{given: tuple(values.tolist())}))))
    assert caught.value.key == f"motion.start.{given}"


@pytest.mark.parametrize("longeron", [0.45, 0.62])
def test_stroke_over_which_a_module_does_not_assemble_is_refused(reach_scene, longeron):
    modules = list(reach_scene.manipulator.modules)
    modules[4] = modules[4].model_copy(update={"longeron": longeron})
    scene = dataclasses.replace(
        reach_scene, manipulator=reach_scene.manipulator.model_copy(update={"modules": tuple(modules)})
    )
    with pytest.raises(DescriptionError, match=r"m3.*assembles") as caught:
        check_site(Site(scene))
    assert caught.value.key == "manipulator.modules.m3.cylinder"


def test_sagging_arm_is_aimed_above_its_goal(reach_scene):
    scene = with_motion(reach_scene, goals=reach_scene.task.motion.goals[:1])
    scene = with_simulation(scene, members="elastic")
    chain, goal = chain_of(scene), scene.task.motion.goals[0]
    elastic = make_elastic_model(chain, scene.task.payload, scene.task.simulation.gravity)
    off = [
        np.linalg.norm(tool_point(elastic.loads, settle(elastic, chain.nodes(q))) - goal.position)
        for q in (plan_tour(Site(scene)).legs[0].q, solve_first_goal(Site(scene)))
    ]
    assert off[0] < 2e-4  # what the aim leaves of each coordinate is below 1e-4 m
    assert off[1] > 0.02  # the sag


def test_an_aim_that_does_not_come_to_its_goal_is_refused(reach_scene, monkeypatch):
    scene = with_simulation(with_motion(reach_scene, goals=reach_scene.task.motion.goals[:1]), members="elastic")
    monkeypatch.setattr("vgtsim.planning.tour._AIMS", 1)
    with pytest.raises(ReachError, match="after 1 corrections") as caught:
        plan_tour(Site(scene))
    assert caught.value.goal == "high"
    assert 1e-4 < caught.value.shortfall < 0.02  # less than the sag, and not what may be left


def test_an_arm_that_does_not_settle_is_refused_with_its_goal(reach_scene, monkeypatch):
    monkeypatch.setattr("vgtsim.planning.tour.check_site", lambda *_: None)  # which would refuse the start
    scene = with_simulation(reach_scene, drive="servo", servo_stiffness=1e6)
    with pytest.raises(TrussError, match="goal 'high': does not settle"):
        plan_tour(Site(scene))


def test_margin_that_leaves_nothing_of_a_stroke_is_refused(reach_scene):
    low, high = chain_of(reach_scene).stroke
    scene = with_motion(reach_scene, stroke_margin=0.5 * float((high - low).min()))
    with pytest.raises(DescriptionError, match=r"motion\.stroke_margin: found .*; allowed: less than .*/actuator/"):
        check_site(Site(scene))


def test_mast_with_a_wall_thicker_than_itself_is_refused(reach_scene):
    mast = reach_scene.task.mast.model_dump()
    with pytest.raises(ValueError, match="at most half the outer diameter"):
        Mast.model_validate(mast | {"wall": 0.51 * mast["outer_diameter"]})
