"""The step loop."""

from vgtsim.simulation.loop import run

__all__ = ["run"]
