from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import Method, load_manipulator, load_scene
from vgtsim.errors import DescriptionError, ReachError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning import solve_first_goal
from vgtsim.planning.resolution import make_objective, make_problem, report_solution
from vgtsim.positioning import solve_by_method
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.objectives import Configurations
from vgtsim.positioning.strokes import make_box
from vgtsim.site import ArmAlone, Site
from vgtsim.statics import make_load_model, solve_members

GOAL = 1e-9
REACHABLE = ((7.0, 2.0, -9.5), (0.8, 0.1, -0.6))


def ask(place, position, direction, method=Method.NULLSPACE, terms=("mid_stroke",)):
    """What the `ik` verb writes."""
    problem = make_problem(place, tool_goal(position, direction), method, terms)
    return report_solution(place, problem, solve_by_method("ik", problem, place.start), terms)


@pytest.fixture(scope="module")
def arm(arm15):
    return Chain(arm15, hanging_mount(0.0))


@pytest.mark.long
@pytest.mark.parametrize("method", list(Method))
def test_every_method_puts_the_tool_at_the_goal(arm, method):
    answer = ask(ArmAlone(arm), *REACHABLE, method)
    at, along = arm.tool(np.array(answer["q"]))
    np.testing.assert_allclose(at, REACHABLE[0], atol=GOAL)
    np.testing.assert_allclose(np.cross(along, REACHABLE[1]), 0.0, atol=2 * GOAL)
    assert len(answer["rows"]) == 5
    assert json.loads(json.dumps(answer)) == answer
    assert answer["facts"]["objective"] == "mid_stroke"


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["length_variation", "condition_number", "actuator_force", "utilisation", "mid_stroke:3"]
)
def test_an_objective_is_lower_where_it_was_asked_for(arm, name):
    def value(q):
        place = ArmAlone(arm)
        objective = make_objective(place, tool_goal(*REACHABLE), (name,))
        at = Configurations(place.box, place.box.chain.state(q[None]), np.zeros(1, int))
        return objective.terms(at).value[0]

    asked, plain = (ask(ArmAlone(arm), *REACHABLE, terms=(item,)) for item in (name, "stroke_barrier"))
    assert value(np.array(asked["q"])) < value(np.array(plain["q"]))


def test_scene_and_command_find_the_same_configuration_by_the_same_words(reach_scene):
    motion = reach_scene.task.motion
    goal, site = motion.goals[0], Site(reach_scene)
    answer = ask(site, goal.position, goal.direction, motion.method, motion.objective)
    assert np.array(answer["q"]).tobytes() == solve_first_goal(site).tobytes()
    assert answer["facts"]["clearance, m"] >= motion.clearance
    assert answer["facts"]["objective"] == "clearance + stroke_barrier:0.01 + in_plane:10"


@pytest.mark.long
def test_a_posture_asked_for_in_a_scene_is_clear_of_it(reach_scene):
    answer = ask(Site(reach_scene), (8.0, 2.0, 1.0), (1.0, 0.0, 0.0))
    assert answer["facts"]["clearance, m"] >= reach_scene.task.motion.clearance


def test_coupling_of_a_scene_is_that_of_the_command(pytestconfig):
    scene = load_scene(pytestconfig.rootpath / "scenes/arm15_coupled.toml")
    motion = scene.task.motion.model_copy(update={"coupling": (("m2", "m3"),)})
    scene = dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))
    goal = motion.goals[0]
    q = np.array(ask(Site(scene), goal.position, goal.direction, Method.COUPLED)["q"])
    np.testing.assert_allclose(q[3:6], q[6:9], atol=1e-12)
    assert np.abs(q[:3] - q[3:6]).max() > 0.01
    assert np.abs(q[12:] - q[9:12]).max() > 0.01


def test_modules_turned_to_each_other_are_not_coupled(pytestconfig):
    octahedra = Chain(load_manipulator(pytestconfig.rootpath / "models/arm30/arm30.toml"), hanging_mount(0.0))
    with pytest.raises(DescriptionError, match=r"turned by 60 degrees"):
        ask(ArmAlone(octahedra), (0.0, 0.0, -9.0), (0.0, 0.0, -1.0), Method.COUPLED)


def test_loads_of_an_objective_are_those_of_the_scene(reach_scene):
    chain = Site(reach_scene).chain
    q = solve_first_goal(Site(reach_scene))

    def value(name, simulation=None, limits=None):
        task = reach_scene.task
        simulation = task.simulation.model_copy(update=simulation or {})
        limits = task.limits.model_copy(update=limits or {})
        task = task.model_copy(update={"simulation": simulation, "limits": limits})
        scene = dataclasses.replace(reach_scene, task=task)
        objective = make_objective(Site(scene), tool_goal(*REACHABLE), (name,))
        box = make_box(chain, 0.0)
        at = Configurations(box, box.chain.state(q[None]), np.zeros(1, int))
        return float(objective.terms(at).value[0])

    moon = {"gravity": 1.62}
    whole = value("actuator_force")
    assert value("actuator_force", moon) == pytest.approx(whole * 1.62 / reach_scene.task.simulation.gravity)
    assert value("utilisation", limits={"safety_factor": 4.0}) > 1.5 * value("utilisation")
    lumped = make_load_model(chain, reach_scene.task.payload, reach_scene.task.simulation.gravity, lumped=True)
    force = np.abs(solve_members(lumped, chain.nodes(q)).bar[chain.truss.actuated]) / 1e5
    assert value("actuator_force", {"member_mass": "lumped"}) == pytest.approx(np.sum(force**12) ** (1 / 12))
    assert value("actuator_force", {"member_mass": "lumped"}) != pytest.approx(whole, rel=1e-6)


def test_arm_with_too_few_modules_to_couple_is_named(arm15):
    short = Chain(arm15.model_copy(update={"modules": arm15.modules[:2]}), hanging_mount(0.0))
    with pytest.raises(DescriptionError, match=r"coupled.*at least one pair"):
        ask(ArmAlone(short), (0.0, 0.0, -2.0), (0.0, 0.0, -1.0), Method.COUPLED)


def test_wrong_objectives_are_named(arm):
    with pytest.raises(DescriptionError, match="'clarity'"):
        ask(ArmAlone(arm), *REACHABLE, terms=("clarity",))
    with pytest.raises(DescriptionError, match="clearance with a scene"):
        ask(ArmAlone(arm), *REACHABLE, terms=("clearance",))
    with pytest.raises(DescriptionError, match="above zero"):
        ask(ArmAlone(arm), *REACHABLE, terms=("mid_stroke:-1",))


@pytest.mark.long
def test_goal_out_of_reach_names_what_binds(arm):
    with pytest.raises(ReachError, match="binding"):
        ask(ArmAlone(arm), (0.0, 0.0, -30.0), (0.0, 0.0, -1.0))


def test_command_prints_draws_and_writes(tmp_path, pytestconfig):
    model = pytestconfig.rootpath / "models/arm15/arm15.toml"
    files = ["--plot", str(tmp_path / "a.svg"), "--json", str(tmp_path / "a.json")]
    numbers = ["--position", "7", "2", "-9.5", "--direction", "0.8", "0.1", "-0.6"]
    done = CliRunner().invoke(app, ["ik", str(model), *numbers, *files])
    assert done.exit_code == 0
    assert "iterations" in done.output
    assert (tmp_path / "a.svg").stat().st_size > 1000
    assert len(json.loads((tmp_path / "a.json").read_text())["rows"]) == 5
