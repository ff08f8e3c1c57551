"""Verdicts on a run, independent of MuJoCo."""

from vgtsim.verification.cutting import describe_removed
from vgtsim.verification.evidence import Evidence, PlannedTour
from vgtsim.verification.instant import Instant, find_instant
from vgtsim.verification.judged import JudgedRun
from vgtsim.verification.phases import find_begins, join_phases
from vgtsim.verification.report import CHECK_NAMES, MEASURES, Check, Report
from vgtsim.verification.tracking import goal_name
from vgtsim.verification.verify import verify

__all__ = [
    "CHECK_NAMES",
    "MEASURES",
    "Check",
    "Evidence",
    "Instant",
    "JudgedRun",
    "PlannedTour",
    "Report",
    "describe_removed",
    "find_begins",
    "find_instant",
    "goal_name",
    "join_phases",
    "verify",
]
