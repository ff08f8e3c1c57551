"""An elastic arm's task: planned for the shape it sags to, it comes to its lowest goal clear of everything."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vgtsim.description import load_scene
from vgtsim.planning import plan_tour
from vgtsim.plant import run
from vgtsim.site import Site
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.loads import tool_point
from vgtsim.statics.stiffness import settle
from vgtsim.verification import verify

pytestmark = pytest.mark.slow

FIRST_ORDER = 0.01  # m, by which the sag of one linear solve may miss that at the deformed pose
AIM = 2e-4  # m, of the settled tool from its goal


@pytest.fixture(scope="module")
def scene(pytestconfig):
    """The shipped scene, with its lowest goal alone."""
    whole = load_scene(pytestconfig.rootpath / "scenes/type_ii_elastic.toml")
    goals = tuple(goal for goal in whole.task.motion.goals if goal.name == "low")
    motion = whole.task.motion.model_copy(update={"goals": goals, "hold": 0.5})
    return dataclasses.replace(whole, task=whole.task.model_copy(update={"motion": motion}))


@pytest.fixture(scope="module")
def program(scene):
    return plan_tour(Site(scene))


@pytest.fixture(scope="module")
def elastic(scene):
    return make_elastic_model(Site(scene).chain, scene.task.payload, scene.task.simulation.gravity)


def settled_clearance(scene, elastic, program):
    """Least clearance along a programme of the arm at rest, at the deformed pose."""
    chain = Site(scene).chain

    def sag(nodes):
        settled = settle(elastic, nodes)
        tool = tool_point(elastic.loads, settled) - tool_point(elastic.loads, nodes)
        return np.concatenate([settled - nodes, tool[..., None, :]], axis=-2)

    lengths = np.concatenate([leg.lengths[::100] for leg in program.legs] + [program.legs[-1].lengths[-1:]])
    q = chain.inputs_from_lengths(lengths)
    return dataclasses.replace(Site(scene).surroundings, sag=sag).clearance(q)[0].min()


def test_path_is_clear_in_the_settled_shape(scene, elastic, program):
    found = settled_clearance(scene, elastic, program)
    assert found == pytest.approx(program.legs[0].clearance, abs=FIRST_ORDER)
    assert found > scene.task.motion.clearance - FIRST_ORDER


def test_path_for_the_unloaded_shape_is_not(scene, elastic):
    simulation = scene.task.simulation.model_copy(update={"members": "rigid"})
    rigid = dataclasses.replace(scene, task=scene.task.model_copy(update={"simulation": simulation}))
    found = settled_clearance(scene, elastic, plan_tour(Site(rigid)))
    assert found < scene.task.limits.clearance


def test_settled_tool_is_at_its_goal(scene, elastic, program):
    settled = settle(elastic, Site(scene).chain.nodes(program.legs[-1].q))
    assert np.linalg.norm(tool_point(elastic.loads, settled) - scene.task.motion.goals[-1].position) < AIM


def test_slopes_of_the_nearest_gap_hold_the_sag(scene, program):
    """Against central differences of the gap itself; without the sag's share they would be off by more than a per cent."""
    q, step = program.legs[-1].q, 1e-5
    around = Site(scene).surroundings
    rows = around.rows(q[None], 1.0)
    nearest = int(rows.gap.argmin())
    shifts = step * np.eye(q.size)
    gaps = [[around.rows((q + sign * shift)[None], 1.0).gap.min() for sign in (1, -1)] for shift in shifts]
    slope = (np.array(gaps)[:, 0] - np.array(gaps)[:, 1]) / (2 * step)
    size = np.abs(slope).max()
    assert rows.gradient[nearest] == pytest.approx(slope, abs=1e-4 * size)
    stiff = dataclasses.replace(around, sag=None).rows(q[None], 1.0)
    assert np.abs(stiff.gradient[int(stiff.gap.argmin())] - slope).max() > 0.01 * size


def test_every_check_passes(scene, program):
    report = verify(Site(scene), run(Site(scene), program))
    assert report.passed, [check for check in report.checks if not check.passed]
