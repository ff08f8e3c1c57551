"""Pure kinematics: modules, the chain they make, its truss and its inertia."""

from vgtsim.kinematics.bending import (
    azimuth,
    bend_all,
    bend_start,
    can_swing,
    find_mast_turn,
    move_points,
    swing,
)
from vgtsim.kinematics.chain import Chain, hanging_mount
from vgtsim.kinematics.composition import compose, curve, pull
from vgtsim.kinematics.conditioning import POOR, SINGULAR, find_sine, invert_in_place, warn_poor
from vgtsim.kinematics.inertia import (
    MemberInertia,
    PlateInertia,
    make_block_inertia,
    make_hub_masses,
    make_line_masses,
    make_member_inertia,
    make_plate_inertia,
    member_radii,
)
from vgtsim.kinematics.modules import Chord, kind_of
from vgtsim.kinematics.modules.double_octahedral import fill_mid_planes
from vgtsim.kinematics.modules.stroke_boxes import check_strokes
from vgtsim.kinematics.passage import find_axis, measure_passage, trace_line
from vgtsim.kinematics.planar_arm import PlanarArm, axis_of
from vgtsim.kinematics.rigid_sections import find_rigid_sections
from vgtsim.kinematics.roll_pitch_yaw import rotate_upright, rotation
from vgtsim.kinematics.state import State
from vgtsim.kinematics.subspace import Subspace
from vgtsim.kinematics.ties import first_greatest, first_least, order_down
from vgtsim.kinematics.truss import Member, Truss
from vgtsim.kinematics.vectors import cross, cross_into, find_across, quaternions_to
from vgtsim.kinematics.workspace import NEAR_SINGULAR, Workspace, sample_inputs, sample_workspace, within_strokes

__all__ = [
    "NEAR_SINGULAR",
    "POOR",
    "SINGULAR",
    "Chain",
    "Chord",
    "Member",
    "MemberInertia",
    "PlanarArm",
    "PlateInertia",
    "State",
    "Subspace",
    "Truss",
    "Workspace",
    "axis_of",
    "azimuth",
    "bend_all",
    "bend_start",
    "can_swing",
    "check_strokes",
    "compose",
    "cross",
    "cross_into",
    "curve",
    "fill_mid_planes",
    "find_across",
    "find_axis",
    "find_mast_turn",
    "find_rigid_sections",
    "find_sine",
    "first_greatest",
    "first_least",
    "hanging_mount",
    "invert_in_place",
    "kind_of",
    "make_block_inertia",
    "make_hub_masses",
    "make_line_masses",
    "make_member_inertia",
    "make_plate_inertia",
    "measure_passage",
    "member_radii",
    "move_points",
    "order_down",
    "pull",
    "quaternions_to",
    "rotate_upright",
    "rotation",
    "sample_inputs",
    "sample_workspace",
    "swing",
    "trace_line",
    "warn_poor",
    "within_strokes",
]
