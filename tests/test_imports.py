"""Arrows between rooms point down."""

from __future__ import annotations

import ast
import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from vgtsim.errors import MissingLibraryError

ROOT = Path(__file__).parents[1]
ROOMS = (
    ("arrays", "errors"),
    ("commands", "compilation", "constants", "digests", "ending", "graphics", "replacing", "units"),
    ("description",),
    ("log", "geometry"),
    ("kinematics",),
    ("statics",),
    ("positioning",),
    ("site",),
    ("proximity", "touches"),
    ("planning", "mjcf", "verification"),
    ("control",),
    ("plant", "output", "batch"),
    ("posture", "study", "envs", "web"),
    ("cli",),
)
LEVEL = {room: level for level, rooms in enumerate(ROOMS) for room in rooms}
NO_MUJOCO = set(LEVEL) - {"graphics", "mjcf", "plant", "output", "batch", "envs", "cli"}
FILES = sorted((ROOT / "vgtsim").rglob("*.py"))


def imported_modules(tree: ast.Module) -> set[str]:
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"line {node.lineno}: an import that does not name its room"
            found.add(node.module or "")
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_point_down(path):
    parts = path.relative_to(ROOT / "vgtsim").with_suffix("").parts
    room = parts[0]
    if room in ("__init__", "__main__"):  # the faces of the package
        return
    modules = imported_modules(ast.parse(path.read_text()))
    ours = {name.split(".")[1] for name in modules if name.startswith("vgtsim.")} & set(LEVEL)
    for other in ours - {room}:
        assert LEVEL[other] < LEVEL[room], f"{room} imports {other}"
    assert not any(name.split(".")[0] == "studies" for name in modules)
    faces = {name for name in modules if name.startswith("vgtsim.") and name.split(".")[1] not in LEVEL}
    assert faces <= {"vgtsim.__version__"}, "the names of the package's face are of any room"
    if room in NO_MUJOCO:
        assert not any(name.split(".")[0] == "mujoco" or name == "vgtsim.graphics" for name in modules)


PROGRAMS = [
    path for path in (ROOT / "scripts").iterdir() if path.is_file() and b"python" in path.read_bytes().split(b"\n")[0]
]


@pytest.mark.parametrize("path", sorted(PROGRAMS), ids=lambda path: path.name)
def test_names_that_programs_take_from_the_package_are_there(path):
    """Programs have no ending, so the check of types does not read them."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "vgtsim":
            try:
                module = importlib.import_module(str(node.module))
            except MissingLibraryError as error:
                pytest.skip(str(error))
            for alias in node.names:
                if not hasattr(module, alias.name):  # or a module of the room
                    importlib.import_module(f"{node.module}.{alias.name}")


def test_every_room_has_its_place():
    rooms = {path.relative_to(ROOT / "vgtsim").with_suffix("").parts[0] for path in FILES} - {"__init__", "__main__"}
    assert rooms == set(LEVEL)


HEAVY = ("matplotlib", "mujoco", "numba", "scipy", "trimesh", "viser")
SAY = "import os; from sys import modules; print(os.environ == before, [n for n in HEAVY if n in modules])"


def report_import(statement: str, **environment: str) -> str:
    """Outcome of an import in a process of its own: whether the environment is as before, and the heavy modules loaded."""
    code = (
        f"import os; HEAVY = {HEAVY}; before = dict(os.environ); {statement}; {SAY}; "
        "print(os.environ.get('MUJOCO_GL'), flush=True); os._exit(0)"
    )
    kept = {key: value for key, value in os.environ.items() if key != "MUJOCO_GL"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=kept | environment, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_the_package_alone_changes_and_loads_nothing():
    assert report_import("import vgtsim; dir(vgtsim)") == "True []\nNone\n"


@pytest.mark.long
@pytest.mark.parametrize("module", ["mjcf.names", "plant.plant", "output.video", "output.replay"])
def test_graphics_are_chosen_before_mujoco_is_imported(module):
    same, choice = report_import(f"import vgtsim.{module}").splitlines()
    assert same.startswith("False")
    assert "mujoco" in same
    assert choice in ("egl", "disable")


def test_the_choice_of_the_user_stays():
    assert report_import("import vgtsim.mjcf", MUJOCO_GL="disable").endswith("disable\n")
