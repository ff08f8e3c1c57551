"""Run log to report: every check made, none left out."""

from __future__ import annotations

from typing import Literal

import numpy as np

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.runlog import RunLog
from vgtsim.verification import loads as load_checks
from vgtsim.verification import shape, space
from vgtsim.verification.findings import Finding
from vgtsim.verification.report import Check, Report

_Sense = Literal["at most", "at least"]


def verify(scene: Scene, log: RunLog) -> Report:
    """Hold a run against the description and the project's own kinematics and statics. MuJoCo takes no part.

    Args:
        scene: The scene.
        log: Its run.

    Returns:
        The report.
    """
    chain = Chain(scene.manipulator, hanging_mount(scene.pivot_height))
    elastic = scene.task.simulation.members == "elastic"
    distance, angle = shape.find_tool_errors(log, chain, scene)
    forces = load_checks.find_loads(log, chain, scene)
    use, ratings = load_checks.find_utilisation(log, chain, scene, forces)
    cases = load_checks.check_cases(log, chain, scene)
    clearance_time, clearance, nearest = space.find_clearance(log, chain, scene)
    findings: tuple[tuple[str, str, str, str, _Sense, Finding], ...] = (
        (
            "closure",
            "gap between member end and hub",
            "closure",
            "m",
            "at most",
            shape.check_closure(log, chain),
        ),
        (
            "kinematics_agreement",
            "settled node to stiffness solution" if elastic else "node to forward kinematics",
            "kinematics_agreement",
            "m",
            "at most",
            shape.check_settled_shape(log, chain, scene) if elastic else shape.check_kinematics(log, chain),
        ),
        (
            "tracking",
            "tool position at a settled goal",
            "tracking_position",
            "m",
            "at most",
            shape.check_tracking(log, distance, scene),
        ),
        (
            "tracking",
            "tool direction at a settled goal",
            "tracking_angle",
            "rad",
            "at most",
            shape.check_tracking(log, angle, scene),
        ),
        (
            "axial_purity",
            "moment at a member's end",
            "end_moment",
            "N*m",
            "at most",
            load_checks.check_moment(log, chain, forces),
        ),
        (
            "axial_purity",
            "shear beyond own weight and inertia",
            "excess_shear",
            "N",
            "at most",
            load_checks.check_shear(log, chain, forces),
        ),
        (
            "axial_force",
            "error at rest over largest force",
            "axial_force_settled",
            "1",
            "at most",
            load_checks.check_axial_settled(log, chain, forces),
        ),
        (
            "axial_force",
            "error in motion over largest force",
            "axial_force_moving",
            "1",
            "at most",
            load_checks.check_axial_moving(log, chain, forces),
        ),
        (
            "actuator_stroke",
            "distance to the end of a stroke",
            "actuator_stroke",
            "m",
            "at least",
            shape.check_strokes(log, chain),
        ),
        (
            "actuator_force",
            "drive force over capacity",
            "actuator_force",
            "1",
            "at most",
            load_checks.check_actuators(log, chain),
        ),
        (
            "member_utilisation",
            "force over strength",
            "member_utilisation",
            "1",
            "at most",
            load_checks.check_utilisation(log, chain, use, ratings),
        ),
        *_drive_rows(scene, log, chain),
        *_case_rows(cases),
        ("clearance", "least distance to anything", "clearance", "m", "at least", nearest),
        ("contacts", "logged contacts", "contacts", "1", "at most", space.check_contacts(log)),
    )
    return Report(
        scene=scene.task.name,
        checks=tuple(_judge(scene, *row) for row in findings),
        performance=log.performance,
        versions=log.versions,
        series={
            "closure": shape.find_gaps(log, chain).max(axis=1),
            "tool_position_error": distance,
            "tool_angle_error": angle,
            "utilisation": use.strength,
            "utilisation_tension": use.tension,
            "utilisation_compression": np.maximum(use.compression, use.rod),
            "clearance_time": clearance_time,
            "clearance": clearance,
        },
    )


def _drive_rows(scene: Scene, log: RunLog, chain: Chain) -> tuple[tuple[str, str, str, str, _Sense, Finding], ...]:
    if scene.task.simulation.drive == "rigid":
        return ()
    found = load_checks.check_saturation(log, chain)
    return (("actuator_force", "records with a cylinder saturated", "saturation", "1", "at most", found),)


def _case_rows(
    cases: tuple[Finding, Finding] | None,
) -> tuple[tuple[str, str, str, str, _Sense, Finding], ...]:
    if cases is None:
        return ()
    return (
        ("member_utilisation", "force over strength, load cases", "member_utilisation", "1", "at most", cases[0]),
        ("actuator_force", "drive force over capacity, load cases", "actuator_force", "1", "at most", cases[1]),
    )


def _judge(scene: Scene, name: str, quantity: str, key: str, unit: str, sense: _Sense, found: Finding) -> Check:
    origin = scene.task.provenance.get(f"limits.{key}")
    return Check(
        name=name,
        quantity=quantity,
        measured=found.value,
        limit=float(getattr(scene.task.limits, key)),
        unit=unit,
        sense=sense,
        where=found.where,
        when=found.when if np.isfinite(found.when) else float("nan"),
        source=f"{origin.label}: {origin.note}" if origin else f"{scene.file.name}: limits.{key}",
        detail=found.detail,
    )
