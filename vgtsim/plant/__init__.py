"""The stepped arm: drives, oil, valves, springs and contact behind one step, and the recorder of its log."""

from vgtsim.plant.loads import carry_waste
from vgtsim.plant.operating import Operation
from vgtsim.plant.plant import Plant
from vgtsim.plant.runs import Programme, begin_log, operate, record, run

__all__ = [
    "Operation",
    "Plant",
    "Programme",
    "begin_log",
    "carry_waste",
    "operate",
    "record",
    "run",
]
