"""Verdicts on a run, independent of MuJoCo."""

from vgtsim.verification.cutting import describe_removed
from vgtsim.verification.evidence import Evidence, PlannedTour, find_riser_reaction
from vgtsim.verification.instant import Instant, find_instant
from vgtsim.verification.phases import PhaseRun, find_begins, join_phases
from vgtsim.verification.report import CHECK_NAMES, MEASURES, Check, Report
from vgtsim.verification.tracking import Hold, find_holds, goal_name
from vgtsim.verification.verify import verify

__all__ = [
    "CHECK_NAMES",
    "MEASURES",
    "Check",
    "Evidence",
    "Hold",
    "Instant",
    "PhaseRun",
    "PlannedTour",
    "Report",
    "describe_removed",
    "find_begins",
    "find_holds",
    "find_instant",
    "find_riser_reaction",
    "goal_name",
    "join_phases",
    "verify",
]
