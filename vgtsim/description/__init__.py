"""The files that a user writes: arms, tanks, scenes, paths and catalogues as frozen, validated data."""

from vgtsim.constants import Method
from vgtsim.description.catalogue import INCH, Catalogue, CylinderSize, TubeSize, load_catalogue, write_sized_arm
from vgtsim.description.changes import Steps, change_entries, locate
from vgtsim.description.cutting import CuttingTool, Patch
from vgtsim.description.faults import list_faults, tell_file
from vgtsim.description.files import (
    digest_scene,
    dump_scene,
    is_scene,
    load_manipulator,
    load_scene,
    load_study,
    load_tank,
    load_tool_path,
    parse_scene,
)
from vgtsim.description.judging import CameraName, Cut, Limits, Video
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mission import CutStep
from vgtsim.description.modules import (
    Actuated,
    DoubleOctahedral,
    GeneralDoubleOctahedral,
    Module,
    Octahedral,
    Prism,
    SectionModule,
    Tetrahedral,
    joint_offset,
)
from vgtsim.description.motion import Bend, Goal, StartPosture
from vgtsim.description.operator import (
    MOST_COMMANDS,
    TARGETS,
    Operator,
    OperatorCommand,
    digest_commands,
    load_commands,
    write_command,
)
from vgtsim.description.original import find_original
from vgtsim.description.phases import begins_anew, cut_arm, list_phases, pick_phase
from vgtsim.description.redundancy import OBJECTIVES, choose_coupling, split_objective
from vgtsim.description.scene import AllowedContact, Feed, LoadCase, Mast, Payload, Phase, Scene, SceneFile, Simulation
from vgtsim.description.schema import Description, closest
from vgtsim.description.sections import Block, Cylinder, Material, Tube
from vgtsim.description.shipped import MODELS, find_file, list_shipped
from vgtsim.description.study import Axis, RepeatedCapacity, RepeatedRun, RepeatedWorkspace, Span, Study, Work
from vgtsim.description.tank import Box, Clamp, Equipment, Guide, MeshThing, Riser, Shell, Tank, Thing
from vgtsim.description.tool_path import ArcPiece, LinePiece, RasterPiece, SplinePiece, ToolPath

__all__ = [
    "INCH",
    "MODELS",
    "MOST_COMMANDS",
    "OBJECTIVES",
    "TARGETS",
    "Actuated",
    "AllowedContact",
    "ArcPiece",
    "Axis",
    "Bend",
    "Block",
    "Box",
    "CameraName",
    "Catalogue",
    "Clamp",
    "Cut",
    "CutStep",
    "CuttingTool",
    "Cylinder",
    "CylinderSize",
    "Description",
    "DoubleOctahedral",
    "Equipment",
    "Feed",
    "GeneralDoubleOctahedral",
    "Goal",
    "Guide",
    "Limits",
    "LinePiece",
    "LoadCase",
    "Manipulator",
    "Mast",
    "Material",
    "MeshThing",
    "Method",
    "Module",
    "Octahedral",
    "Operator",
    "OperatorCommand",
    "Patch",
    "Payload",
    "Phase",
    "Prism",
    "RasterPiece",
    "RepeatedCapacity",
    "RepeatedRun",
    "RepeatedWorkspace",
    "Riser",
    "Scene",
    "SceneFile",
    "SectionModule",
    "Shell",
    "Simulation",
    "Span",
    "SplinePiece",
    "StartPosture",
    "Steps",
    "Study",
    "Tank",
    "Tetrahedral",
    "Thing",
    "ToolPath",
    "Tube",
    "TubeSize",
    "Video",
    "Work",
    "begins_anew",
    "change_entries",
    "choose_coupling",
    "closest",
    "cut_arm",
    "digest_commands",
    "digest_scene",
    "dump_scene",
    "find_file",
    "find_original",
    "is_scene",
    "joint_offset",
    "list_faults",
    "list_phases",
    "list_shipped",
    "load_catalogue",
    "load_commands",
    "load_manipulator",
    "load_scene",
    "load_study",
    "load_tank",
    "load_tool_path",
    "locate",
    "parse_scene",
    "pick_phase",
    "split_objective",
    "tell_file",
    "write_command",
    "write_sized_arm",
]
