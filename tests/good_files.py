"""Good files of every kind, which are spoilt to see what the program makes of them: a small arm, and all that names it."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHORT = "short"  # the first two modules of arm9 that bend: a third of its cost, and each kind of member
ARMS = (SHORT, "tetra4", "stewart", "octahedron_double", "octahedron_general", "octahedron_offset")
_KEPT = 4  # modules of arm9, two that bend and two between them
GOAL = """[[motion.goals]]
name = "aside"
position = { value = ["-4.151 m", "0.6919 m", "2.4809 m"], label = "assumed", note = "0.14 m from the start" }
direction = { value = [-0.8537, 0.1336, -0.5065], label = "assumed", note = "outward from the mast, downward" }

"""
DRIVEN = """
base = "scene.toml"
name = "driven"

[operator]
record = "record.jsonl"

[simulation]
log_rate = "200 Hz"
timestep = "5 ms"

[motion]
goals = []
"""
NEAR = """
base = "scene.toml"
name = "near"

[motion]
objective = ["length_variation"]
hold = "2 s"
acceleration = "0.1 m/s**2"

[[motion.goals]]
name = "near"
position = [-4.2282, 0.7443, 2.5772]
direction = [-0.8611, 0.1514, -0.4855]

[simulation]
log_rate = "100 Hz"
"""
RECORD = """{"time":0.05,"twist":[0.05,0.0,0.02,0.0,0.0,0.1]}
{"time":0.2,"goal":[-4.227,0.75,2.58,-0.862,0.152,-0.484],"method":"newton"}
{"time":0.4,"inputs":[-0.263,-0.046,0.495,-0.255,-0.045,0.495],"objective":["mid_stroke"]}
{"time":0.5,"hold":true}
{"time":0.6,"hold":true}
"""
STUDY = """
name = "several"
scene = "scene.toml"
work = { verb = "VERB" }
keep = []

[grid]
scene.payload.mass = { least = "500 lb", greatest = "2000 lb", count = 2 }
arm.materials.steel.yield_strength = ["250 MPa"]
"""
PATH = """
name = "line"
start = ["-4.217 m", "0.74 m", "2.56 m"]
direction = [-0.861, 0.152, -0.485]
tolerance = "0.1 mm"
rate_fraction = 0.8
acceleration = "0.05 m/s**2"
speed = "0.25 m/s"

[[pieces]]
shape = "line"
to = ["-4.197 m", "0.73 m", "2.54 m"]

[[pieces]]
shape = "raster"
width = [0.0, "0.02 m", 0.0]
depth = ["-0.01 m", 0.0, 0.0]
rows = 2
"""


def write_files(folder: Path, arm: str) -> None:
    """Write good files of every kind: a scene, one that an operator drives, one that goes 5 mm, and all that they name."""
    for name, text in _read_files(arm).items():
        (folder / name).write_text(text)


@lru_cache(maxsize=len(ARMS) + 1)
def _read_files(arm: str) -> dict[str, str]:
    """Texts of the good files, by name."""
    scene = (ROOT / "scenes/arm9_nullspace.toml").read_text()
    scene = scene.replace("../models/arm9/arm9.toml", "arm.toml").replace("tanks/type_ii.toml", "tank.toml")
    *_, last = re.findall(r"\[\[motion\.start\]\].*?(?=\[\[motion)", scene, flags=re.DOTALL)
    scene = scene.replace(last, "").replace(
        'angle = { value = "35 deg"', 'angle = { value = "31 deg"'
    )  # far from any stroke's end
    scene = re.sub(r"\[\[motion\.goals\]\].*(?=\[limits\])", GOAL, scene, flags=re.DOTALL)
    scene = scene.replace("speed = 4.0", "speed = 1.0\nwidth = 160\nheight = 120\nfps = 5")
    return {
        "scene.toml": scene.replace('hold = { value = "2 s"', 'hold = { value = "1 s"'),
        "driven.toml": DRIVEN,
        "near.toml": NEAR,
        "record.jsonl": RECORD,
        "arm.toml": _read_arm(arm),
        "tank.toml": (ROOT / "scenes/tanks/type_ii.toml").read_text(),
        "path.toml": PATH,
        "catalogue.toml": (ROOT / "vgtsim/description/catalogue.toml").read_text(),
        "study.toml": STUDY.replace("VERB", "ik"),
    }


def _read_arm(arm: str) -> str:
    """Text of a shipped arm, or of the small one."""
    if arm != SHORT:
        return (ROOT / f"models/{arm}/{arm}.toml").read_text()
    return "[[modules]]".join((ROOT / "models/arm9/arm9.toml").read_text().split("[[modules]]")[: _KEPT + 1])
