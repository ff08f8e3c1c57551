"""The files that a user writes: arms, tanks, scenes, paths and catalogues as frozen, validated data."""

from vgtsim.constants import Method
from vgtsim.description.catalogue import INCH, Catalogue, CylinderSize, TubeSize, load_catalogue, write_sized_arm
from vgtsim.description.changes import Steps, change_entries, locate
from vgtsim.description.conveyance import Conveyance
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
from vgtsim.description.judging import CameraName, Cut, Limits
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mast import Feed, Slew
from vgtsim.description.mission import (
    AddStep,
    CutStep,
    FollowStep,
    HoldStep,
    InsertStep,
    MissionStep,
    MoveStep,
    RasterStep,
    RunStage,
    WithdrawStep,
    begins_inside,
)
from vgtsim.description.modules import (
    DoubleOctahedral,
    GeneralDoubleOctahedral,
    Module,
    Octahedral,
    Prism,
    SectionModule,
    Tetrahedral,
)
from vgtsim.description.motion import OBJECTIVES, Bend, Goal, GoalPlace, StartPosture, choose_coupling, split_objective
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
from vgtsim.description.scene import AllowedContact, LoadCase, Payload, Scene, SceneFile, Simulation
from vgtsim.description.schema import Description, closest
from vgtsim.description.sections import Cylinder, Material, Tube
from vgtsim.description.shipped import MODELS, find_file, list_shipped
from vgtsim.description.study import Axis, RepeatedCapacity, RepeatedRun, RepeatedWorkspace, Span, Study
from vgtsim.description.tank import Box, Clamp, Equipment, MeshThing, Riser, Shell, Tank, Thing
from vgtsim.description.toml_file import read_text
from vgtsim.description.tool_path import ArcPiece, LinePiece, RasterPiece, SplinePiece, ToolPath
from vgtsim.description.waste import CuttingTool, Patch

__all__ = [
    "INCH",
    "MODELS",
    "MOST_COMMANDS",
    "OBJECTIVES",
    "TARGETS",
    "AddStep",
    "AllowedContact",
    "ArcPiece",
    "Axis",
    "Bend",
    "Box",
    "CameraName",
    "Catalogue",
    "Clamp",
    "Conveyance",
    "Cut",
    "CutStep",
    "CuttingTool",
    "Cylinder",
    "CylinderSize",
    "Description",
    "DoubleOctahedral",
    "Equipment",
    "Feed",
    "FollowStep",
    "GeneralDoubleOctahedral",
    "Goal",
    "GoalPlace",
    "HoldStep",
    "InsertStep",
    "Limits",
    "LinePiece",
    "LoadCase",
    "Manipulator",
    "Material",
    "MeshThing",
    "Method",
    "MissionStep",
    "Module",
    "MoveStep",
    "Octahedral",
    "Operator",
    "OperatorCommand",
    "Patch",
    "Payload",
    "Prism",
    "RasterPiece",
    "RasterStep",
    "RepeatedCapacity",
    "RepeatedRun",
    "RepeatedWorkspace",
    "Riser",
    "RunStage",
    "Scene",
    "SceneFile",
    "SectionModule",
    "Shell",
    "Simulation",
    "Slew",
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
    "WithdrawStep",
    "begins_anew",
    "begins_inside",
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
    "read_text",
    "split_objective",
    "tell_file",
    "write_command",
    "write_sized_arm",
]
