"""From goals to timed actuator lengths."""

from vgtsim.planning.capacity import unload_map
from vgtsim.planning.checks import check_site
from vgtsim.planning.collisions import Collision, list_collisions, tell_collisions
from vgtsim.planning.entry import Entry
from vgtsim.planning.following import Followed
from vgtsim.planning.insertion import plan_insertion
from vgtsim.planning.inspection import inspect_site
from vgtsim.planning.mission import plan_mission
from vgtsim.planning.pace import STEP_BOUND, name_bound
from vgtsim.planning.phases import plan_phases, plan_site
from vgtsim.planning.replanning import revise_as_run, revise_tour
from vgtsim.planning.resolution import goal_keep, make_objective, make_problem, report_solution, usual_way
from vgtsim.planning.timing import make_limits
from vgtsim.planning.tour import Leg, Tour, plan_tour, solve_first_goal

__all__ = [
    "STEP_BOUND",
    "Collision",
    "Entry",
    "Followed",
    "Leg",
    "Tour",
    "check_site",
    "goal_keep",
    "inspect_site",
    "list_collisions",
    "make_limits",
    "make_objective",
    "make_problem",
    "name_bound",
    "plan_insertion",
    "plan_mission",
    "plan_phases",
    "plan_site",
    "plan_tour",
    "report_solution",
    "revise_as_run",
    "revise_tour",
    "solve_first_goal",
    "tell_collisions",
    "unload_map",
    "usual_way",
]
