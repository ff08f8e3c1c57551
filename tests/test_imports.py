"""Arrows between rooms point down."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = (
    ("errors",),
    ("constants", "replacing", "units"),
    ("description",),
    ("runlog", "geometry"),
    ("kinematics",),
    ("statics",),
    ("positioning",),
    ("site",),
    ("planning", "mjcf", "verification"),
    ("plant", "output"),
    ("cli",),
)
LEVEL = {room: level for level, rooms in enumerate(ROOMS) for room in rooms}
NO_MUJOCO = set(LEVEL) - {"mjcf", "plant", "output", "cli"}
FILES = sorted((ROOT / "vgtsim").rglob("*.py"))


def imported_modules(tree: ast.Module) -> set[str]:
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_point_down(path):
    parts = path.relative_to(ROOT / "vgtsim").with_suffix("").parts
    room = parts[0]
    if room == "__init__":
        return
    modules = imported_modules(ast.parse(path.read_text()))
    ours = {name.split(".")[1] for name in modules if name.startswith("vgtsim.")} & set(LEVEL)
    for other in ours - {room}:
        assert LEVEL[other] < LEVEL[room], f"{room} imports {other}"
    assert not any(name.split(".")[0] == "studies" for name in modules)
    if room in NO_MUJOCO:
        assert not any(name.split(".")[0] == "mujoco" for name in modules)


def test_every_room_has_its_place():
    rooms = {path.relative_to(ROOT / "vgtsim").with_suffix("").parts[0] for path in FILES} - {"__init__"}
    assert rooms == set(LEVEL)
