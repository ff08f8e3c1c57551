"""Run log to report: every check made, none left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.runlog import RunLog
from vgtsim.verification import loads, shape, space
from vgtsim.verification.findings import Finding, worst_of
from vgtsim.verification.report import Check, Report


@dataclass(frozen=True)
class _Row:
    """One row of the report: a quantity, held against the limit of the same key in the scene."""

    key: str
    check: str
    quantity: str
    unit: str
    sense: Literal["at most", "at least"] = "at most"


_ROWS = (
    _Row("closure", "closure", "gap between member end and hub", "m"),
    _Row("kinematics_agreement", "kinematics_agreement", "node to forward kinematics", "m"),
    _Row("tracking_position", "tracking", "tool position at a settled goal", "m"),
    _Row("tracking_angle", "tracking", "tool direction at a settled goal", "rad"),
    _Row("end_moment", "axial_purity", "moment at a member's end", "N*m"),
    _Row("excess_shear", "axial_purity", "shear beyond own weight and inertia", "N"),
    _Row("axial_force_settled", "axial_force", "error at rest over largest force", "1"),
    _Row("axial_force_moving", "axial_force", "error in motion over largest force", "1"),
    _Row("actuator_stroke", "actuator_stroke", "distance to the end of a stroke", "m", "at least"),
    _Row("actuator_force", "actuator_force", "drive force over capacity", "1"),
    _Row("member_utilisation", "member_utilisation", "force over strength", "1"),
    _Row("clearance", "clearance", "least distance to anything", "m", "at least"),
    _Row("contacts", "contacts", "logged contacts", "1"),
)


def verify(scene: Scene, log: RunLog) -> Report:
    """Hold a run against the description and the project's own kinematics and statics. MuJoCo takes no part.

    Args:
        scene: The scene.
        log: Its run.

    Returns:
        The report.
    """
    chain = Chain(scene.manipulator, hanging_mount(scene.pivot_height))
    distance, angle = shape.find_tool_errors(log, chain, scene)
    forces = loads.find_loads(log, chain, scene)
    utilisation = loads.find_utilisation(log, chain, scene, forces)
    clearance_time, clearance, nearest = space.find_clearance(log, chain, scene)
    findings = {
        "closure": shape.check_closure(log, chain),
        "kinematics_agreement": shape.check_kinematics(log, chain),
        "tracking_position": shape.check_tracking(log, distance, scene),
        "tracking_angle": shape.check_tracking(log, angle, scene),
        "end_moment": loads.check_moment(log, chain, forces),
        "excess_shear": loads.check_shear(log, chain, forces),
        "axial_force_settled": loads.check_axial_settled(log, chain, forces),
        "axial_force_moving": loads.check_axial_moving(log, chain, forces),
        "actuator_stroke": shape.check_strokes(log, chain),
        "actuator_force": loads.check_actuators(log, chain),
        "member_utilisation": worst_of(utilisation, log.time, chain.truss.member_names),
        "clearance": nearest,
        "contacts": space.check_contacts(log),
    }
    series = {
        "closure": shape.find_gaps(log, chain).max(axis=1),
        "tool_position_error": distance,
        "tool_angle_error": angle,
        "utilisation": utilisation,
        "clearance_time": clearance_time,
        "clearance": clearance,
    }
    checks = tuple(_judge(scene, row, findings[row.key]) for row in _ROWS)
    return Report(scene.task.name, checks, log.performance, log.versions, series)


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
