"""What cylinders, drives and members were asked for: stroke, force, speed, pressures in chambers, and use of strength."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from vgtsim.kinematics import first_greatest
from vgtsim.log import RunLog
from vgtsim.site import Site
from vgtsim.statics import MODES, SLENDERNESS_ADVICE
from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import (
    Finding,
    Measure,
    has_cases,
    is_imposed,
    least_of,
    missing,
    report_as,
    when,
    worst_of,
)

SATURATIONS = {  # bits of `RunLog.saturation` that each drive sets
    "servo": {1: "above its rated speed", 2: "at its force limit", 4: "beyond its stroke"},
    "hydraulic": {
        1: "at its flow limit",
        2: "at its relief pressure",
        4: "at an end of its stroke",
        8: "with a cavity in its oil",
    },
}


@report_as("actuator_stroke", "distance to the end of a stroke", limit="actuator_stroke", sense="at least")
def check_stroke_room(run: Evidence) -> Finding:
    """Least distance of a cylinder from the ends of its stroke."""
    low, high = run.site.chain.stroke.reshape(2, -1)
    return least_of(np.minimum(run.log.actual - low, high - run.log.actual), run.log.time, run.actuator_names)


@report_as("actuator_speed", "speed over rated speed", limit="actuator_speed")
def check_speed(run: Evidence) -> Finding:
    """Greatest speed of a cylinder over its rated one, from differenced lengths."""
    speed = np.abs(np.diff(run.wide.actual, axis=0)) / np.diff(run.wide.time)[:, None]
    return worst_of(speed / collect(run.site, "rate"), run.wide.time[1:], run.actuator_names)


@report_as("actuator_speed", "acceleration over the scene's", limit="actuator_acceleration", applies=is_imposed)
def check_acceleration(run: Evidence) -> Finding:
    """Greatest acceleration of a cylinder over that of the scene's motion, from differenced lengths."""
    return _find_acceleration(run, run.wide.actual)


@report_as("actuator_speed", "commanded acceleration over the scene's", limit="actuator_acceleration")
def check_commanded_acceleration(run: Evidence) -> Finding:
    """Greatest acceleration that a cylinder was asked for, over that of the scene's motion; an arm that gives rings."""
    return _find_acceleration(run, run.wide.commanded)


def _find_acceleration(run: Evidence, lengths: Array) -> Finding:
    step = run.wide.time[1] - run.wide.time[0]
    part = np.abs(np.diff(lengths, n=2, axis=0)) / (step**2 * run.site.task.motion.acceleration)
    return worst_of(part, run.wide.time[1:-1], run.actuator_names)


@report_as("actuator_speed", "logged speed to differenced lengths", limit="logged_speed")
def check_logged_speed(run: Evidence) -> Finding:
    """Greatest difference of a logged cylinder speed from that of the lengths."""
    return worst_of(np.abs(run.log.rates - run.speeds), run.log.time, run.actuator_names)


@report_as("actuator_force", "drive force over capacity", limit="actuator_force")
def check_actuators(run: Evidence) -> Finding:
    """Greatest drive force over what the supply pressure holds."""
    force, pull, push = run.log.actuator_force, collect(run.site, "pull"), collect(run.site, "push")
    return worst_of(np.where(force > 0, force / pull, -force / push), run.log.time, run.actuator_names)


def find_saturation(run: Evidence, bit: int) -> Finding:
    """Part of the records since each of which some cylinder had reached a limit, at the cylinder that did most often."""
    log, names = run.outline, run.actuator_names
    if not log.saturation.size:
        return missing("the log does not say what saturated")
    hit = (log.saturation & bit) != 0
    if not hit.any():
        return Finding(value=0.0)
    share, worst = float(hit.any(axis=1).mean()), int(np.argmax(hit.sum(axis=0)))
    detail = f"{hit.any(axis=0).sum()} cylinders, {share:.1%} of the records"
    return Finding(value=share, where=names[worst], when=float(log.time[np.argmax(hit[:, worst])]), detail=detail)


check_saturations: tuple[Measure, ...] = tuple(
    report_as("actuator_force", f"records with a cylinder {words}", limit="saturation", applies=when(drive=drive))(
        partial(find_saturation, bit=bit)
    )
    for drive, bits in SATURATIONS.items()
    for bit, words in bits.items()
)


@report_as("actuator_force", "chamber pressure over supply", limit="actuator_force", applies=when(drive="hydraulic"))
def check_highest_pressure(run: Evidence) -> Finding:
    """Greatest pressure in a chamber over the supply's."""
    log, supply = run.log, collect(run.site, "pressure")
    return lacks_pressures(log) or worst_of(log.pressure.max(axis=2) / supply, log.time, run.actuator_names)


@report_as(
    "actuator_force",
    "least chamber pressure above the tank's",
    limit="chamber_pressure",
    sense="at least",
    applies=when(drive="hydraulic"),
)
def check_lowest_pressure(run: Evidence) -> Finding:
    """Least pressure in a chamber, above the tank's."""
    return lacks_pressures(run.log) or least_of(run.log.pressure.min(axis=2), run.log.time, run.actuator_names)


@report_as("actuator_force", "drive force over capacity, load cases", limit="actuator_force", applies=has_cases)
def check_case_drives(run: Evidence) -> Finding:
    """Greatest part of the drives' capacity used in any load case at any recorded pose."""
    return find_worst_case(run, run.envelope.pressure)


@report_as("member_utilisation", "force over strength", limit="member_utilisation")
def check_utilisation(run: Evidence) -> Finding:
    """Greatest demand over strength, with the mode that governs and the margin that is left."""
    used, slender = run.use.strength, run.ratings.slenderness
    found = worst_of(used, run.log.time, run.names)
    if not np.isfinite(found.value):
        return found
    record, member = np.unravel_index(np.nanargmax(used), used.shape)
    mode = MODES[int(first_greatest(run.use.by_mode[:, record, member]))]
    text = f"governed by {mode}, KL/r {slender[record, member]:.0f}, margin {_margin(found.value):.3g}"
    if (most := float(np.nanmax(slender))) > SLENDERNESS_ADVICE:
        name = run.names[int(np.nanargmax(np.nanmax(slender, axis=0)))]
        text += f"; {name} has KL/r {most:.0f}, more than the {SLENDERNESS_ADVICE:.0f} that AISC 360 E2 advises"
    return replace(found, detail=text)


@report_as("member_utilisation", "force over strength, load cases", limit="member_utilisation", applies=has_cases)
def check_case_strength(run: Evidence) -> Finding:
    """Greatest part of the strength used in any load case at any recorded pose."""
    return find_worst_case(run, run.envelope.strength)


def find_worst_case(run: Evidence, used: Array) -> Finding:
    """Worst of demands over capacity, shape (C, T, M), with its load case and margin."""
    case, *_ = np.unravel_index(first_greatest(used), used.shape)
    found = worst_of(used[case], run.log.time[run.case_records], run.names)
    return replace(found, detail=f"case {run.envelope.cases[int(case)]}, margin {_margin(found.value):.3g}")


def _margin(used: float) -> float:
    """Part by which a demand could grow."""
    return 1 / used - 1 if used else float("inf")


def lacks_pressures(log: RunLog) -> Finding | None:
    """Say that a log has no pressures, if so."""
    lacks = log.pressure.shape[:2] != log.actual.shape
    return missing("the log has no pressures of the cylinders") if lacks else None


def collect(site: Site, field: str) -> Array:
    """One figure of every cylinder, shape (J,)."""
    members, cylinders = site.truss.members, site.arm.cylinders
    return np.array([getattr(cylinders[members[i].section], field) for i in site.truss.actuated])
