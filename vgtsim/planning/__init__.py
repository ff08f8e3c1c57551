"""From goals to timed actuator lengths."""

from vgtsim.planning.checks import check_site
from vgtsim.planning.tour import Leg, Tour, plan_tour, solve_first_goal

__all__ = ["Leg", "Tour", "check_site", "plan_tour", "solve_first_goal"]
