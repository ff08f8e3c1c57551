"""From goals to timed actuator lengths."""

from vgtsim.planning.checks import check_site
from vgtsim.planning.collisions import Collision, list_collisions, tell_collisions
from vgtsim.planning.inspection import inspect_site
from vgtsim.planning.tour import Leg, Tour, plan_tour, solve_first_goal

__all__ = [
    "Collision",
    "Leg",
    "Tour",
    "check_site",
    "inspect_site",
    "list_collisions",
    "plan_tour",
    "solve_first_goal",
    "tell_collisions",
]
