"""Assembly on site: the part that stands does not move when the next module is set on it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import vgtsim
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.assembly import CLAMP, HOOK, check_headroom, cut_arm, needed_headroom, plan_assembly
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.insertion import follow_directrix

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def site():
    return vgtsim.load("arm9_nullspace")


@pytest.fixture(scope="module")
def way(site):
    return follow_directrix(site, make_directrix(5.9, [(8.0, 1 / 4.6)]), np.radians(-170.0))


@pytest.fixture(scope="module")
def stages(site, way):
    return plan_assembly(site, way)


def nodes_at(stage, way, height):
    """Nodes of the stage's part with its upper face at a height, from its own chain."""
    chain = Chain(stage.chain.manipulator, hanging_mount(height))
    return chain.nodes(stage.inputs(way, np.array(height)))


def test_part_is_the_end_of_the_arm(site):
    arm = site.arm
    part = cut_arm(arm, 2)
    assert part.modules == arm.modules[2:]
    assert len(part.active) == len(arm.active) - 1
    whole = site.chain.nodes(site.chain.stowed)
    top = site.chain.frames(site.chain.stowed)[1][2, 2]
    alone = Chain(part, hanging_mount(top))
    np.testing.assert_allclose(alone.nodes(alone.stowed), whole[-len(alone.truss.nodes) :], atol=1e-12)


def test_lower_part_stands_still_at_every_hand_over(way, stages):
    for below, above in pairwise(stages):
        before, after = nodes_at(below, way, below.end), nodes_at(above, way, above.begin)
        np.testing.assert_allclose(after[-len(before) :], before, atol=1e-9)
        assert len(after) > len(before)


def test_stages_are_the_way_of_the_whole_arm(site, way, stages):
    for stage in stages:
        for height in np.linspace(stage.begin, stage.end, 5):
            feed = height - stage.drop
            first, last = way.feed([0.0, 1.0])
            if not last <= feed <= first:
                continue
            q = way.spline((feed - first) / (last - first))
            whole = site.chain.nodes(q) + [0.0, 0.0, feed]
            part = nodes_at(stage, way, height)
            np.testing.assert_allclose(part, whole[-len(part) :], atol=1e-9)
    assert stages[-1].units == 3
    assert stages[-1].end == pytest.approx(site.scene.pivot_height)


def test_units_stand_above_the_flange_and_under_the_headroom(site, stages):
    flange = site.tank.grade + site.tank.arm_riser.above_grade
    assert {round(stage.end - flange, 9) for stage in stages[:-1]} == {CLAMP}
    assert max(stage.begin for stage in stages) + HOOK - site.tank.grade == pytest.approx(needed_headroom(site))


def test_headroom_below_a_module_is_refused(site):
    low = vgtsim.Site(replace(site.scene, tank=site.tank.model_copy(update={"headroom": 4.0})))
    with pytest.raises(DescriptionError, match=r"headroom: found 4 m, 0.\d+ m less than the longest module of arm9"):
        check_headroom(low)
    check_headroom(vgtsim.Site(replace(site.scene, tank=site.tank.model_copy(update={"headroom": 5.0}))))
