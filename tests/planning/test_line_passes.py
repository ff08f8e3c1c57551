from __future__ import annotations

from dataclasses import replace

import pytest

from vgtsim.description.conveyance import Conveyance
from vgtsim.errors import DescriptionError
from vgtsim.planning.checks import check_passage
from vgtsim.site import Site

SCREWS = {"kind": "screws", "diameter": 0.13, "mass": 40.0}


def check(scene, line):
    site = Site(replace(scene, task=scene.task.model_copy(update={"conveyance": line})))
    check_passage(site, site.start[None])


@pytest.mark.parametrize(
    ("line", "key"),
    [
        (Conveyance(diameter=0.6), "conveyance.diameter"),
        (Conveyance(diameter=0.1, bend_radius=5.0), "conveyance.bend_radius"),
        (Conveyance.model_validate(SCREWS | {"joint_angle": "1 deg"}), "conveyance.joint_angle"),
    ],
)
def test_a_line_that_does_not_fit_is_refused_with_figures(reach_scene, line, key):
    with pytest.raises(DescriptionError, match=key):
        check(reach_scene, line)


@pytest.mark.parametrize(
    "line",
    [Conveyance(diameter=0.13, bend_radius=0.5), Conveyance.model_validate(SCREWS | {"joint_angle": "60 deg"})],
)
def test_a_line_of_four_inches_fits(reach_scene, line):
    check(reach_scene, line)


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        ({"bore": 0.2}, "less than the diameter"),
        ({"contents": 1300.0}, "a bore"),
        ({"joint_angle": 0.5}, "screws"),
        ({"kind": "screws"}, "joint_angle"),
        ({"kind": "screws", "joint_angle": 0.5, "bend_radius": 1.0}, "hose"),
    ],
)
def test_entries_that_do_not_fit_each_other_are_refused(entries, told):
    with pytest.raises(ValueError, match=told):
        Conveyance.model_validate({"diameter": 0.13} | entries)
