"""Verdicts on a run, independent of MuJoCo."""

from vgtsim.verification.report import CHECK_NAMES, Check, Report
from vgtsim.verification.verify import verify

__all__ = ["CHECK_NAMES", "Check", "Report", "verify"]
