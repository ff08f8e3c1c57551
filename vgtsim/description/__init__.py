"""What a user writes: arms, tanks and scenes as frozen, validated data."""

from vgtsim.description.files import load_manipulator, load_scene, load_tank
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import (
    DoubleOctahedral,
    GeneralDoubleOctahedral,
    Octahedral,
    Prism,
    Section,
    Tetrahedral,
)
from vgtsim.description.scene import Scene
from vgtsim.description.tank import Tank

__all__ = [
    "DoubleOctahedral",
    "GeneralDoubleOctahedral",
    "Manipulator",
    "Octahedral",
    "Prism",
    "Scene",
    "Section",
    "Tank",
    "Tetrahedral",
    "load_manipulator",
    "load_scene",
    "load_tank",
]
