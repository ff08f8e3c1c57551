"""The list of collisions against the least clearance, which compiled code finds in another way."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from vgtsim.description.motion import Bend
from vgtsim.errors import PostureError
from vgtsim.planning import check_site, list_collisions, tell_collisions
from vgtsim.positioning.restarts import make_postures
from vgtsim.site import Site

SAMPLED = 1e-3  # m: a member is looked at in points
WANTED = 0.1


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(reach_scene)


def test_the_deepest_collision_is_the_least_clearance(site):
    postures = make_postures(site.box).q[[*range(15), *range(300, 315)]]
    least, places = site.surroundings.clearance(postures)
    assert np.any(least < WANTED)
    assert np.any(least >= WANTED)
    for q, gap, place in zip(postures, least, places, strict=True):
        found = list_collisions(site, q, WANTED)
        if gap >= WANTED + SAMPLED:
            assert not found
        elif gap < WANTED - SAMPLED:
            assert found[0].gap == pytest.approx(gap, abs=SAMPLED)
            assert place in (found[0].obstacle, "the arm itself")


def test_every_part_under_the_floor_is_listed(site):
    nodes = site.chain.nodes(site.chain.straight)
    deep = {name for name, z in zip(site.truss.nodes, nodes[:, 2], strict=True) if z < 0}
    found = list_collisions(site, site.chain.straight, WANTED)
    assert deep <= {item.part for item in found if item.obstacle == "waste"}
    assert [item.gap for item in found] == sorted(item.gap for item in found)
    lines = tell_collisions(found)
    assert len(lines) == len({(item.module, item.obstacle) for item in found})


def test_the_point_of_a_collision_lies_on_its_part(site):
    nodes = site.chain.nodes(site.chain.straight)
    for item in list_collisions(site, site.chain.straight, WANTED):
        if item.part not in site.truss.member_names:
            continue
        a, b = nodes[list(site.truss.members[site.truss.member_names.index(item.part)].ends)]
        part = np.dot(np.subtract(item.point, a), b - a) / np.dot(b - a, b - a)
        assert np.allclose(a + part * (b - a), item.point)
        assert -1e-9 < part < 1 + 1e-9


def test_a_refused_start_tells_all_its_collisions(reach_scene):
    motion = reach_scene.task.motion.model_copy(update={"start": (Bend(),) * 5})
    scene = dataclasses.replace(reach_scene, task=reach_scene.task.model_copy(update={"motion": motion}))
    with pytest.raises(
        PostureError, match=r"payload at \(0\.00, 0\.00, .*\) m, .* m inside waste, and 9 other"
    ) as caught:
        check_site(Site(scene))
    assert len(caught.value.collisions) > 100
    assert caught.value.key == "motion.start"
    assert re.search(r"found a posture \d\.\d+ m inside waste; allowed: 0\.\d+ m from everything", str(caught.value))
