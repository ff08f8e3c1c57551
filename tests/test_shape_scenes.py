"""The scenes of octahedral arms: a tour by shape control is planned inside all limits, and its beginning runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from vgtsim.description import Method, load_scene
from vgtsim.errors import DescriptionError
from vgtsim.planning import plan_tour
from vgtsim.planning.timing import make_limits
from vgtsim.plant import run
from vgtsim.positioning.strokes import make_box
from vgtsim.site import Site
from vgtsim.verification import verify

SCENES = Path(__file__).parents[1] / "scenes"
GOAL = 2e-9  # of the tool at the end of a leg, m and rad
BEGINNING = 160  # steps of 20 ms that are simulated, for the way of the first quarter of them: records are 40 ms apart
ROUNDING = 1e-6  # of differences of lengths over a step squared, m/s²
MODE = 1e-7  # of nodes from lengths alone against those of the plan, m

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["arm30_shape", "arm60_shape"])
def tour(request):
    scene = load_scene(SCENES / f"{request.param}.toml")
    motion = scene.task.motion.model_copy(update={"goals": scene.task.motion.goals[:1]})
    scene = replace(scene, task=scene.task.model_copy(update={"motion": motion}))
    chain = Site(scene).chain
    return scene, chain, plan_tour(Site(scene))


def test_the_way_to_a_goal_keeps_all_limits_and_the_assembly_mode(tour):
    scene, chain, program = tour
    motion, leg = scene.task.motion, program.legs[0]
    assert motion.method is Method.SHAPE
    position, direction = chain.tool(leg.q)
    np.testing.assert_allclose(position, motion.goals[0].position, atol=GOAL)
    np.testing.assert_allclose(direction, motion.goals[0].direction, atol=GOAL)
    limits, step = make_limits(chain, motion.rate_fraction, motion.acceleration), program.timestep
    assert np.max(np.abs(np.diff(leg.lengths, axis=0)) / limits.rate) < step
    assert np.max(np.abs(np.diff(leg.lengths, n=2, axis=0))) / step**2 < motion.acceleration + ROUNDING
    sampled = leg.lengths[:: len(leg.lengths) // 40]
    assert np.min(make_box(chain, motion.stroke_margin).spare(sampled)) > 0
    # lengths alone lead from the start to the plan's end: no module leaves its assembly mode on the way
    q = program.start
    for lengths in (*sampled, leg.lengths[-1]):
        q = chain.inputs_from_lengths(lengths, start=q)
    np.testing.assert_allclose(chain.nodes(q), chain.nodes(leg.q), atol=MODE)
    assert Site(scene).surroundings.least(leg.q)[0] >= motion.clearance
    assert leg.clearance >= motion.clearance


def test_the_beginning_of_the_tour_passes_every_check_but_the_goals(tour):
    scene, _, program = tour
    first = program.legs[0].lengths[: BEGINNING // 4 + 10]
    x = np.linspace(0, 1, BEGINNING + 1)
    passed = BEGINNING / 4 * (10 * x**3 - 15 * x**4 + 6 * x**5)  # from rest to rest, half as fast as the plan
    short = replace(program.legs[0], lengths=make_interp_spline(np.arange(len(first)), first, k=5)(passed))
    report = verify(Site(scene), run(Site(scene), replace(program, legs=(short,))))
    missed = [check for check in report.checks if not check.passed]
    assert {(check.name, check.quantity.split(" at ")[0]) for check in missed} == {
        ("tracking", "tool position"),
        ("tracking", "tool direction"),
    }


def test_shape_control_is_refused_to_an_arm_with_static_longerons():
    scene = load_scene(SCENES / "arm30_shape.toml")
    mixed = load_scene(SCENES / "arm30_shape.toml").manipulator
    module = mixed.modules[0]
    tube = module.longerons[0].model_copy(update={"cylinder": None, "tube": "t300x250", "length": module.straight})
    fixed = module.model_copy(update={"longerons": (tube, *module.longerons[1:])})
    arm = mixed.model_copy(update={"modules": (fixed, *mixed.modules[1:])})
    part = replace(scene, manipulator=arm)
    with pytest.raises(DescriptionError, match="p1 has a hinge or static longerons"):
        plan_tour(Site(part))
