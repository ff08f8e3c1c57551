"""From goals to timed actuator lengths."""

from vgtsim.planning.checks import check_scene
from vgtsim.planning.program import Leg, LengthProgram, make_program, solve_first_goal
from vgtsim.planning.riser import RISER_SPARE, RiserFit, riser_fit

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
