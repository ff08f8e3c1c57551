"""What a user writes: arms, tanks and scenes as frozen, validated data."""

from vgtsim.description.files import load_manipulator, load_scene, load_tank, load_tool_path
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import (
    DoubleOctahedral,
    GeneralDoubleOctahedral,
    Octahedral,
    Prism,
    SectionModule,
    Tetrahedral,
)
from vgtsim.description.scene import Scene
from vgtsim.description.tank import Tank
from vgtsim.description.tool_path import ToolPath

__all__ = [
    "DoubleOctahedral",
    "GeneralDoubleOctahedral",
    "Manipulator",
    "Octahedral",
    "Prism",
    "Scene",
    "SectionModule",
    "Tank",
    "Tetrahedral",
    "ToolPath",
    "load_manipulator",
    "load_scene",
    "load_tank",
    "load_tool_path",
]
