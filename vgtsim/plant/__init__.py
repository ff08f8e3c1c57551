"""The stepped arm: drives, oil, valves, springs and contact behind one step, and the recorder of its log."""

from vgtsim.plant.plant import Plant
from vgtsim.plant.recorder import Contact
from vgtsim.plant.state import PlantState
from vgtsim.plant.tour import run

__all__ = ["Contact", "Plant", "PlantState", "run"]
