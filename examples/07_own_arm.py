"""Describe an arm in TOML with units, check it, draw it, and export it as a solid and as a MuJoCo model."""

from pathlib import Path

import vgtsim
from vgtsim.mjcf import write_arm_files
from vgtsim.output.arm_drawing import draw_arm, make_solid, write_drawing, write_solid

PARTS = """
name = "mine"
title = "Two bends and a boom"
face_side = "0.8 m"
hub = { radius = "35 mm", material = "steel" }
tip_plate = { thickness = "12 mm", material = "steel", tool_offset = "0.3 m" }
stowed = { cylinder_length = "0.8 m" }
[materials.steel]
density = "7850 kg/m**3"
youngs_modulus = "200 GPa"
yield_strength = "315 MPa"
[tubes.t50]
outer_diameter = "2 in"
wall = "0.125 in"
material = "steel"
[cylinders.c100]
bore = "4 in"
rod = "2 in"
barrel_wall = "0.25 in"
head = "1.5 in"
eye = "2.5 in"
retracted = "0.79 m"
stroke = "0.58 m"
pressure = "3000 psi"
rate = "0.05 m/s"
material = "steel"
"""
BEND = """
[[modules]]
kind = "double_octahedral"
name = "{name}"
longeron = "0.8 m"
longeron_tube = "t50"
batten_tube = "t50"
cylinder = "c100"
straight = "1.0 m"
"""
BOOM = '[[modules]]\nkind = "prism"\nname = "boom"\nlength = "1.5 m"\n' + "".join(
    f'{part}_tube = "t50"\n' for part in ("longeron", "cross_longeron", "batten")
)
(folder := Path("out/07")).mkdir(parents=True, exist_ok=True)
(folder / "mine.toml").write_text(PARTS + BEND.format(name="lower") + BOOM + BEND.format(name="upper"))

arm = vgtsim.load_arm(folder / "mine.toml")
print(f"straight arm: {-vgtsim.forward_kinematics(arm).tool[2]:.4f} m long, expected {1.0 + 1.5 + 1.0 + 0.3:.4f} m")
q = arm.straight + [0.2, 0, 0, 0.2, 0, 0]  # (u_x, u_y, d) of each bend: tilt its mid-plane
files = write_drawing(draw_arm(arm, {"straight": arm.straight, "bent": q}), folder / "mine")
files += write_solid(make_solid(arm, arm.nodes(q)), folder / "mine") + write_arm_files(arm.manipulator, folder)
print(*files, sep="\n")
