"""What a user writes: arms, tanks and scenes as frozen, validated data."""

from vgtsim.description.files import load_manipulator, load_scene, load_tank
from vgtsim.description.manipulator import DoubleOctahedral, Manipulator, Prism
from vgtsim.description.scene import Scene
from vgtsim.description.tank import Tank

__all__ = [
    "DoubleOctahedral",
    "Manipulator",
    "Prism",
    "Scene",
    "Tank",
    "load_manipulator",
    "load_scene",
    "load_tank",
]
