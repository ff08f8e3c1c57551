"""Descriptions to MuJoCo models."""

import vgtsim.graphics  # noqa: F401  before MuJoCo
from vgtsim.mjcf.build import build_arm_spec, build_model, build_spec, scene_chain
from vgtsim.mjcf.rows import load_model, select_drive, stiffen

__all__ = [
    "build_arm_spec",
    "build_model",
    "build_spec",
    "load_model",
    "scene_chain",
    "select_drive",
    "stiffen",
]
