"""The main job, end to end: the reference scene passes every check, and its folder holds what it should."""

from __future__ import annotations

import json
from collections import Counter

import pytest

from vgtsim.cli.runs import _list_sites
from vgtsim.kinematics import Chain
from vgtsim.log import open_log
from vgtsim.mjcf import write_scene_files
from vgtsim.output import write_outputs
from vgtsim.planning import plan_tour, tour
from vgtsim.plant import run
from vgtsim.positioning import StrokeBox, Surroundings
from vgtsim.site import Site
from vgtsim.statics import MemberSections
from vgtsim.verification import CHECK_NAMES, Evidence, tracking, verify
from vgtsim.verification.report import judge

pytestmark = pytest.mark.slow


MADE_ONCE = (Site, Chain, Surroundings, StrokeBox, MemberSections)


def count_calls(patch, made, place, name, said):
    whole = getattr(place, name)

    def counted(*given, **named):
        made[said] += 1
        return whole(*given, **named)

    patch.setattr(place, name, counted)


@pytest.fixture(scope="module")
def made():
    return Counter()


@pytest.fixture(scope="module")
def folder(made, tmp_path_factory):
    path = tmp_path_factory.mktemp("reach")
    with pytest.MonkeyPatch.context() as patch:
        for kind in MADE_ONCE:
            count_calls(patch, made, kind, "__init__", kind.__name__)
        count_calls(patch, made, tour, "check_site", "check_site")
        (site,) = _list_sites("type_ii_reach")  # as `vgtsim run` does
        log = run(site, plan_tour(site))
        write_scene_files(site, site.start, path)
        write_outputs(site, log, verify(site, log), path)
    return path


def test_a_run_makes_its_context_once(folder, made):
    assert made == {kind.__name__: 1 for kind in MADE_ONCE} | {"check_site": 1}


def test_every_check_passes(folder):
    report = json.loads((folder / "report.json").read_text())
    assert report["passed"], [row for row in report["checks"] if not row["passed"]]
    assert [row["name"] for row in report["checks"]] == sorted(
        (row["name"] for row in report["checks"]), key=CHECK_NAMES.index
    )
    assert {row["name"] for row in report["checks"]} == set(CHECK_NAMES)


def test_log_verifies_again_without_the_description_files(folder):
    book = open_log(folder / "log")
    assert verify(Site(book.scene), book).passed


def test_a_goal_that_was_moved_fails_tracking(folder):
    import dataclasses

    log = open_log(folder / "log")
    scene = log.scene
    goals = list(scene.task.motion.goals)
    x, y, z = goals[2].position
    goals[2] = goals[2].model_copy(update={"position": (x, y, z + 0.002)})
    motion = scene.task.motion.model_copy(update={"goals": tuple(goals)})
    moved = dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))
    row, site = tracking.check_tool[0], Site(moved)
    found = judge(site, row.check, row.quantity, row.limit, row.find(Evidence(site, log.read(0, log.count))))
    assert not found.passed
    assert found.where == goals[2].name
