"""Every shipped arm: its files are there, its model compiles and steps, its figures and drawings can be made."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.workspace import sample_workspace
from vgtsim.mjcf import load_model
from vgtsim.mjcf.build import build_arm_spec
from vgtsim.output.arm_drawing import make_solid
from vgtsim.statics.loads import weigh

ROOT = Path(__file__).parents[1] / "models"
NAMES = [path.stem for path in sorted(ROOT.glob("*/*.toml"))]
BUILT = [name for name in NAMES if (ROOT / name / f"{name}.xml").exists()]
XML_DIGITS = 1e-4  # m: six digits of coordinates of some ten metres, in three directions
WEIGHT = 1e-4  # relative: six digits of each body's mass in XML


@pytest.mark.parametrize("name", sorted(set(NAMES) - {"arm15"}))
@pytest.mark.parametrize("suffix", ["xml", "png"])
def test_model_and_picture_are_shipped(name, suffix):
    assert (ROOT / name / f"{name}.{suffix}").stat().st_size > 1000
    assert f"# {name}" in (ROOT / name / "README.md").read_text()


@pytest.mark.parametrize("name", BUILT)
def test_shipped_xml_is_the_description_s(name):
    """Weight and node positions; and it steps under random commands to its servos without a warning."""
    arm = load_manipulator(ROOT / name / f"{name}.toml")
    model = load_model(ROOT / name / f"{name}.xml")
    pivot = float(model.body("mast").pos[2])
    chain = Chain(arm, hanging_mount(pivot))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("straight").id)
    mujoco.mj_kinematics(model, data)
    sites = np.array([data.site(node).xpos for node in chain.truss.nodes])
    assert np.abs(sites - chain.nodes(chain.straight)).max() < XML_DIGITS
    mast = [i for i in range(model.nbody) if model.body(i).name == "mast"]
    assert model.body_mass.sum() - model.body_mass[mast].sum() == pytest.approx(weigh(chain), rel=WEIGHT)
    rng = np.random.default_rng(3)
    for _ in range(10):
        data.ctrl[1:] += rng.uniform(-1e-3, 1e-3, model.nu - 1)
        mujoco.mj_step(model, data, 3)
    assert not data.warning.number.any()
    assert np.isfinite(data.qpos).all()


def test_fresh_build_has_the_shipped_structure():
    spec = build_arm_spec(load_manipulator(ROOT / "mixed/mixed.toml"))
    fresh, shipped = spec.compile(), load_model(ROOT / "mixed/mixed.xml")
    assert (fresh.nv, fresh.nbody, fresh.neq, fresh.nkey) == (shipped.nv, shipped.nbody, shipped.neq, shipped.nkey)


def test_models_lists_every_arm():
    result = CliRunner().invoke(app, ["models"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    for name in NAMES:
        assert name in result.output


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
    assert np.allclose(mesh.extents, make_solid(chain, chain.nodes(chain.straight)).extents, rtol=0.5)


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
    assert found.reach < 2 * chain.geometries[0].height + offset
    assert 0 < found.volume < (2 * found.reach) ** 3
    assert np.all((found.dexterity > 0) & (found.dexterity <= 1))


def test_more_samples_never_shrink_what_is_reached():
    chain = Chain(load_manipulator(ROOT / "stewart/stewart.toml"), hanging_mount(0.0))
    few, many = (sample_workspace(chain, count, seed=1) for count in (300, 3000))
    assert many.reach > 0.98 * few.reach
    assert len(np.unique(np.floor(many.tool / few.cell), axis=0)) > len(np.unique(np.floor(few.tool / few.cell), axis=0))
