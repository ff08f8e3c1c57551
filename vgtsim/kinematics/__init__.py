"""Pure kinematics: modules, the chain they make, its truss and its inertia."""

from vgtsim.kinematics.bending import azimuth, bend_all, bend_start, can_swing, straight_yaws, swing
from vgtsim.kinematics.chain import Chain, hanging_mount
from vgtsim.kinematics.modules import KINDS, Kind, ModuleSet, ModuleState, kind_of
from vgtsim.kinematics.passage import Axis, find_axis, measure_passage, trace_line
from vgtsim.kinematics.rigid_sections import RigidSections, find_rigid_sections
from vgtsim.kinematics.sampling import sample_inputs, singular_values, within_strokes
from vgtsim.kinematics.state import State
from vgtsim.kinematics.stroke_boxes import check_strokes
from vgtsim.kinematics.subspace import Subspace
from vgtsim.kinematics.truss import Member, Truss, make_truss

__all__ = [
    "KINDS",
    "Axis",
    "Chain",
    "Kind",
    "Member",
    "ModuleSet",
    "ModuleState",
    "RigidSections",
    "State",
    "Subspace",
    "Truss",
    "azimuth",
    "bend_all",
    "bend_start",
    "can_swing",
    "check_strokes",
    "find_axis",
    "find_rigid_sections",
    "hanging_mount",
    "kind_of",
    "make_truss",
    "measure_passage",
    "sample_inputs",
    "singular_values",
    "straight_yaws",
    "swing",
    "trace_line",
    "within_strokes",
]
