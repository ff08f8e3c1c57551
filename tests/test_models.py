"""Shipped models and scenes: whole, up to date, and steady under random commands."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.mjcf import build_arm_spec, load_model, measure_gap
from vgtsim.mjcf.files import make_stage
from vgtsim.statics import make_load_model, make_sections, rate, solve_members, utilise

ROOT = Path(__file__).parents[1]
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
USED = re.compile(
    r"seed 1, factor 1\.67 \| (\S+) by its own weight, (\S+) with 1000 lb.*\n\| .*oil.* \| (\S+) and (\S+) \|"
)
ROUNDED = 0.0051  # two decimals
SIX_DIGITS, NOISE = 1e-5, 1e-6  # of what MuJoCo writes; m, N and 1 about zero
RATE = 0.05  # of the cylinders of all shipped arms, m/s
NOISY_GAP, STROKE_GIVEN = 1e-5, 2e-4  # m, of loops and strokes in plain MuJoCo under the greatest forces of the servos
SECTIONS = "compiler option size statistic visual default asset worldbody contact equality tendon actuator sensor custom keyframe"
SECTIONS = SECTIONS.split()
MODELS = sorted(path.parent for path in ROOT.glob("models/*/*.toml"))


@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_a_model_folder_is_whole(folder):
    name = folder.name
    files = {f"{name}.toml", f"{name}.xml", "scene.xml", f"{name}.png", "README.md", "CHANGELOG.md", "LICENSE"}
    assert files <= {path.name for path in folder.iterdir()}
    assert (folder / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()


@pytest.mark.long
@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_the_xml_is_what_its_description_gives(folder):
    shipped = (folder / f"{folder.name}.xml").read_text().split("-->\n", 1)[1]
    spec = build_arm_spec(load_manipulator(folder / f"{folder.name}.toml"), floor=False)
    spec.compile()
    words, numbers = split_numbers(shipped)
    expected_words, expected = split_numbers(spec.to_xml())
    assert words == expected_words
    assert np.allclose(numbers, expected, rtol=SIX_DIGITS, atol=NOISE)


@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_the_scene_is_what_is_written_around_an_arm(folder):
    assert (folder / "scene.xml").read_text() == make_stage(folder.name)


@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_the_xml_has_the_order_and_the_lines_of_menagerie(folder):
    """Compiler and defaults before bodies, bodies before actuators, two blanks for a level."""
    text = (folder / f"{folder.name}.xml").read_text()
    sections = [element.tag for element in ElementTree.fromstring(text)]
    assert sections == [section for section in SECTIONS if section in sections]
    assert {"compiler", "default", "worldbody", "equality", "actuator", "sensor", "keyframe"} <= set(sections)
    body = text.split("-->\n", 1)[1]
    assert all((len(line) - len(line.lstrip(" "))) % 2 == 0 and "\t" not in line for line in body.splitlines())


@pytest.mark.long
@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_a_model_bears_the_noise_of_menagerie(folder):
    """Menagerie's test of a model: for a second, every control anywhere in its range in every step, from the reset state."""
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data, slides = mujoco.MjData(model), find_slides(model)
    middle, half = model.actuator_ctrlrange.mean(axis=1), np.ptp(model.actuator_ctrlrange, axis=1) / 2
    fastest, step = 0.0, 0
    while data.time < 1.0:
        data.ctrl[:] = middle + half * [2 * mujoco.mju_Halton(step, j + 2) - 1 for j in range(model.nu)]
        mujoco.mj_step(model, data)
        fastest, step = max(fastest, np.abs(data.qvel[model.jnt_dofadr[slides]]).max()), step + 1
    assert not np.any(data.warning.number)
    assert measure_gap(model, data) < NOISY_GAP
    assert 0.5 * RATE < fastest < 2 * RATE  # it does shake


def find_slides(model: mujoco.MjModel) -> list[int]:
    """Joints of the cylinders."""
    return [j for j in range(model.njnt) if model.joint(j).name.endswith("/slide")]


@pytest.mark.parametrize("folder", MODELS, ids=lambda folder: folder.name)
def test_joint_control_and_sensor_are_the_length_from_pin_to_pin(folder):
    """In a keyframe, against the places of the pins; ranges against the description."""
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data, parts = mujoco.MjData(model), load_manipulator(folder / f"{folder.name}.toml").cylinders.values()
    strokes = np.array([(part.retracted, part.extended) for part in parts])
    mujoco.mj_resetDataKeyframe(model, data, model.key("reach").id)
    mujoco.mj_forward(model, data)
    for joint in find_slides(model):
        name = model.joint(joint).name.removesuffix("/slide")
        span = float(np.linalg.norm(data.site(f"{name}/far").xpos - data.site(f"{name}/near").xpos))
        assert data.qpos[model.jnt_qposadr[joint]] == pytest.approx(span, abs=SIX_DIGITS)
        assert data.sensor(f"{name}/length").data[0] == pytest.approx(span, abs=SIX_DIGITS)
        servo = model.actuator(f"{name}/servo")
        carried = float(servo.gainprm[0]) * (data.ctrl[servo.id] - span)
        assert abs(carried) < np.abs(servo.forcerange).max()  # beyond the length by what the servo gives, and no more
        assert np.array_equal(servo.ctrlrange, model.jnt_range[joint])
        assert model.jnt_limited[joint]
        assert np.isclose(strokes, servo.ctrlrange, rtol=SIX_DIGITS).all(axis=1).any()


@pytest.mark.parametrize(("folder", "seconds"), [("stewart", 6.0), pytest.param("arm9", 3.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("command", [0.0, 9.0])
def test_a_control_out_of_range_moves_the_arm_at_its_rated_speed(folder, seconds, command):
    """A control that was forgotten is taken as the least length: no more is lost than the way there at the rated speed."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / folder / "scene.xml"))
    data, slides = mujoco.MjData(model), find_slides(model)
    data.ctrl[1:] = command
    place, fastest = model.jnt_qposadr[slides], 0.0
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        fastest = max(fastest, np.abs(data.qvel[model.jnt_dofadr[slides]]).max())
    low, high = model.jnt_range[slides].T
    assert fastest < 1.25 * RATE  # a quarter for the load that helps
    assert np.all((data.qpos[place] > low - STROKE_GIVEN) & (data.qpos[place] < high + STROKE_GIVEN))
    assert not np.any(data.warning.number)
    if folder == "stewart":  # it has arrived
        chain = Chain(load_manipulator(folder), hanging_mount(data.site("mast/flange").xpos[2]))
        ends = np.full(6, (low if command == 0 else high)[0])
        assert data.qpos[place] == pytest.approx(ends, abs=1e-3)
        expected = chain.tool(chain.inputs_from_lengths(ends))[0]
        assert data.site("tool").xpos == pytest.approx(expected, abs=2e-3)  # the servos give


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
    model = load_model(folder.name)
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
    ratings = rate(make_sections(chain), length, 1.67)
    payloads = (Payload(mass=mass, radius=0.15) for mass in (0.0, 453.59237))
    used = [utilise(ratings, solve_members(make_load_model(chain, payload, 9.80665), nodes)) for payload in payloads]
    found = [use.strength.max() for use in used] + [use.pressure.max() for use in used]
    assert [float(figure) for figure in told.groups()] == pytest.approx(found, abs=ROUNDED)
