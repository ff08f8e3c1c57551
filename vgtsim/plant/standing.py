"""An arm stood in a posture: hubs in their places, and drives and correction made for it."""

from __future__ import annotations

from collections.abc import Sequence

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.plant.correction import Correction, Foresight
from vgtsim.plant.drives import Drive, RigidDrive, find_drive, find_row_drive
from vgtsim.plant.gauges import Gauges, SectionGauges
from vgtsim.plant.loads import Hose, Load
from vgtsim.plant.springs import fit_springs
from vgtsim.plant.turns import MemberTurns, SectionTurns
from vgtsim.site import Site
from vgtsim.statics import settle


def stand_arm(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    site: Site,
    gauges: Gauges,
    *,
    inputs: Array,
    nodes: Array,
    lengths: Array,
    turn: float,
    loads: Sequence[Load],
) -> tuple[Drive, Correction, int]:
    """Put the hubs at nodes, of the unloaded arm, shape (N, 3), m; an elastic arm sags to where it settles.

    Inputs, shape (n,), and lengths, shape (J,), m, are those of the nodes; the mast is turned, rad. Loads act beside the weight
    and that of the line of conveyance. The last result is the number of slow steps after which the arm is at rest.
    """
    mujoco.mj_resetData(model, data)
    chain, elastic = site.chain, site.task.simulation.members == "elastic"
    springs, calm = None, 2  # what is lost of the speed in the first slow step is still a force
    if elastic:
        springs = fit_springs(model, data, site, nodes)
        nodes = settle(site.held_model, nodes)
        calm = round(springs.period / model.opt.timestep)  # a ringing arm stands still twice a period
    gauges.stand(data, nodes)
    if isinstance(gauges, SectionGauges):
        drive: Drive = find_row_drive(model, data, site)
        turns = SectionTurns(model, gauges.pose)
    else:
        drive = find_drive(model, data, site, gauges.at, springs, nodes)
        turns = MemberTurns(model, gauges.at, chain)
    foresight = Foresight(turns, chain, inputs, lengths, turn) if isinstance(drive, RigidDrive) else None
    line = site.task.conveyance
    stiff = [Hose(model, site, gauges.nodes)] if line and line.bending_stiffness else []
    return drive, Correction(model, data, foresight, [*loads, *stiff]), calm
