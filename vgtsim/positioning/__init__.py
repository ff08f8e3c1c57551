"""Positioning: which of the many shapes that meet a goal the arm takes.

Three layers. The problem: goals, strokes, reduction, objective, surroundings (`problem`, and a file for each). The iteration:
Newton's method in the null space, `newton.minimise`, compiled in `descent`, `elimination` and `course`. The solution: `solve`
takes a batch of goals from given configurations (`methods`, `shape`); `solve_anywhere` starts unmet ones again; `solve_by_method`
takes one goal by any method of the dissertation, with restarts and clearance (`solver`, `restarts`).
"""

from vgtsim.positioning.goals import GoalSpace, Position, RowReport, evaluate, report_rows, tool_goal
from vgtsim.positioning.methods import ANCHOR_FREE, solve
from vgtsim.positioning.newton import (
    CONDITION_LIMIT,
    NewtonSettings,
    condition_numbers,
    lost_directions,
    name_direction,
)
from vgtsim.positioning.objectives import (
    ClearanceHinges,
    Configurations,
    Differences,
    LengthVariation,
    MidStroke,
    Nearness,
    Objective,
    StrokeBarrier,
    WeightedSum,
    goal_plane,
)
from vgtsim.positioning.problem import Keep, Problem
from vgtsim.positioning.reduction import Reduction, couple
from vgtsim.positioning.restarts import make_postures
from vgtsim.positioning.solution import Solution, join_solutions
from vgtsim.positioning.solver import solve_anywhere, solve_by_method
from vgtsim.positioning.starting import find_start, search_start
from vgtsim.positioning.strokes import StrokeBox, binding_actuators, bring_inside, inside, make_box
from vgtsim.positioning.surroundings import LeastGap, NearPairs, Surroundings

__all__ = [
    "ANCHOR_FREE",
    "CONDITION_LIMIT",
    "ClearanceHinges",
    "Configurations",
    "Differences",
    "GoalSpace",
    "Keep",
    "LeastGap",
    "LengthVariation",
    "MidStroke",
    "NearPairs",
    "Nearness",
    "NewtonSettings",
    "Objective",
    "Position",
    "Problem",
    "Reduction",
    "RowReport",
    "Solution",
    "StrokeBarrier",
    "StrokeBox",
    "Surroundings",
    "WeightedSum",
    "binding_actuators",
    "bring_inside",
    "condition_numbers",
    "couple",
    "evaluate",
    "find_start",
    "goal_plane",
    "inside",
    "join_solutions",
    "lost_directions",
    "make_box",
    "make_postures",
    "name_direction",
    "report_rows",
    "search_start",
    "solve",
    "solve_anywhere",
    "solve_by_method",
    "tool_goal",
]
