"""Redundancy resolution: which of the many shapes that meet a goal the arm takes."""

from vgtsim.redundancy.solver import GoalSolution, Keep, solve_goal
from vgtsim.redundancy.surroundings import Surroundings

__all__ = ["GoalSolution", "Keep", "Surroundings", "solve_goal"]
