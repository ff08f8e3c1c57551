"""Other engines play our arm: their places and forces are ours, each by its own solver, and the benchmark prints them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from playing import bend, change, shorten
from programs import load_program

from studies.exudyn_arm import INSTALLED, play_exudyn
from studies.peer_arms import play_own
from studies.peer_positioning import MINK, by_least_squares, by_mink, move_nearby
from studies.peer_task import make_task, measure
from studies.plain_mujoco import play_plain
from vgtsim.site import Site

STEP = 0.02  # s
SAME_PLACE = 1e-7  # m: our closure at this step, and Exudyn's solution far below it
SAME_FORCE = 3e-4  # of the largest force: both are within 1e-4 of the method of joints in this motion
GOAL = 1e-8  # m and rad: ten times what the solvers are asked for

needs_exudyn = pytest.mark.skipif(not INSTALLED, reason="Exudyn is not installed: pip install vgtsim[bench]")
needs_mink = pytest.mark.skipif(not MINK, reason="mink is not installed: pip install vgtsim[bench]")


@pytest.fixture(scope="module")
def task(reach_scene):
    """Two modules bend from one pose to another in 5 s."""
    scene = change(shorten(reach_scene, 2), member_mass="lumped")
    start, end = bend(scene, [0.2, 0.25], [0.0, 1.0]), bend(scene, [0.3, 0.15], [0.4, 1.6])
    times = np.linspace(0, 5, 251)
    s = (times / 5)[:, None]
    return make_task(Site(scene), times, start + s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3) * (end - start))


@pytest.fixture(scope="module")
def ours(task):
    return play_own(task, STEP, "rigid")


@needs_exudyn
@pytest.mark.parametrize("sections", [False, True])
def test_exudyn_agrees_with_our_members_as_bodies(task, ours, sections):
    """Another engine with other coordinates and another integrator stands where ours does and carries the same."""
    theirs = play_exudyn(task, STEP, sections=sections, damping=0.5)
    common = np.isin(np.round(theirs.time, 6), np.round(ours.time, 6))
    assert common.sum() == len(ours.time)
    assert np.abs(theirs.nodes[common] - ours.nodes).max() < SAME_PLACE
    off = np.nanmax(np.abs(theirs.axial[common] - ours.axial), axis=1) / np.abs(ours.axial).max(axis=1)
    assert off.max() < SAME_FORCE
    assert off[ours.time > task.hold + task.duration + 0.1].max() < 2e-5  # its forces still ring a little


@pytest.mark.parametrize("integrator", ["implicitfast", "discrete"])
def test_plain_mujoco_comes_nearer_with_shorter_steps(task, integrator):
    """With compiled weights the gap goes with the step, and forces tend to those of the method of joints."""
    coarse, fine = (measure(task, play_plain(task, step, integrator=integrator)) for step in (0.01, 0.0025))
    assert fine.length < coarse.length / 3
    assert fine.resting < coarse.resting / 3
    assert fine.moving < 1e-3


def test_our_errors_are_those_of_our_checks(task, ours):
    """The measure sees what is there: a node that is off, and forces that are."""
    found = measure(task, ours)
    assert max(found.length, found.tool, found.node) < SAME_PLACE
    assert max(found.start, found.moving) < SAME_FORCE
    moved, pulled = ours.nodes.copy(), ours.axial.copy()
    moved[-1, -1, 0] += 1e-4
    pulled[-1] *= 1.001
    spoilt = measure(task, replace(ours, nodes=moved, axial=pulled))
    assert spoilt.node == pytest.approx(1e-4, rel=1e-2)
    assert spoilt.resting == pytest.approx(1e-3, rel=1e-2)


def make_goals(chain):
    """Five goals near the straight arm, and the inputs that they start from."""
    q = np.tile(chain.straight, (5, 1)) + 0.05 * np.random.default_rng(3).standard_normal((5, chain.straight.size))
    return q, *move_nearby(np.random.default_rng(4), *chain.tool(q), 0.005, 0.002)


def test_least_squares_meets_its_goals(hanging_arm):
    assert max(by_least_squares(hanging_arm, *goal) for goal in zip(*make_goals(hanging_arm), strict=True)) < GOAL


@needs_mink
def test_mink_meets_our_goals_on_the_same_arm(hanging_arm):
    _, steps, error = by_mink(hanging_arm, *make_goals(hanging_arm))
    assert error < GOAL
    assert steps > 0


@pytest.fixture
def bench(monkeypatch):
    """The script as a module, with one round and few steps."""
    module = load_program(monkeypatch, "bench_peers")
    monkeypatch.setattr(module, "ROUNDS", 1)
    monkeypatch.setattr(module, "MUJOCO_STEPS", (0.02, 0.01))
    monkeypatch.setattr(module, "EXUDYN_STEPS", {0.02: 0.5})
    monkeypatch.setattr(module, "MORE_STEPS", (0.04,))
    return module


LEVEL = "Exudyn, point masses, over our members as bodies of the same axial error:"


@pytest.mark.parametrize("there", [pytest.param(True, marks=needs_exudyn), False])
def test_script_prints_a_row_for_each_engine_and_step(bench, task, monkeypatch, capsys, there):
    monkeypatch.setattr(bench, "EXUDYN", there)
    bench.compare_steps(task)
    said = capsys.readouterr().out
    rows = [line.split() for line in said.splitlines()]
    printed = [row for row in rows if row and row[0] in ("vgtsim", "Exudyn", "MuJoCo")]
    assert len(printed) == (9 if there else 7)
    for row in printed:
        assert all(float(cell) >= 0 for cell in row[-6:])
    assert float(printed[0][-6]) == 1.0  # our members as bodies over themselves
    assert float(printed[1][-5]) == 1.0
    level = said.splitlines()[said.splitlines().index(LEVEL) + 1 :]
    assert len(level) == there  # Exudyn's error at 20 ms lies between ours at 20 and 40
    assert all(0 < float(line.split()[-3]) < 10 for line in level)


def test_script_names_what_is_missing(bench, monkeypatch, capsys):
    monkeypatch.setattr(bench, "EXUDYN", False)
    monkeypatch.setattr(bench, "MINK", False)
    for name in ("plan_leg", "compare_steps", "compare_positioning", "measure_machine"):
        monkeypatch.setattr(bench, name, lambda *_: 0.0)
    bench.main()
    said = capsys.readouterr().out
    for name in ("exudyn", "mink"):
        assert f"{name}: not installed; not compared (pip install vgtsim[bench])" in said
