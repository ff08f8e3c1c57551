"""Listing, drawing, exporting and sampling the shipped arms."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.workspace import sample_workspace
from vgtsim.mjcf import reach_pose
from vgtsim.output.arm_drawing import make_solid

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1] / "models"
SINGLE = 1e-5  # m: STL holds single precision
NAMES = [path.stem for path in sorted(ROOT.glob("*/*.toml"))]


def test_models_lists_every_arm():
    result = CliRunner().invoke(app, ["models"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    for name in NAMES:
        assert name in result.output


def test_models_of_a_folder_without_arms_says_what_it_needs(tmp_path):
    other = str(CliRunner().invoke(app, ["models", str(tmp_path)]).exception)
    assert other.endswith("found no arms; allowed: a folder with NAME/NAME.toml files")


def test_sourcing_the_environment_without_python_leaves_the_shell_alive():
    """And ends a script that runs with `set -e`; demo and test ask for its status."""
    script = ROOT.parent / "scripts/environment"
    bash, paths = shutil.which("bash"), {"PATH": "/nowhere"}
    assert bash is not None
    source = f'dirname() {{ echo {script.parent}; }}; source "{script}"'
    alive = subprocess.run(
        [bash, "-c", f"{source}; echo status $?"], env=paths, capture_output=True, text=True, check=False
    )
    assert alive.stdout == "status 2\n"
    assert "Python 3.11 or newer is needed" in alive.stderr
    strict = subprocess.run(
        [bash, "-c", f"set -e; {source}; echo on"], env=paths, capture_output=True, text=True, check=False
    )
    assert (strict.returncode, strict.stdout) == (2, "")


@pytest.mark.parametrize("name", ["mixed", "stewart"])
def test_show_writes_drawings_and_solids(name, tmp_path):
    result = CliRunner().invoke(app, ["show", str(ROOT / name / f"{name}.toml"), "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    assert "<svg" in (tmp_path / f"{name}.svg").read_text()
    chain = Chain(load_manipulator(ROOT / name / f"{name}.toml"), hanging_mount(0.0))
    solid = trimesh.load_scene(tmp_path / f"{name}.glb")
    assert set(chain.truss.member_names) <= set(solid.geometry)
    mesh = trimesh.load_mesh(tmp_path / f"{name}.stl")
    expected = make_solid(chain, chain.nodes(reach_pose(chain))).bounds
    assert np.allclose(mesh.bounds, expected, atol=SINGLE)


def test_workspace_is_drawn_and_repeats(tmp_path):
    arguments = ["workspace", str(ROOT / "stewart/stewart.toml"), "--out", str(tmp_path), "--samples", "200"]
    first, second = (CliRunner().invoke(app, arguments) for _ in range(2))
    assert first.exit_code == 0, first.output
    assert first.output == second.output
    assert "reach" in first.output
    assert (tmp_path / "workspace.png").exists()


def test_workspace_figures_of_an_extensible_gimbal():
    """A double octahedron alone: T's origin and Z axis follow from the mid-plane in closed form."""
    chain = Chain(load_manipulator(ROOT / "octahedron_double/octahedron_double.toml"), hanging_mount(0.0))
    found = sample_workspace(chain, 400, seed=5)
    offset = chain.manipulator.tip_plate.tool_offset
    face = found.tool - offset * found.direction
    normal = face / np.linalg.norm(face, axis=-1, keepdims=True)
    assert np.allclose(np.cos(found.tilt), 2 * normal[:, 2] ** 2 - 1, atol=1e-9)
    assert found.mobility == 3
    assert found.reach < 2 * chain.layout.places[0].modules.geometry.height[0] + offset
    assert 0 < found.volume < (2 * found.reach) ** 3
    assert np.all((found.dexterity > 0) & (found.dexterity <= 1))


def test_more_samples_never_shrink_what_is_reached():
    chain = Chain(load_manipulator(ROOT / "stewart/stewart.toml"), hanging_mount(0.0))
    few, many = (sample_workspace(chain, count, seed=1) for count in (300, 3000))
    assert many.reach > 0.98 * few.reach
    assert many.volume > few.volume


@pytest.mark.parametrize("name", ["demo", "test"])
def test_scripts_end_where_the_environment_cannot_be_made(name):
    bash = shutil.which("bash")
    assert bash is not None
    text = f"cd() {{ builtin cd {ROOT.parent}; }}; dirname() {{ echo {ROOT.parent / 'scripts'}; }}; "
    text += f'source "{ROOT.parent}/scripts/{name}"'
    done = subprocess.run([bash, "-c", text], env={"PATH": "/nowhere"}, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "Python 3.11 or newer is needed" in done.stderr
