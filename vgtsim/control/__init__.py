"""Controllers that run beside the plant: an operator's commands to lengths, in real time. No MuJoCo."""

from vgtsim.control.controller import Controller, ControlReport
from vgtsim.control.postures import find_posture
from vgtsim.control.rehearsal import apply, check_operation, rehearse

__all__ = ["ControlReport", "Controller", "apply", "check_operation", "find_posture", "rehearse"]
