"""Redundancy resolution: which of the many shapes that meet a goal the arm takes."""

from vgtsim.positioning.solver import GoalSolution, Keep, solve_goal
from vgtsim.positioning.surroundings import Surroundings

__all__ = ["GoalSolution", "Keep", "Surroundings", "solve_goal"]
