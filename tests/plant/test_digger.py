"""The tool of a plant removes waste at its rate, and its push is a load that the members carry."""

from __future__ import annotations

import numpy as np
import pytest
from digging import TOOL, over_waste, sweep
from playing import bend

from vgtsim.errors import CommandError
from vgtsim.log import open_log
from vgtsim.log.runlog import CUTTING
from vgtsim.planning.cutting import foresee_waste
from vgtsim.plant import Plant, begin_log, record, run
from vgtsim.site import Site
from vgtsim.statics import solve_members, tool_forces

PUSHED = 1e-6  # of the greatest force: at rest


@pytest.fixture(scope="module", params=["rigid", "sections"])
def site(request, reach_scene):
    return Site(over_waste(reach_scene, members=request.param))


@pytest.fixture(scope="module")
def plant(site):
    return Plant(site)


def test_tool_at_rest_cuts_at_its_rate_and_presses_on_the_arm(site, plant):
    plant.reset(inputs=bend(site.scene, [0.5, 0.3], [0.4, 0.9]))
    plant.command(tool=1.0)
    plant.step(101)  # in the first step it comes to power
    log = plant.log
    step, steps = plant.timestep, round(log.time[-1] / plant.timestep)
    assert log.removed[-1] == pytest.approx(site.diggings.rate * step * (steps - 0.5), rel=1e-12)
    assert log.tool_force[-1] == pytest.approx([0, 0, TOOL.push])
    nodes, wrench = log.nodes[-1:], np.zeros((1, 6))
    wrench[:, :3] = log.tool_force[-1]
    pushed, free = (
        solve_members(site.load_model, nodes, None, force)
        for force in (tool_forces(site.load_model, nodes, wrench), None)
    )
    axial, largest = log.axial(site.truss.ends)[-1], np.abs(pushed.near_axial).max()
    assert np.abs(axial - pushed.near_axial).max() < PUSHED * largest
    assert np.abs(axial - free.near_axial).max() > 1e-3 * largest  # the push is felt
    assert log.mast_reaction[-1, 2] == pytest.approx(free.reaction[0, 2] - TOOL.push, rel=PUSHED)


def test_same_commands_leave_the_same_waste_bit_for_bit_and_a_reset_brings_it_back(site, plant):
    found = []
    for _ in range(2):
        plant.reset(inputs=bend(site.scene, [0.5, 0.3], [0.4, 0.9]))
        plant.command(tool=0.7)
        plant.step(40)
        found.append(plant.log)
    assert np.array_equal(found[0].bed[0], site.diggings.start)
    assert not np.array_equal(found[0].bed[-1], site.diggings.start)
    assert found[0].bed.tobytes() == found[1].bed.tobytes()
    assert found[0].removed.tobytes() == found[1].removed.tobytes()


def test_waste_is_left_as_it_was_foreseen(site):
    program = sweep(site)
    log, cut = run(site, program), program.legs[-1]
    points = site.chain.tool(site.chain.inputs_from_lengths(cut.lengths))[0]
    foreseen = foresee_waste(site, points, cut.tool, program.timestep, site.diggings.start)
    assert np.ptp(log.bed[-1]) > 0.01
    assert log.bed[-1] == pytest.approx(foreseen, abs=1e-6)
    assert log.removed[-1] == pytest.approx(float(site.diggings.removed(log.bed[-1])), rel=1e-12)


@pytest.mark.parametrize("share", [-0.1, 1.5])
def test_share_of_power_is_refused(site, plant, share):
    plant.reset(inputs=bend(site.scene, [0.5, 0.3], [0.4, 0.9]))
    with pytest.raises(CommandError, match="0 to 1"):
        plant.command(tool=share)


def test_arm_that_cuts_nothing_has_no_tool_to_command(reach_scene):
    plant = Plant(Site(reach_scene))
    plant.reset()
    with pytest.raises(CommandError, match="no step of the scene's mission cuts"):
        plant.command(tool=0.5)
    assert not plant.log.bed.size


def test_log_on_disk_goes_on_bit_for_bit_after_a_kill(reach_scene, tmp_path):
    site = Site(over_waste(reach_scene, members="sections"))
    program = sweep(site)
    record(site, program, begin_log(site, program, tmp_path))
    whole = open_log(tmp_path)
    first = whole.read(0, whole.count)
    for name in ("_end.json", "000001.parquet"):
        (tmp_path / name).unlink()
    record(site, program, begin_log(site, program, tmp_path, resume=True))
    again = open_log(tmp_path).read(0, whole.count)
    memory = run(site, program)
    for name in CUTTING:
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes() == getattr(memory, name).tobytes()
    assert len(list(tmp_path.glob("0*.parquet"))) == 2
