"""Redundancy resolution: which of the many shapes that meet a goal the arm takes."""

from vgtsim.redundancy.solver import GoalSolution, SolverSettings, solve_goal
from vgtsim.redundancy.surroundings import Surroundings

__all__ = ["GoalSolution", "SolverSettings", "Surroundings", "solve_goal"]
