"""What a program loads before it works: names of modules, since times depend on the machine."""

from __future__ import annotations

import subprocess
import sys

import pytest
import scipy
from packaging.version import Version

import vgtsim

SCIPY = {f"scipy.{part}" for part in ("interpolate", "optimize", "signal", "spatial")}
if Version(scipy.__version__) >= Version("1.17"):  # before that, `scipy.linalg` loads it by itself
    SCIPY.add("scipy.sparse")
DRAWING = {"PIL", "imageio_ffmpeg", "matplotlib", "meshio", "trimesh"}
HEAVY = {"distributed", "mujoco", "numba", "numpy", "pint", "polars", "pyarrow", "pydantic", "scipy"} | SCIPY | DRAWING
HELP = "import sys; sys.argv[1:] = {}\ntry:\n    from vgtsim.cli import main; main()\nexcept SystemExit: pass"


def find_loaded(code: str) -> set[str]:
    """The heavy modules that a process of its own has loaded after some code."""
    end = f"import os, sys; print('\\n', *(name for name in {sorted(HEAVY)} if name in sys.modules), flush=True); os._exit(0)"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{end}"], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_heavy_modules_are_seen():
    assert find_loaded("import numpy, scipy.signal") >= {"numpy", "scipy", "scipy.signal"}


def test_help_loads_nothing_heavy():
    assert find_loaded(HELP.format(["--help"])) == set()


@pytest.mark.parametrize("words", [["run", "--help"], ["--version"]])
def test_a_verb_loads_what_reads_its_options_alone(words):
    assert find_loaded(HELP.format(words)) <= {"pydantic"}  # Typer reads options with it


def test_the_package_and_its_names_load_nothing_heavy():
    assert find_loaded("import vgtsim, vgtsim.cli; dir(vgtsim)") == set()


def test_a_folder_for_results_is_made_without_a_plot():
    assert not find_loaded("from vgtsim.output import prepare_folder, write_outputs") & (DRAWING | {"mujoco", "numpy"})


@pytest.mark.parametrize("room", ["planning", "verification"])
def test_what_has_no_model_and_draws_nothing_loads_neither(room):
    assert not find_loaded(f"import vgtsim.{room}") & (SCIPY | DRAWING | {"mujoco", "pint"})


def test_the_model_of_an_arm_needs_no_mesh_and_no_plot():
    assert not find_loaded("import vgtsim.mjcf, vgtsim.plant") & (SCIPY | DRAWING)


def test_the_package_runs_as_a_module():
    done = subprocess.run([sys.executable, "-m", "vgtsim", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == vgtsim.__version__


@pytest.mark.parametrize("more", ["", "; import ompl.base"])
def test_the_end_looks_for_no_garbage_and_is_silent(more):
    tell = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 0))"  # what is registered last runs first
    code = f"{tell}; from vgtsim.ending import end_at_once; end_at_once(){more}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout.split(), done.stderr) == ([str(not more)], "")
