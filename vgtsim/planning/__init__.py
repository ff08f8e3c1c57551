"""From goals to timed actuator lengths."""

from vgtsim.planning.checks import check_site
from vgtsim.planning.riser import RISER_SPARE, RiserFit, riser_fit
from vgtsim.planning.tour import Leg, Tour, plan_tour, solve_first_goal

__all__ = ["RISER_SPARE", "Leg", "RiserFit", "Tour", "check_site", "plan_tour", "riser_fit", "solve_first_goal"]
