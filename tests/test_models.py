"""Shipped models and scenes: whole, up to date, and steady under random commands."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.mjcf import build_arm_spec, load_model
from vgtsim.statics import make_load_model, make_sections, rate, solve_members, utilise

ROOT = Path(__file__).parents[1]
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
USED = re.compile(
    r"seed 1, factor 1\.67 \| (\S+) by its own weight, (\S+) with 1000 lb.*\n\| .*oil.* \| (\S+) and (\S+) \|"
)
ROUNDED = 0.0051  # two decimals
SIX_DIGITS, NOISE = 1e-5, 1e-6  # of what MuJoCo writes; m, N and 1 about zero
MODELS = sorted(path.parent for path in ROOT.glob("models/*/*.toml"))


@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_a_model_folder_is_whole(folder):
    name = folder.name
    assert {f"{name}.toml", f"{name}.xml", f"{name}.png", "README.md"} <= {path.name for path in folder.iterdir()}


@pytest.mark.long
@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_the_xml_is_what_its_description_gives(folder):
    shipped = (folder / f"{folder.name}.xml").read_text().split("-->\n", 1)[1]
    spec = build_arm_spec(load_manipulator(folder / f"{folder.name}.toml"))
    spec.compile()
    words, numbers = split_numbers(shipped)
    expected_words, expected = split_numbers(spec.to_xml())
    assert words == expected_words
    assert np.allclose(numbers, expected, rtol=SIX_DIGITS, atol=NOISE)


@pytest.mark.long
@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_the_xml_loses_no_mass(folder):
    """What plain MuJoCo reads back weighs what the description gives."""
    read = mujoco.MjModel.from_xml_path(str(folder / f"{folder.name}.xml"))
    model = build_arm_spec(load_manipulator(folder / f"{folder.name}.toml")).compile()
    assert np.allclose(read.body_mass, model.body_mass, rtol=SIX_DIGITS)
    assert np.allclose(read.body_inertia, model.body_inertia, rtol=1e-4, atol=1e-9)
    assert np.allclose(read.body_ipos, model.body_ipos, atol=NOISE)


def split_numbers(xml: str) -> tuple[str, np.ndarray]:
    """Text with its numbers taken out, and the numbers: the last digits are another processor's to round."""
    return NUMBER.sub("#", xml), np.array([float(number) for number in NUMBER.findall(xml)])


@pytest.mark.long
@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_a_model_steps_under_random_commands_without_warning(folder):
    model = load_model(folder / f"{folder.name}.xml")
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("straight").id)
    rng, hold = np.random.default_rng(3), data.ctrl.copy()
    for _ in range(10):
        data.ctrl[:] = hold + rng.uniform(-1e-3, 1e-3, model.nu)
        for _ in range(20):
            mujoco.mj_step(model, data)
    assert not np.any(data.warning.number)
    assert np.isfinite(data.qpos).all()


@pytest.mark.parametrize(
    "folder", [f for f in MODELS if (f / f"{f.name}.mjb").exists()], ids=lambda folder: folder.name
)
def test_a_shipped_mjb_is_the_described_model(folder):
    """With all digits and the scaled weights, for the MuJoCo it was written with."""
    shipped = load_model(folder / f"{folder.name}.mjb")
    model = build_arm_spec(load_manipulator(folder / f"{folder.name}.toml")).compile()
    assert np.allclose(shipped.body_mass, model.body_mass, rtol=1e-12)
    assert np.allclose(shipped.body_pos, model.body_pos, rtol=0, atol=1e-12)
    assert np.allclose(shipped.geom_size, model.geom_size, rtol=0, atol=1e-12)
    assert np.allclose(shipped.dof_invweight0, 1e-5 * model.dof_invweight0, rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(
    "folder", [f for f in MODELS if USED.search((f / "README.md").read_text())], ids=lambda folder: folder.name
)
def test_use_that_a_readme_tells_is_found_again(folder):
    told = USED.search((folder / "README.md").read_text())
    assert told is not None
    chain = Chain(load_manipulator(folder / f"{folder.name}.toml"), hanging_mount(4.0))
    nodes, ends = chain.nodes(sample_inputs(chain, 500, seed=1)), chain.truss.ends
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    ratings = rate(make_sections(chain.manipulator, chain.truss), length, 1.67)
    payloads = (Payload(mass=mass, radius=0.15) for mass in (0.0, 453.59237))
    used = [utilise(ratings, solve_members(make_load_model(chain, payload, 9.80665), nodes)) for payload in payloads]
    found = [use.strength.max() for use in used] + [use.pressure.max() for use in used]
    assert [float(figure) for figure in told.groups()] == pytest.approx(found, abs=ROUNDED)
