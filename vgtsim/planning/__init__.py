"""From goals to timed actuator lengths."""

from vgtsim.planning.checks import check_site
from vgtsim.planning.collisions import Collision, list_collisions, tell_collisions
from vgtsim.planning.insertion import Insertion, plan_insertion
from vgtsim.planning.inspection import inspect_site
from vgtsim.planning.mission import plan_mission, plan_phases, plan_site
from vgtsim.planning.pace import STEP_BOUND, name_bound
from vgtsim.planning.tour import Leg, Tour, plan_tour, solve_first_goal

__all__ = [
    "STEP_BOUND",
    "Collision",
    "Insertion",
    "Leg",
    "Tour",
    "check_site",
    "inspect_site",
    "list_collisions",
    "name_bound",
    "plan_insertion",
    "plan_mission",
    "plan_phases",
    "plan_site",
    "plan_tour",
    "solve_first_goal",
    "tell_collisions",
]
