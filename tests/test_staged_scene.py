"""A staged entry: sludge too high for the whole arm, which comes in where shorter ones have cut room."""

from __future__ import annotations

import numpy as np
import pytest

import vgtsim
from vgtsim.description import list_phases
from vgtsim.description.mission import CutStep
from vgtsim.errors import PathError
from vgtsim.planning import plan_insertion, plan_phases
from vgtsim.plant import carry_waste
from vgtsim.verification import JudgedRun, join_phases


@pytest.mark.slow
def test_shorter_arms_cut_room_for_the_whole_arm():
    sites = [vgtsim.Site(scene) for scene in list_phases(vgtsim.load("type_ii_staged").scene)]
    assert [len(site.arm.active) for site in sites] == [1, 2, 3]
    for refused in sites[1:]:  # over the sludge as it is
        with pytest.raises(PathError, match="waste"):
            plan_insertion(refused)
    tours = plan_phases(sites)
    runs = []
    for site, tour in zip(sites, tours, strict=True):
        assert [leg.name for leg in tour.legs] == [stage.name for stage in site.task.stages]
        assert tour.way is not None
        assert tour.way.gaps["waste"] >= site.clearance
        place = carry_waste(site, runs[-1].source) if runs else site
        log = vgtsim.run(place, tour)
        runs.append(JudgedRun(place, log, vgtsim.verify(place, log, tour)))
    report = join_phases(runs)
    assert [(row.quantity, row.measured) for row in report.checks if not row.passed] == []
    near, far, whole = (item.source for item in runs)
    assert 0 < near.removed[-1] < far.removed[-1] == pytest.approx(whole.removed[-1], rel=1e-12)
    ground = sites[0].diggings
    assert ground is not None
    depths = [step.depth for site in sites for step in site.task.mission if isinstance(step, CutStep)]
    for patch, depth, bed in zip(sites[0].task.patches, depths, (near.bed[-1], far.bed[-1]), strict=True):
        middle = np.linalg.norm(ground.places - np.mean(patch.corners, axis=0), axis=1) < ground.bed.spacing
        layer = (ground.start - bed)[middle]
        assert np.all(
            (layer > 0.85 * depth) & (layer < depth + 1e-3)
        )  # the jet may go on before the last of a layer is gone
