"""Compiled functions: each compiled once, code on disk that cannot be stale, and an installation that is read-only."""

from __future__ import annotations

import importlib
import inspect
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from vgtsim.compilation import find_folders
from vgtsim.constants import GRAVITY
from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.mode_following import follow_squares
from vgtsim.positioning import Differences, MidStroke, Problem, StrokeBarrier, make_box, solve, tool_goal
from vgtsim.statics import make_load_model, tool_forces
from vgtsim.statics.loads import member_loads

ROOT = Path(__file__).parents[1]
FILES = [path for path in sorted((ROOT / "vgtsim").rglob("*.py")) if "@compiled\n" in path.read_text()]
LEAVE = "import os; os._exit(0)"  # without a look for garbage in all that numba has loaded


def load(path: Path):
    return importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


def test_kept_code_answers_for_all_folders_that_it_uses():
    course = load(ROOT / "vgtsim/positioning/course.py")
    rooms = {path.relative_to(ROOT / "vgtsim").as_posix() for path in find_folders(course.pursue)}
    assert rooms == {"geometry", "positioning", "kinematics", "kinematics/modules"}
    for path in FILES:  # and nothing that is not compiled, which would be copied into the code unseen
        for item in vars(load(path)).values():
            if isinstance(item, Dispatcher) and item.__module__ == load(path).__name__:
                used = [vars(load(path)).get(name) for name in item.py_func.__code__.co_names]
                assert not any(inspect.isfunction(other) for other in used), item


def test_each_function_is_compiled_once():
    said = tell_double()
    if said != "[]":  # code was not kept yet: inner functions were compiled too, as other compiled ones call them
        said = tell_double()
    assert said == "[]"


def tell_double() -> str:
    """What is compiled twice in a process of its own: other tests call inner functions as no package code does."""
    call = f"from test_compilation import call_all, list_double; call_all(); print(list_double(), flush=True); {LEAVE}"
    paths = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    run = subprocess.run(
        [sys.executable, "-c", call],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    return run.stdout.strip() or run.stderr


def call_all():
    """Call what is compiled with all that callers may bring: strided, lists, by columns, read-only, more dimensions."""
    for name in ("arm15", "mixed"):
        chain = Chain(load_manipulator(ROOT / f"models/{name}/{name}.toml"), hanging_mount(9.0))
        q = np.tile(chain.straight, (4, 2))
        rows = q[::2, : chain.layout.inputs]  # strided
        fixed = np.array(chain.straight)
        fixed.flags.writeable = False
        for x in (rows, rows.tolist(), np.asfortranarray(rows), fixed, chain.straight[None, None]):
            chain.nodes(x)
            chain.tool_jacobian(x)
            chain.node_jacobian(x)
            chain.length_jacobian(x)
        box = make_box(chain, 0.005)
        for goals in (1, 3):
            position, direction = chain.tool(np.tile(chain.straight, (goals, 1)))
            objective = Differences("first", lambda x: x[:, 0] ** 2)
            for wanted in (StrokeBarrier(), MidStroke(), objective):
                solve(Problem(box, tool_goal(position - 0.01, direction), wanted), box.middle)
            solve(Problem(box, tool_goal(position - 0.01, direction)), np.tile(box.middle[:, None], goals).T)
        model = make_load_model(chain, Payload(mass=1.0, radius=0.1), GRAVITY)
        for wrench in (np.ones(6), np.ones((6, len(rows))).T):
            tool_forces(model, chain.nodes(rows), wrench)
        member_loads(model, chain.nodes(rows))
    for start in (np.ones((2, 3)), np.ones((3, 2)).T):
        follow_squares(np.ones((5, 3, 2)), np.zeros((3, 2)), start)


def list_double():
    """Names of compiled functions that Python calls and that are compiled more than once."""
    return [
        item.__name__
        for path in FILES
        for item in vars(load(path)).values()
        if isinstance(item, Dispatcher) and not item.__name__.startswith("_") and len(item.signatures) > 1
    ]


@pytest.mark.long
def test_code_is_made_anew_when_a_file_beside_it_changes(tmp_path):
    """Both texts have one size, and a quick machine writes them in one second: Python's own bytecode would be the old one."""
    (tmp_path / "parts.py").write_text("def compiled_part(x):\n    return x\n")
    (tmp_path / "whole.py").write_text(
        "from vgtsim.compilation import compiled\nimport parts\npart = compiled(parts.compiled_part)\n"
        "@compiled\ndef add(a):\n    return part(a) + 1.0\n"
    )
    for factor, answer in ((1, "3.0"), (2, "5.0")):
        (tmp_path / "parts.py").write_text(f"def compiled_part(x):\n    return x * {factor}\n")
        command = [sys.executable, "-c", f"from whole import add; print(add(2.0), flush=True); {LEAVE}"]
        environment = os.environ | {"PYTHONPATH": f"{tmp_path}:{ROOT}", "PYTHONDONTWRITEBYTECODE": "1"}
        said = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert said.stdout.strip() == answer, said.stderr


@pytest.mark.long
def test_a_read_only_installation_keeps_its_code_with_the_user(tmp_path):
    package = tmp_path / "site" / "vgtsim"
    package.mkdir(parents=True)
    for name in ("compilation.py", "arrays.py"):
        shutil.copy(ROOT / "vgtsim" / name, package)
    (package / "__init__.py").touch()
    (package / "sums.py").write_text(
        "from vgtsim.compilation import compiled\n@compiled\ndef add(a, b):\n    return a + b\n"
    )
    (package / "__pycache__").touch()  # not a folder: nothing can be kept there, whoever runs the test
    code = f"from vgtsim.sums import add; print(add(1.0, 2.0), flush=True); {LEAVE}"
    environment = os.environ | {
        "PYTHONPATH": str(package.parent),
        "HOME": str(tmp_path),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    environment.pop("XDG_CACHE_HOME", None)
    for _ in range(2):
        command = [sys.executable, "-c", code]
        said = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert said.stdout == "3.0\n", said.stderr
    assert not list(package.rglob("*.nbc"))
    assert list((tmp_path / ".cache").rglob("*.nbc"))
