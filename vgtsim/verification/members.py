"""Is every member loaded along its axis, by the force that the method of joints gives?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.kinematics import Truss, find_rigid_sections
from vgtsim.site import Site
from vgtsim.statics import MemberForces
from vgtsim.verification.drives import collect, lacks_pressures
from vgtsim.verification.evidence import Array, Evidence, Index
from vgtsim.verification.measures import Finding, report_as, report_forces, when, worst_of

LEAST_FORCE = 1.0  # N; errors are relative to this where an arm without weight carries less
LEAST_MOMENT = 1.0  # N·m; the same of bending
_STOPPED = 4  # bit of `RunLog.saturation`: a piston at an end, where the barrel carries what the oil does not
_BODIES = ("rigid", "elastic")  # settings of `simulation.members` under which each member is a body


@report_as("axial_purity", "moment at a member's end", limit="end_moment", applies=when(members=_BODIES))
def check_moment(run: Evidence) -> Finding:
    """Greatest moment at the end of a member that has a ball there."""
    straight, names = _unbent(run.site.truss)
    return worst_of(np.linalg.norm(run.log.member_moment[:, straight], axis=-1), run.log.time, names)


@report_as(
    "axial_purity", "moment of a length row, which has none", limit="end_moment", applies=when(members="sections")
)
def check_rows(run: Evidence) -> Finding:
    """Say what is not measured where members are length rows."""
    inside = len(run.names) - len(find_rigid_sections(run.site.chain).rows)
    words = "shear is not simulated; forces inside static modules follow from statics"
    return Finding(value=0.0, detail=f"{words}: {inside} of {len(run.names)} members")


@report_as(
    "axial_purity",
    "shear beyond own weight and inertia",
    limit="excess_shear",
    applies=when(lumped=False, members=_BODIES),
)
def check_shear(run: Evidence) -> Finding:
    """Greatest shear at a member's end beyond its share of the member's own weight and inertia.

    Actuators between joint blocks are left to `check_bending`.
    """
    straight, names = _unbent(run.site.truss)
    excess = (run.shear - run.moving.near_transverse)[:, straight]
    return worst_of(np.linalg.norm(excess, axis=-1), run.log.time, names)


@report_as(
    "axial_purity",
    "shear at a member's end, mass in the hubs",
    limit="lumped_shear",
    applies=when(lumped=True, members=_BODIES),
)
def check_lumped_shear(run: Evidence) -> Finding:
    """Greatest shear at the end of a member that has no mass of its own."""
    return check_shear(run)


def _unbent(truss: Truss) -> tuple[Index, list[str]]:
    """Members that a joint offset does not bend, and their names."""
    straight = np.setdiff1d(np.arange(len(truss.members)), truss.ring_actuators)
    return straight, [truss.members[i].name for i in straight]


def _bends(site: Site) -> bool:
    """Whether members are bent: only a joint offset does that."""
    return len(site.truss.rings) > 0


def _find_bending(run: Evidence, rows: Index, expected: MemberForces) -> Finding:
    """Greatest error of what bends an actuator between joint blocks, over the greatest bending moment of the run.

    At the near pin the moment and, times the length, the shear; torsion and moments about the pin are errors. The detail
    has the greatest moment itself.
    """
    log, pinned = run.log, run.site.truss.ring_actuators.ravel()
    names, time = [run.names[i] for i in pinned], log.time[rows]
    turned = np.linalg.norm(log.member_moment[rows][:, pinned] - expected.near_moment[:, pinned], axis=-1)
    pushed = np.linalg.norm(run.shear[rows][:, pinned] - expected.near_transverse[:, pinned], axis=-1)
    size = np.linalg.norm(np.stack([expected.near_moment, expected.far_moment])[:, :, pinned], axis=-1).max(axis=0)
    greatest = worst_of(np.nan_to_num(size), time, names)
    error = np.maximum(turned, pushed * run.lengths[rows][:, pinned])
    detail = f"bending moment up to {greatest.value:.4g} N*m in {greatest.where} at {greatest.when:.2f} s"
    return replace(worst_of(error, time, names), detail=detail, over=max(greatest.value, LEAST_MOMENT))


check_bending = report_forces(
    "axial_purity", "bending error{} over largest bending", _find_bending, moving=" in motion", applies=_bends
)


def _find_axial_error(run: Evidence, rows: Index, expected: MemberForces) -> Finding:
    """Greatest error of an axial force at any instant, over the largest force of the instant."""
    return worst_of(relative_error(run.axial[rows], expected.near_axial), run.log.time[rows], run.names)


check_axial_settled, check_axial_moving = report_forces(
    "axial_force", "error{} over largest force", _find_axial_error, moving=" in motion"
)


def _find_drive_error(run: Evidence, rows: Index, expected: MemberForces) -> Finding:
    """Greatest error of a drive's force against the method of joints, over the largest force of the instant."""
    error = relative_error(run.log.actuator_force[rows], expected.bar[:, run.site.truss.actuated])
    return worst_of(error, run.log.time[rows], run.actuator_names)


check_drives_at_rest, check_drives = report_forces(
    "axial_force", "drive force error{} over largest force", _find_drive_error
)


def _find_reaction_error(run: Evidence, rows: Index, expected: MemberForces) -> Finding:
    """Greatest error of the mast's force and moment on the arm, each over that of the instant."""
    force, moment = (
        np.linalg.norm(part, axis=-1, keepdims=True) for part in (expected.reaction[:, :3], expected.reaction[:, 3:])
    )
    force = np.maximum(force, LEAST_FORCE)
    lever = np.maximum(moment, force)  # a metre's lever where the arm hangs straight
    size = np.repeat(np.concatenate([force, lever], axis=1), 3, axis=1)
    names = ("mast force x", "y", "z", "mast moment x", "y", "z")
    return worst_of(np.abs(run.log.mast_reaction[rows] - expected.reaction) / size, run.log.time[rows], names)


check_reaction_at_rest, check_reaction = report_forces(
    "axial_force", "mast reaction error{} over the reaction", _find_reaction_error
)


@report_as(
    "axial_force", "chamber pressures against drive force", limit="pressure_force", applies=when(drive="hydraulic")
)
def check_pressure_force(run: Evidence) -> Finding:
    """Greatest difference of pressures times areas, with the cylinder's damper, from a drive's force, over the instant's largest.

    A piston at an end of its stroke is left out: its barrel carries what the oil does not.
    """
    log, areas = run.log, [-collect(run.site, "bore_area"), collect(run.site, "ring_area")]
    if lack := lacks_pressures(log):
        return lack
    force = np.sum(run.wide.pressure * np.stack(areas, axis=-1), axis=-1)
    most = np.maximum(np.abs(log.actuator_force).max(axis=1, keepdims=True), LEAST_FORCE)
    free = (log.saturation & _STOPPED) == 0
    return worst_of(
        np.where(free, np.abs(run.find_pull(force) - log.actuator_force) / most, 0.0), log.time, run.actuator_names
    )


def relative_error(measured: Array, expected: Array) -> Array:
    """Difference over the largest expected force of each instant, shape (T, M), for forces of shape (T, M), N.

    Straight poses leave many members near zero, so the member's own force is no measure.
    """
    return np.abs(measured - expected) / np.maximum(np.max(np.abs(expected), axis=-1, keepdims=True), LEAST_FORCE)
