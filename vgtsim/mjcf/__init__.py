"""Descriptions to MuJoCo models."""

import vgtsim.graphics  # noqa: F401  before MuJoCo
from vgtsim.mjcf.build import build_arm_spec, build_model, build_spec, finish_model
from vgtsim.mjcf.files import measure_gap, write_arm_files, write_scene_files
from vgtsim.mjcf.keyframes import reach_pose, withdrawn_poses
from vgtsim.mjcf.pose import PoseMap, fill_qpos, make_mast_pose, make_pose_map, qpos_from_nodes
from vgtsim.mjcf.rows import load_model, retime, select_drive, stiffen
from vgtsim.mjcf.sections import SectionPose, make_section_pose
from vgtsim.mjcf.tank import lower_waste, show_pit, show_things

__all__ = [
    "PoseMap",
    "SectionPose",
    "build_arm_spec",
    "build_model",
    "build_spec",
    "fill_qpos",
    "finish_model",
    "load_model",
    "lower_waste",
    "make_mast_pose",
    "make_pose_map",
    "make_section_pose",
    "measure_gap",
    "qpos_from_nodes",
    "reach_pose",
    "retime",
    "select_drive",
    "show_pit",
    "show_things",
    "stiffen",
    "withdrawn_poses",
    "write_arm_files",
    "write_scene_files",
]
