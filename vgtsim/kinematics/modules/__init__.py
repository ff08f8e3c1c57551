"""Kinds of modules, one file each; what a chain asks of them is in `sets` and `kind`.

Adding a kind is adding a file with its `Kind`, a row here, and a class of its description.
"""

from __future__ import annotations

from vgtsim.description import Module
from vgtsim.kinematics.modules import (
    double_octahedral,
    general_double_octahedral,
    octahedral,
    static_section,
    tetrahedral,
)
from vgtsim.kinematics.modules.sets import Chord, Kind, ModuleSet, ModuleState, PlannedMember, find_singular

# by the name in the description; a chain has its sets in this order
KINDS: dict[str, Kind] = {
    "double_octahedral": double_octahedral.KIND,
    "double_octahedral_general": general_double_octahedral.KIND,
    "tetrahedral": tetrahedral.KIND,
    "octahedral": octahedral.KIND,
    "prism": static_section.KIND,
    "section": static_section.KIND,
}


def kind_of(module: Module) -> Kind:
    """The kind of a described module."""
    return KINDS[module.kind]


__all__ = ["KINDS", "Chord", "Kind", "ModuleSet", "ModuleState", "PlannedMember", "find_singular", "kind_of"]
