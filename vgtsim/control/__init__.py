"""From goals to timed actuator lengths."""

from vgtsim.control.checks import check_scene
from vgtsim.control.program import Leg, LengthProgram, make_program, solve_first_goal
from vgtsim.control.riser import RISER_SPARE, RiserFit, riser_fit

__all__ = [
    "RISER_SPARE",
    "Leg",
    "LengthProgram",
    "RiserFit",
    "check_scene",
    "make_program",
    "riser_fit",
    "solve_first_goal",
]
