"""Geometry of the tank: its profile, and how far the arm is from it and from itself."""

from vgtsim.geometry.bed import Bed, Diggings, make_bed, make_diggings
from vgtsim.geometry.clearance import (
    RISER,
    SHELL,
    WASTE,
    Clearance,
    Obstacles,
    arm_clearance,
    enclosure_distance,
    make_walls,
    nearest_pair,
    obstacles,
    segment_distance,
    wall_clearance,
)
from vgtsim.geometry.gaps import PILLAR, Walls, find_between
from vgtsim.geometry.mast import MastPipe, make_mast
from vgtsim.geometry.near import ArmInTank, NearRows, carry, find_near, flag_clear
from vgtsim.geometry.pairs import MemberPairs, pair_members
from vgtsim.geometry.panels import DEPTH, Panel, Wedge, enclose_tank
from vgtsim.geometry.places import place_goals, tool_frame
from vgtsim.geometry.profile import Profile, make_profile, ring_radii
from vgtsim.geometry.segments import copy_matrix, copy_row
from vgtsim.geometry.stretches import Stretch, find_nearest, make_stretches
from vgtsim.geometry.things import cylinder_axis, find_footprint, find_hulls, find_span

__all__ = [
    "DEPTH",
    "PILLAR",
    "RISER",
    "SHELL",
    "WASTE",
    "ArmInTank",
    "Bed",
    "Clearance",
    "Diggings",
    "MastPipe",
    "MemberPairs",
    "NearRows",
    "Obstacles",
    "Panel",
    "Profile",
    "Stretch",
    "Walls",
    "Wedge",
    "arm_clearance",
    "carry",
    "copy_matrix",
    "copy_row",
    "cylinder_axis",
    "enclose_tank",
    "enclosure_distance",
    "find_between",
    "find_footprint",
    "find_hulls",
    "find_near",
    "find_nearest",
    "find_span",
    "flag_clear",
    "make_bed",
    "make_diggings",
    "make_mast",
    "make_profile",
    "make_stretches",
    "make_walls",
    "nearest_pair",
    "obstacles",
    "pair_members",
    "place_goals",
    "ring_radii",
    "segment_distance",
    "tool_frame",
    "wall_clearance",
]
