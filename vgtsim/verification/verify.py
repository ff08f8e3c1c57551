"""Run log to report: every check made, none left out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.runlog import RunLog
from vgtsim.verification import drives, loads, shape, space
from vgtsim.verification.findings import Finding
from vgtsim.verification.report import CHECK_NAMES, Check, Report


@dataclass(frozen=True)
class _Row:
    """One row of the report: a quantity, held against the limit of the same key in the scene."""

    key: str
    check: str
    quantity: str
    unit: str
    sense: Literal["at most", "at least"] = "at most"


_CLOSURE = _Row("closure", "closure", "gap between member end and hub", "m")
_AGREEMENT = _Row("kinematics_agreement", "kinematics_agreement", "node to forward kinematics", "m")
_POSITION = _Row("tracking_position", "tracking", "tool position at a settled goal", "m")
_ANGLE = _Row("tracking_angle", "tracking", "tool direction at a settled goal", "rad")
_MOMENT = _Row("end_moment", "axial_purity", "moment at a member's end", "N*m")
_SHEAR = _Row("excess_shear", "axial_purity", "shear beyond own weight and inertia", "N")
_BENT_AT_REST = _Row("axial_force_settled", "axial_purity", "bending error at rest over largest bending", "1")
_BENT_MOVING = _Row("axial_force_moving", "axial_purity", "bending error in motion over largest bending", "1")
_PURE = _Row("lumped_shear", "axial_purity", "shear at a member's end, mass in the hubs", "N")
_AT_REST = _Row("axial_force_settled", "axial_force", "error at rest over largest force", "1")
_MOVING = _Row("axial_force_moving", "axial_force", "error in motion over largest force", "1")
_STROKE = _Row("actuator_stroke", "actuator_stroke", "distance to the end of a stroke", "m", "at least")
_DRIVE = _Row("actuator_force", "actuator_force", "drive force over capacity", "1")
_DRIVE_AGREEMENT = _Row("axial_force_moving", "axial_force", "drive force error over largest force", "1")
_REACTION = _Row("axial_force_moving", "axial_force", "mast reaction error over the reaction", "1")
_TOOL = _Row("kinematics_agreement", "kinematics_agreement", "logged tool to its nodes", "m")
_COMMAND = _Row("tracking_position", "tracking", "cylinder length to its command", "m")
_FAULTS = _Row("contacts", "contacts", "warnings and early ends", "1")
_SATURATION = _Row("saturation", "actuator_force", "records with a cylinder", "1")
_HIGHEST = _Row("actuator_force", "actuator_force", "chamber pressure over supply", "1")
_LOWEST = _Row("chamber_pressure", "actuator_force", "least chamber pressure above the tank's", "Pa", "at least")
_OIL = _Row("axial_force_moving", "axial_force", "chamber pressures against drive force", "1")
_STRENGTH = _Row("member_utilisation", "member_utilisation", "force over strength", "1")
_CLEARANCE = _Row("clearance", "clearance", "least distance to anything", "m", "at least")
_CONTACTS = _Row("contacts", "contacts", "logged contacts", "1")


_ALWAYS = (_CLOSURE, _AGREEMENT, _TOOL, _POSITION, _ANGLE, _MOMENT, _SHEAR, _AT_REST, _MOVING, _DRIVE_AGREEMENT)
_ALWAYS += (_REACTION, _STROKE, _DRIVE, _STRENGTH, _CLEARANCE, _CONTACTS, _FAULTS)


def verify(scene: Scene, log: RunLog) -> Report:
    """Hold a run against the description and the project's own kinematics and statics. MuJoCo takes no part.

    Args:
        scene: The scene.
        log: Its run.

    Returns:
        The report.
    """
    chain = Chain(scene.manipulator, hanging_mount(scene.pivot_height))
    truss = chain.truss
    counts = (len(truss.nodes), len(truss.members), len(truss.actuated), len(scene.task.motion.goals))
    fault = log.find_fault() or log.find_misfit(*counts)
    if fault:
        missing = Finding(float("nan"), "the log", float("nan"), fault)
        checks = tuple(_judge(scene, row, missing) for row in _ALWAYS)
        return Report(scene.task.name, checks, log.performance, log.versions)
    distance, angle = shape.find_tool_errors(log, chain, scene)
    forces = loads.find_loads(log, chain, scene)
    use, ratings = loads.find_utilisation(log, chain, scene, forces)
    clearance_time, clearance, nearest = space.find_clearance(log, chain, scene)
    rows = [
        (_CLOSURE, shape.check_closure(log, chain)),
        _agreement(scene, log, chain),
        (_TOOL, shape.check_logged_tool(log, chain)),
        (_POSITION, shape.check_tracking(log, distance, scene)),
        (_ANGLE, shape.check_tracking(log, angle, scene)),
        *_command_rows(scene, log, chain),
        (_MOMENT, loads.check_moment(log, chain, forces)),
        (_PURE if scene.task.simulation.lumped else _SHEAR, loads.check_shear(log, chain, forces)),
        *_bending_rows(log, chain, forces),
        (_AT_REST, loads.check_axial_settled(log, chain, forces)),
        (_MOVING, loads.check_axial_moving(log, chain, forces)),
        (_DRIVE_AGREEMENT, loads.check_drives(log, chain, forces)),
        (_REACTION, loads.check_reaction(log, forces)),
        (_STROKE, shape.check_strokes(log, chain)),
        (_DRIVE, drives.check_actuators(log, chain)),
        (_STRENGTH, loads.check_utilisation(log, chain, use, ratings)),
        *_drive_rows(scene, log, chain),
        *_case_rows(scene, log, chain),
        (_CLEARANCE, nearest),
        (_CONTACTS, space.check_contacts(log)),
        (_FAULTS, space.check_faults(log)),
    ]
    series = {
        "closure": shape.find_gaps(log, chain).max(axis=1),
        "tool_position_error": distance,
        "tool_angle_error": angle,
        "utilisation": use.strength,
        "utilisation_tension": use.tension,
        "utilisation_compression": np.maximum(use.compression, use.rod),
        "clearance_time": clearance_time,
        "clearance": clearance,
    }
    judged = (_judge(scene, row, found) for row, found in rows)
    checks = tuple(sorted(judged, key=lambda check: CHECK_NAMES.index(check.name)))
    return Report(scene.task.name, checks, log.performance, log.versions, series)


def _agreement(scene: Scene, log: RunLog, chain: Chain) -> tuple[_Row, Finding]:
    """An elastic arm is where its stiffness puts it, which kinematics alone cannot tell."""
    if scene.task.simulation.members == "elastic":
        found = shape.check_settled_shape(log, chain, scene)
        return replace(_AGREEMENT, quantity="settled node to stiffness solution"), found
    return _AGREEMENT, shape.check_kinematics(log, chain)


def _command_rows(scene: Scene, log: RunLog, chain: Chain) -> list[tuple[_Row, Finding]]:
    """Rigid drives of a rigid arm have no excuse to trail; others may, and are judged at the goals."""
    simulation = scene.task.simulation
    if (simulation.drive, simulation.members) != ("rigid", "rigid"):
        return []
    return [(_COMMAND, shape.check_command(log, chain))]


def _bending_rows(log: RunLog, chain: Chain, forces: loads.Loads) -> list[tuple[_Row, Finding]]:
    """Only a joint offset bends members."""
    if not len(chain.truss.rings):
        return []
    both = ((_BENT_AT_REST, True), (_BENT_MOVING, False))
    return [(row, loads.check_bending(log, chain, forces, settled=settled)) for row, settled in both]


def _drive_rows(scene: Scene, log: RunLog, chain: Chain) -> list[tuple[_Row, Finding]]:
    """What a drive can run into, and whether the pressures in the log make up its forces."""
    drive = scene.task.simulation.drive
    rows = [
        (replace(_SATURATION, quantity=f"{_SATURATION.quantity} {words}"), drives.check_saturation(log, chain, bit))
        for bit, words in drives.SATURATIONS[drive].items()
    ]
    if drive != "hydraulic":
        return rows
    if log.pressure.shape[:2] != log.actual.shape:
        missing = Finding(float("nan"), "none", float("nan"), "the log has no pressures of the cylinders")
        return [*rows, (_HIGHEST, missing), (_LOWEST, missing), (_OIL, missing)]
    rows += [(_HIGHEST, drives.check_highest_pressure(log, chain)), (_LOWEST, drives.check_lowest_pressure(log, chain))]
    return [*rows, (_OIL, drives.check_pressure_force(log, chain))]


def _case_rows(scene: Scene, log: RunLog, chain: Chain) -> list[tuple[_Row, Finding]]:
    cases = loads.check_cases(log, chain, scene)
    if cases is None:
        return []
    rows = (replace(row, quantity=f"{row.quantity}, load cases") for row in (_STRENGTH, _DRIVE))
    return list(zip(rows, cases, strict=True))


def _judge(scene: Scene, row: _Row, found: Finding) -> Check:
    origin = scene.task.provenance.get(f"limits.{row.key}")
    return Check(
        name=row.check,
        quantity=row.quantity,
        measured=found.value,
        limit=float(getattr(scene.task.limits, row.key)),
        unit=row.unit,
        sense=row.sense,
        where=found.where,
        when=found.when,
        source=f"{origin.label}: {origin.note}" if origin else f"{scene.file.name}: limits.{row.key}",
        detail=found.detail,
    )
