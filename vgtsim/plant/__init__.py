"""The stepped arm: drives, oil, valves, springs and contact behind one step, and the recorder of its log."""

from vgtsim.plant.loads import carry_waste
from vgtsim.plant.operating import Operation, begin_operation, operate, record_operation
from vgtsim.plant.plant import Plant
from vgtsim.plant.tour import begin_log, record, run
from vgtsim.plant.watch import PlantState
from vgtsim.runlog import Contact

__all__ = [
    "Contact",
    "Operation",
    "Plant",
    "PlantState",
    "begin_log",
    "begin_operation",
    "carry_waste",
    "operate",
    "record",
    "record_operation",
    "run",
]
