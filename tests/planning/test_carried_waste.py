"""Waste that a phase leaves is the waste of the next one: in its site, its plan, its model and the report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from digging import BENT, over_waste, sweep
from playing import bend

from vgtsim.description.scene import Phase
from vgtsim.errors import DescriptionError
from vgtsim.mjcf import build_spec, lower_waste
from vgtsim.planning import phases as planned
from vgtsim.planning.checks import check_site
from vgtsim.planning.phases import plan_phases
from vgtsim.plant import Plant, carry_waste, run
from vgtsim.proximity import Proximity
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, join_phases, verify

pytestmark = pytest.mark.long
DEEP = 0.06  # m of the layer that is gone


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(over_waste(reach_scene))


@pytest.fixture(scope="module")
def cut(site):
    """Heights with a pit about the patch."""
    middle = np.add(site.task.patches[0].corner, 0.1)
    near = np.linalg.norm(site.diggings.places - middle, axis=1) < 0.35
    return np.where(near, site.diggings.start - DEEP, site.diggings.start)


@pytest.fixture(scope="module")
def log(site):
    return run(site, sweep(site))


def test_goal_in_the_pit_is_reached_only_after_the_cut(site, cut):
    task, goal = site.task, site.task.motion.goals[0]
    x, y, _ = goal.position
    low = goal.model_copy(
        update={"position": (x, y, site.tank.waste.level + task.payload.radius + site.clearance - DEEP / 2)}
    )
    motion = task.motion.model_copy(update={"goals": (low,)})
    deep = Site(replace(site.scene, task=task.model_copy(update={"motion": motion})))
    with pytest.raises(DescriptionError, match=r"above at .* 0\.\d+ m from the waste"):
        check_site(deep)
    check_site(deep.lower_waste(cut))


def test_distances_and_ways_know_the_pit(site, cut):
    later = site.lower_waste(cut)
    q = bend(site.scene, *BENT)
    nodes, tool = site.chain.nodes(q), site.chain.tool(q)[0]
    (before, places), (after, _) = (Proximity(place).by_module(nodes, tool) for place in (site, later))
    waste = places.index("waste")
    expected = Proximity(site).around(nodes, tool, cut).distance[..., waste]
    assert after[..., waste].min() == pytest.approx(float(expected), abs=1e-12)
    assert after[..., waste].min() > before[..., waste].min() + DEEP / 20  # a hub beside the pit is next
    assert later.begun is cut
    assert site.begun is site.diggings.start


def test_least_distances_from_uneven_waste_are_those_of_all_postures(site, cut):
    """Lifted arms and bent ones: what is left out of the batch is never the least."""
    later = Proximity(site.lower_waste(cut))
    bends, rng = np.array(BENT), np.random.default_rng(3)
    q = np.array([bend(site.scene, *(bends + rng.normal(0, 0.1, bends.shape))) for _ in range(40)])
    lift = np.zeros((40, 3))
    lift[:, 2] = rng.permutation(np.linspace(-0.1, 4.0, 40))
    nodes, tool = site.chain.nodes(q) + lift[:, None], site.chain.tool(q)[0] + lift
    (every, places), (some, _) = (later.by_module(nodes, tool, together=wanted) for wanted in (False, True))
    waste = places.index("waste")
    np.testing.assert_array_equal(some.min(axis=0), every.min(axis=0))
    np.testing.assert_array_equal(np.delete(some, waste, -1), np.delete(every, waste, -1))
    assert np.all(some <= every)
    assert np.any(some[..., waste] < every[..., waste])  # over the pit those that were not measured show


def test_model_of_the_next_phase_has_the_waste_of_the_log(site, log):
    later = carry_waste(site, log)
    plant = Plant(later)
    plant.reset(site.chain.lengths(site.start))
    assert (plant.model.hfield_data != Plant(site).model.hfield_data).any()
    plant.step()
    first = plant.log
    assert first.bed[0].tobytes() == log.bed[-1].tobytes()
    assert first.removed[0] == pytest.approx(log.removed[-1], rel=1e-12)


def test_model_as_it_is_written_has_the_pit(site, cut):
    described, later = (build_spec(place).compile() for place in (site, site.lower_waste(cut)))
    assert (later.hfield_data != described.hfield_data).any()
    lower_waste(described, site.diggings, cut)
    assert later.hfield_data == pytest.approx(described.hfield_data, abs=1e-6)


def test_phases_are_planned_over_what_those_before_leave(site, cut, monkeypatch):
    seen = []

    def carry_out(place, way):
        seen.append(place.begun)
        return f"tour {len(seen)}", cut

    monkeypatch.setattr(planned, "carry_out", carry_out)
    assert plan_phases([*number([site, site])]) == ("tour 1", "tour 2")
    np.testing.assert_array_equal(seen[0], site.diggings.start)
    assert seen[1] is cut


def number(sites):
    for index, place in enumerate(sites, start=1):
        phase = Phase(number=index, count=len(sites), stands=False, patches=("here",))
        yield Site(replace(place.scene, task=place.task.model_copy(update={"phase": phase})), place.heights)


def rest(place):
    """The place with nothing but a rest to play."""
    tour = sweep(place)
    return run(place, replace(tour, legs=tour.legs[:1]))


def test_report_holds_the_waste_from_phase_to_phase(site, log):
    sites, report = [*number([site, site])], verify(site, log)

    def judge(*logs):
        runs = [JudgedRun(place, item, report) for place, item in zip(sites, logs, strict=True)]
        return next(row for row in join_phases(runs).checks if row.quantity == "waste, phase to phase")

    second, forgotten = rest(carry_waste(sites[1], log)), judge(log, rest(sites[1]))
    assert judge(log, second).measured == 0
    assert not forgotten.passed
    assert forgotten.measured == pytest.approx(np.abs(log.bed[-1] - log.bed[0]).max())
    assert forgotten.where == "phase 1 to 2"
    sunk = replace(log, bed=log.bed - 1e-3)
    assert judge(sunk, replace(second, bed=second.bed - 1e-3)).where == "begin of phase 1"
