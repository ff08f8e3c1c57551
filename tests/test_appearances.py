"""Something appears in the tank during a run: the arm stops, the way is planned anew, and everything still passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from vgtsim.description import load_scene
from vgtsim.description.mission import InsertStep, MoveStep, RasterStep
from vgtsim.description.tank import Equipment
from vgtsim.errors import DescriptionError
from vgtsim.log import Revision, open_log
from vgtsim.planning import plan_site, revise_as_run, revise_tour
from vgtsim.plant import begin_log, record
from vgtsim.site import Site
from vgtsim.verification import verify

WHEN = 34.0  # s: on the way to the second goal
PLACE = {"radius": 7.0, "azimuth": np.radians(181.0), "top": 1.7}  # under the way of the tool


def place_pole(scene, **place):
    """The test stand with two goals and a pole that appears."""
    pole = Equipment(**{"name": "pole", "diameter": 0.1, "appears": WHEN} | PLACE | place)
    tank = scene.tank.model_copy(update={"equipment": (*scene.tank.equipment, pole)})
    changes = {"goals": scene.task.motion.goals[:2], "rate_fraction": 0.2}
    motion = scene.task.motion.model_copy(update=changes)
    return Site(replace(scene, tank=tank, task=scene.task.model_copy(update={"motion": motion})))


@pytest.fixture(scope="module")
def site():
    return place_pole(load_scene("mockup"))


@pytest.fixture(scope="module")
def tour(site):
    return plan_site(site)


@pytest.fixture(scope="module")
def folder(site, tour, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "log"
    record(site, tour, begin_log(site, tour, folder))
    return folder


@pytest.mark.long
def test_the_arm_stops_goes_round_and_passes_every_check(site, tour, folder):
    log = open_log(folder)
    assert [item.time for item in log.revisions] == [WHEN]
    revised = revise_as_run(site, tour, log.revisions)
    report = verify(site, log, revised)
    assert [check.quantity for check in report.checks if not check.passed] == []
    assert "pole appeared in the tank; at 34 s the way to over_wall was planned anew" in report.notes
    before, after = tour.legs[1], revised.legs[1]
    assert after.place == "pole"
    assert len(after.lengths) > len(before.lengths) + site.task.motion.hold / tour.timestep
    np.testing.assert_allclose(after.lengths[-1], before.lengths[-1], atol=1e-5)  # the goal is met as before
    run = log.read(0, log.count)
    still = np.abs(np.diff(run.commanded, axis=0)).max(axis=1) == 0
    stop = (run.time[:-1] > WHEN) & (run.time[:-1] < WHEN + 8)
    assert still[stop].any()
    assert not still[(run.time[:-1] > WHEN - 1) & (run.time[:-1] < WHEN)].any()
    kept = replace(run, revisions=())  # a log that says nothing of a new plan
    missing = [check for check in verify(site, kept).checks if check.quantity == "appearances without a new plan"]
    assert not missing[0].passed


@pytest.mark.long
def test_a_run_that_was_cut_off_goes_on_with_the_same_bits(site, tour, folder):
    told = open_log(folder).revisions
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    chunks = sorted(folder.glob("*.parquet"))
    for file in (*chunks[-6:], folder / "_end.json"):
        file.unlink()
    record(site, tour, begin_log(site, tour, folder, resume=True))
    assert {file.name: file.read_bytes() for file in folder.glob("*.parquet")} == {
        name: data for name, data in before.items() if name.endswith(".parquet")
    }
    assert open_log(folder).revisions == told


@pytest.mark.long
def test_where_there_is_no_way_on_the_tour_says_what_blocks_it(tour):
    x, y, _ = load_scene("mockup").task.motion.goals[1].position
    blocked = place_pole(
        load_scene("mockup"), radius=np.hypot(x, y), azimuth=np.arctan2(y, x) % (2 * np.pi), top=4.0, diameter=0.3
    )
    revised = revise_tour(blocked, tour, Revision(WHEN, 1, 100))
    assert "no way on from 34 s" in revised.blocked
    assert "pole" in revised.blocked
    assert len(revised.legs) == 2
    assert revised.digest == tour.digest


def test_nothing_is_planned_for_what_has_not_appeared(site):
    assert "pole" not in site.surroundings.obstacles.names
    assert "pole" in site.learn(WHEN).surroundings.obstacles.names
    assert "pole" not in site.learn(WHEN - 0.1).surroundings.obstacles.names


ROWS, ON_THE_WAY = 30.0, 48.0  # s: while the tool runs its rows, and on the way to the goal after them
STEPS = (
    MoveStep(do="move", goal="low"),
    RasterStep(do="raster", width=(0.0, 0.3, 0.0), depth=(0.0, 0.0, 0.1), rows=2),
    MoveStep(do="move", goal="over_wall"),
)


@pytest.fixture(scope="module")
def mission():
    """The test stand with three steps; a pole appears aside of the rows, and the other one under the way after them."""
    site = place_pole(load_scene("mockup"), appears=ON_THE_WAY)
    aside = Equipment(name="aside", diameter=0.1, radius=7.0, azimuth=np.radians(60.0), top=1.7, appears=ROWS)
    tank = site.tank.model_copy(update={"equipment": (*site.tank.equipment, aside)})
    site = Site(replace(site.scene, tank=tank, task=site.task.model_copy(update={"mission": STEPS})))
    return site, plan_site(site)


@pytest.fixture(scope="module")
def mission_folder(mission, tmp_path_factory):
    folder = tmp_path_factory.mktemp("mission") / "log"
    record(*mission, begin_log(*mission, folder))
    return folder


@pytest.mark.long
def test_steps_of_a_mission_go_on_or_go_round(mission, mission_folder):
    site, tour = mission
    log = open_log(mission_folder)
    assert [(item.time, item.leg) for item in log.revisions] == [(ROWS, 1), (ON_THE_WAY, 2)]
    revised = revise_as_run(site, tour, log.revisions)
    report = verify(site, log, revised)
    assert [check.quantity for check in report.checks if not check.passed] == []
    assert "aside appeared in the tank; at 30 s the step raster was planned anew" in report.notes
    rows, way = revised.legs[1:]
    assert way.place == "pole"
    np.testing.assert_allclose(rows.lengths[-1], tour.legs[1].lengths[-1], atol=1e-9)
    lead = tour.legs[1].bound
    tool = [site.chain.tool(site.chain.inputs_from_lengths(leg.lengths[lead:]))[0] for leg in (rows, tour.legs[1])]
    assert cdist(*tool).min(axis=1).max() < 4e-3  # the rows are those of before, and nothing beside them
    still = np.abs(np.diff(rows.lengths[lead:], axis=0)).max(axis=1) == 0
    assert still.sum() >= site.task.motion.hold / tour.timestep


@pytest.mark.long
def test_a_mission_that_was_cut_off_goes_on_with_the_same_bits(mission, mission_folder):
    told = open_log(mission_folder).revisions
    before = {file.name: file.read_bytes() for file in mission_folder.glob("*.parquet")}
    for file in (*sorted(mission_folder.glob("*.parquet"))[-12:], mission_folder / "_end.json"):
        file.unlink()
    record(*mission, begin_log(*mission, mission_folder, resume=True))
    assert {file.name: file.read_bytes() for file in mission_folder.glob("*.parquet")} == before
    assert open_log(mission_folder).revisions == told


@pytest.mark.long
def test_rows_that_are_not_clear_any_more_end_the_mission_and_say_why(mission):
    site, tour = mission
    x, y, _ = site.chain.tool(tour.legs[1].q)[0]
    wall = Equipment(
        name="wall", diameter=0.3, radius=np.hypot(x, y), azimuth=np.arctan2(y, x) % (2 * np.pi), top=4.0, appears=ROWS
    )
    tank = site.tank.model_copy(update={"equipment": (*site.tank.equipment, wall)})
    blocked = Site(replace(site.scene, tank=tank))
    revised = revise_tour(blocked, tour, Revision(ROWS, 1, tour.legs[1].bound + 40))
    assert "no way on from 30 s" in revised.blocked
    assert "wall" in revised.blocked
    assert len(revised.legs) == 2
    assert revised.digest == tour.digest


def test_a_mission_of_an_arm_that_does_not_keep_its_length_does_not_plan_anew():
    scene = load_scene("type_ii_mission")
    item = Equipment(name="pole", diameter=0.1, radius=6.0, azimuth=0.0, appears=5.0)
    tank = scene.tank.model_copy(update={"equipment": (*scene.tank.equipment, item)})
    assert replace(scene, tank=tank).tank.appearances == {"pole": 5.0}
    steps = (InsertStep(do="insert", modules=2), *scene.task.mission[1:])
    with pytest.raises(DescriptionError, match="pole, which appears during the run"):
        replace(scene, tank=tank, task=scene.task.model_copy(update={"mission": steps}))
