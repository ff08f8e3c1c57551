"""Controllers that run beside the plant: an operator's commands to lengths, in real time. No MuJoCo."""

from vgtsim.control.controller import Controller
from vgtsim.control.postures import find_posture
from vgtsim.control.rehearsal import Rehearsal, apply, check_operation, rehearse
from vgtsim.control.report import ControlReport

__all__ = ["ControlReport", "Controller", "Rehearsal", "apply", "check_operation", "find_posture", "rehearse"]
