"""Descriptions to MuJoCo models."""

import vgtsim.graphics  # noqa: F401  before MuJoCo
from vgtsim.mjcf.build import build_arm_spec, build_model, build_spec, finish_model
from vgtsim.mjcf.rows import load_model, retime, select_drive, stiffen

__all__ = [
    "build_arm_spec",
    "build_model",
    "build_spec",
    "finish_model",
    "load_model",
    "retime",
    "select_drive",
    "stiffen",
]
