"""Arms of octahedra laid along curves, and shape control's search for an objective."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, bend_all, hanging_mount
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.methods import solve
from vgtsim.positioning.objectives import Configurations, Differences, LengthVariation, MidStroke, WeightedSum
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.shape import cubic, fit, solve_shapes
from vgtsim.positioning.strokes import make_box

pytestmark = pytest.mark.long

MODELS = Path(__file__).parents[2] / "models"
GOAL = 1e-9
ROUNDING = 1e-11
CHORD = 0.02  # m: what a 1.7 m chord is shorter than its arc on these curves, which its far end stands beside its place
DENSE = 2e-3  # m: half the spacing of the points that stand for a curve


@pytest.fixture(scope="module", params=["arm30", "arm60"])
def chain(request):
    return make_chain(request.param)


@pytest.fixture(scope="module")
def arm30():
    return make_chain("arm30")


def make_chain(name):
    return Chain(load_manipulator(MODELS / name / f"{name}.toml"), hanging_mount(7.3))


def goal_and_curve(chain, magnitude=1.0):
    """A goal made by bends that add up to 60 degrees, and a cubic to it of about the arm's length."""
    count = len(chain.layout.names)
    q = bend_all(chain, np.full(count, np.radians(60.0 / count)), 0.7)
    position, direction = chain.tool(q)
    R, P = chain.frames(q)
    size = magnitude * np.linalg.norm(P[-1] - P[0])
    return position, direction, cubic(P[0], P[-1], size * R[0, :, 2], size * R[-1, :, 2])


def test_faces_of_a_fit_stand_on_the_curve_and_its_last_one_along_the_end(chain):
    _, direction, curve = goal_and_curve(chain)
    R, P = chain.frames(fit(chain, curve))
    np.testing.assert_allclose(P[-1], curve.point(np.ones(1))[0], atol=ROUNDING)
    np.testing.assert_allclose(R[-1, :, 2], direction, atol=ROUNDING)
    dense = curve.point(np.linspace(0, 1, 10_001))
    off = [np.min(np.linalg.norm(dense - p, axis=1)) for p in P[1:-2]]
    assert np.max(off[::2]) < DENSE  # tops of modules
    assert np.max(off[1::2]) < CHORD  # ends of sections
    # each section lies along its own axis, whatever the module below it does
    sections = np.array([k for k, module in enumerate(chain.manipulator.modules) if module.kind == "prism"])
    way = P[sections + 1] - P[sections]
    np.testing.assert_allclose(np.sum(way * R[sections, :, 2], axis=1), np.linalg.norm(way, axis=1), atol=ROUNDING)


def test_a_fit_without_twist_turns_by_bending_alone_and_twist_turns_the_end(chain):
    _, direction, curve = goal_and_curve(chain)
    plain, twisted = fit(chain, curve), fit(chain, curve, 0.4)
    straight = chain.frames(chain.straight)[0]
    R = chain.frames(plain)[0]
    for k in range(len(R) - 1):
        ours, still = R[k].T @ R[k + 1], straight[k].T @ straight[k + 1]
        turn = ours @ still.T  # beyond the straight module's own: about an axis across Z
        assert abs(turn[1, 0] - turn[0, 1]) < ROUNDING
    assert not np.allclose(plain, twisted)
    last, first = chain.frames(twisted)[0][-1], R[-1]
    off = last @ first.T
    np.testing.assert_allclose(off @ direction, direction, atol=ROUNDING)
    assert np.arccos((np.trace(off) - 1) / 2) == pytest.approx(0.4)


def test_shapes_meet_the_goal_exactly_on_the_straight_arms_mode(chain):
    box = make_box(chain, 0.005)
    position, direction, _ = goal_and_curve(chain)
    size = float(np.linalg.norm(position - chain.mount[:3, 3]))
    pairs = tuple((a * size, b * size) for a in (0.6, 1.0, 1.5) for b in (0.6, 1.0, 1.5))
    shapes = solve_shapes(Problem(box, tool_goal(position, direction), MidStroke()), pairs)
    q = shapes.q
    assert len(q) >= 5
    at, along = chain.tool(q)
    np.testing.assert_allclose(at, np.tile(position, (len(q), 1)), atol=GOAL)
    np.testing.assert_allclose(along, np.tile(direction, (len(q), 1)), atol=GOAL)
    lengths = chain.lengths(q)
    assert np.min(box.spare(lengths)) > 0
    np.testing.assert_allclose(chain.inputs_from_lengths(lengths), q, atol=1e-8)
    assert np.abs(q[0] - q[-1]).max() > 0.01
    assert shapes.value.tolist() == sorted(shapes.value)


def test_the_search_makes_its_objective_least(hanging_arm):
    box = make_box(hanging_arm, 0.005)
    position, direction, _ = goal_and_curve(hanging_arm)
    tall = Differences(
        "tall", lambda q: -hanging_arm.nodes(q)[..., 2].max(axis=-1) - hanging_arm.nodes(q)[..., 2].min(axis=-1)
    )
    several = WeightedSum(((1.0, MidStroke()), (2.0, LengthVariation())))
    objectives = (MidStroke(), LengthVariation(), tall, several)
    found = [solve_shapes(Problem(box, tool_goal(position, direction), item)).pick(0) for item in objectives]
    q = np.array([shape.q for shape in found])
    at = Configurations(box, hanging_arm.state(q), np.zeros(len(q), int))
    table = np.array([item.values(at) for item in objectives])  # objective by shape
    np.testing.assert_allclose(np.diag(table), [shape.value for shape in found], rtol=1e-9)
    assert np.all(np.diag(table) <= table.min(axis=1) + 1e-12)
    assert table[2, 2] < table[2, 0] - 1e-3
    whole = solve(Problem(box, tool_goal(position, direction), MidStroke()), q[0])
    assert whole.value[0] <= found[0].value + 1e-6  # curves leave two of the null space's 10 freedoms


@pytest.mark.parametrize(("name", "culprit"), [("mixed", "h1 has a hinge"), ("tetra4", "h1 has a hinge")])
def test_arms_that_cannot_be_laid_along_a_curve_are_refused_by_the_module(name, culprit):
    chain = make_chain(name)
    curve = cubic(chain.mount[:3, 3], [4.0, 0.0, 2.0], [0, 0, -8.0], [8.0, 0, 0])
    with pytest.raises(DescriptionError, match=culprit):
        fit(chain, curve)
