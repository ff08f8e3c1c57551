"""The step loop."""

from vgtsim.plant.loop import run

__all__ = ["run"]
