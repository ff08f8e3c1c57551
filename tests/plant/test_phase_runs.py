"""A mission in phases in MuJoCo: a module is set on, a short arm cuts with its tool at ease, and the waste is carried on."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import change, hoist

import vgtsim
from vgtsim.description import Clamp, CuttingTool, Patch, cut_arm, list_phases
from vgtsim.description.mission import AddStep, CutStep, WithdrawStep
from vgtsim.planning import plan_mission
from vgtsim.planning.directrix import make_directrix
from vgtsim.planning.insertion import follow_directrix
from vgtsim.planning.phases import cut_way
from vgtsim.plant import carry_waste, run
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, join_phases, verify

pytestmark = pytest.mark.long
TOOL = CuttingTool(
    kind="scarifier", width=0.8, reach=0.5, removal=0.05, energy=100.0, ramp=0.4, power=5e3, reaction=400.0
)
DEPTH = 0.1  # m
TOWARDS = np.radians(-10.0)  # of the way in's plane, about the hanging base: 10 degrees in frame G


@pytest.fixture(scope="module")
def scene():
    """Two modules of the nine-actuator arm, whose pivot hangs so high that both must bend little to reach the patch."""
    base = vgtsim.load("arm9_nullspace").scene
    base = hoist(change(base, members="sections", log_rate=40.0), acceleration=0.5)
    waste = base.tank.waste.model_copy(update={"level": 1.0, "grid": 0.2, "strength": 1e3})
    tank = base.tank.model_copy(
        update={"waste": waste, "headroom": None, "clamp": Clamp(name="jaws", above_flange=0.3)}
    )
    mast = base.task.mast.model_copy(update={"pivot_depth": 1.2})
    patch = Patch(name="here", corner=(1.5, 0.2), along=(0.3, 0.0), across=(0.0, 0.3))
    steps = (
        AddStep(do="add_module", time=0.4),
        AddStep(do="add_module", time=0.4),
        CutStep(do="cut", patch="here", depth=DEPTH, rows=2, direction="free"),
        WithdrawStep(do="withdraw"),
    )
    motion = base.task.motion.model_copy(update={"start": None, "rate_fraction": 1.0, "acceleration": 0.2})
    limits = {"closure": 1e-6, "kinematics_agreement": 1e-5, "command": 1e-6, "axial_force_moving": 1e-3}  # of sections
    update = {
        "mast": mast,
        "tool": TOOL,
        "patches": (patch,),
        "mission": steps,
        "motion": motion,
        "contacts": (),
        "limits": base.task.limits.model_copy(update=limits),
    }
    task = base.task.model_copy(update=update)
    return dataclasses.replace(base, task=task, tank=tank, manipulator=cut_arm(base.manipulator, 2))


def test_every_check_passes_over_phases_in_which_the_arm_grows_cuts_and_is_taken_apart(scene):
    sites = [Site(item) for item in list_phases(scene)]
    assert [len(site.arm.active) for site in sites] == [1, 2, 1]
    ways = cut_way(sites[1], follow_directrix(sites[1], make_directrix(5.9, [(6.0, 1 / 6.0)]), TOWARDS))
    runs = []
    for site in sites:
        place = carry_waste(site, runs[-1].source) if runs else site
        tour = plan_mission(place, ways[len(site.arm.active) - 1])
        log = run(place, tour)
        runs.append(JudgedRun(place, log, verify(place, log, tour)))
    report = join_phases(runs)
    assert [(row.quantity, row.measured) for row in report.checks if not row.passed] == []
    first, cut, last = (item.source for item in runs)
    ground = sites[0].diggings
    assert ground is not None
    assert np.array_equal(first.bed[-1], ground.start)
    assert last.bed[0].tobytes() == cut.bed[-1].tobytes()
    middle = np.add(scene.task.patches[0].corner, 0.15)
    under = np.linalg.norm(ground.places - middle, axis=1) < ground.bed.spacing
    assert (ground.start - last.bed[-1])[under] == pytest.approx(DEPTH, abs=1e-3)
    assert cut.removed[-1] > 0.01
