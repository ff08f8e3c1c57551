"""Geometry of the tank: its profile, and how far the arm is from it and from itself."""

from vgtsim.geometry.clearance import Clearance, Obstacles, arm_clearance, obstacles, self_clearance
from vgtsim.geometry.distance import enclosure_distance, interior_distance, segment_distance
from vgtsim.geometry.mast import MastPipe, make_mast
from vgtsim.geometry.profile import Profile, make_profile

__all__ = [
    "Clearance",
    "MastPipe",
    "Obstacles",
    "Profile",
    "arm_clearance",
    "enclosure_distance",
    "interior_distance",
    "make_mast",
    "make_profile",
    "obstacles",
    "segment_distance",
    "self_clearance",
]
