"""Verbs of the command line that work on arms and runs: what they leave is parsed, what they refuse is named."""

from __future__ import annotations

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from playing import bend, change, play, shorten
from typer.testing import CliRunner

from vgtsim import cli
from vgtsim.description import load_manipulator
from vgtsim.description.files import load_scene
from vgtsim.errors import VgtError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.log import save_log
from vgtsim.planning import solve_first_goal
from vgtsim.site import Site
from vgtsim.statics.equilibrium import solve_members
from vgtsim.statics.loads import make_load_model, weigh

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
MODELS = ROOT / "models"
SINGLE = MODELS / "octahedron_double/octahedron_double.toml"
NINE = MODELS / "arm9/arm9.toml"
HALF_CELL = 0.26  # m: cells of 0.5 m, bends written to 0.01 degrees


def invoke(*words):
    return CliRunner().invoke(cli.app, list(map(str, words)), env={"COLUMNS": "200"})


def refusal(*words):
    """What `main` would say: the runner hands the error over."""
    result = invoke(*words)
    assert isinstance(result.exception, VgtError), result.output
    return str(result.exception)


@pytest.fixture(scope="module")
def folder(reach_scene, tmp_path_factory):
    """What a short run of one module leaves."""
    folder = tmp_path_factory.mktemp("run")
    scene = change(shorten(reach_scene, 1), log_rate=40.0)
    save_log(folder / "log", scene, play(scene, bend(scene, [0.3], [0.2]), bend(scene, [0.5], [0.5]), 1.0))
    return folder


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """Folder, rows and words of a capacity map with the usual safety factor and with twice that."""
    found = []
    for omega in ("1.67", "3.34"):
        folder = tmp_path_factory.mktemp("capacity")
        result = invoke("capacity", SINGLE, "--out", folder, "--safety-factor", omega)
        assert result.exit_code == 0, result.output
        with (folder / "capacity.csv").open() as stream:
            found.append((folder, list(csv.DictReader(stream)), result.output))
    return found


def test_capacity_maps_what_a_small_arm_carries(mapped):
    folder, rows, output = mapped[0]
    assert (folder / "capacity.png").read_bytes()[:4] == b"\x89PNG"
    assert rows
    chain = Chain(load_manipulator(SINGLE), hanging_mount(0.0))
    for row in rows:
        assert row["governing_member"] in chain.truss.member_names
        assert float(row["payload_kg"]) > 0
        q = np.array(chain.straight)
        q[0] = np.sin(np.radians(float(row["bend_1_deg"])) / 2)
        tool = chain.tool(q)[0]
        assert abs(np.hypot(*tool[:2]) - float(row["radius_m"])) < HALF_CELL
        assert abs(-tool[2] - float(row["depth_m"])) < HALF_CELL
    least = min(rows, key=lambda row: float(row["payload_kg"]))
    said = re.search(r"least: (\d+) kg at radius ([\d.]+) m, depth ([\d.]+) m, by .* of (\S+);", output)
    assert said is not None
    assert float(said[1]) == pytest.approx(float(least["payload_kg"]), abs=0.51)
    assert said[4] == least["governing_member"]


def test_twice_the_safety_factor_carries_less_and_is_governed_by_strength(mapped):
    (_, usual, _), (_, safer, _) = mapped
    places = {(row["radius_m"], row["depth_m"]): float(row["payload_kg"]) for row in usual}
    for row in safer:
        assert float(row["payload_kg"]) < 0.6 * places[row["radius_m"], row["depth_m"]]
        assert row["governing_limit"] == "yield"


def test_export_writes_a_truss_in_equilibrium(folder):
    result = invoke("export", folder, "--time", "0.5")
    assert result.exit_code == 0, result.output
    assert [Path(line).name for line in result.output.split()] == ["truss.json", "truss_pynite.py", "truss.vtu"]
    data = json.loads((folder / "truss.json").read_text())
    assert data["time"] == pytest.approx(0.5, abs=0.02)
    held = np.zeros(3)
    place = {node["name"]: np.array(node["position"]) for node in data["nodes"]}
    for bar in data["members"]:
        near, far = bar["ends"]
        for one, other in ((near, far), (far, near)):
            if one.startswith("base/"):
                held += bar["force"] * (place[other] - place[one]) / bar["length"]
    free = sum(np.array(node["load"]) for node in data["nodes"] if not node["fixed"])
    assert np.allclose(held, free, atol=1e-6 * np.linalg.norm(free))  # cut through above the flange
    compile((folder / "truss_pynite.py").read_text(), "truss_pynite.py", "exec")


def test_export_without_vtk_leaves_it_out(folder, tmp_path):
    shutil.copytree(folder / "log", tmp_path / "log")
    assert invoke("export", tmp_path, "--no-vtk").exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log", "truss.json", "truss_pynite.py"]


def small_task(tmp_path, mass):
    """The nine-actuator arm on a tour of one goal, in its own files."""
    text = (ROOT / "scenes/arm9_nullspace.toml").read_text()
    text = text.replace("../models/arm9/arm9.toml", str(NINE))
    text = text.replace("tanks/type_ii.toml", str(ROOT / "scenes/tanks/type_ii.toml"))
    text = text.replace('mass = { value = "1000 lb"', f'mass = {{ value = "{mass}"')
    goals = text.split("[[motion.goals]]")
    last = goals[-1][goals[-1].index("\n[") :]
    (tmp_path / "task.toml").write_text("[[motion.goals]]".join(goals[:2]) + last)
    return tmp_path / "task.toml"


def test_size_writes_an_arm_that_stands_its_task(tmp_path):
    arm, sized = NINE, tmp_path / "sized.toml"
    task = small_task(tmp_path, "500 kg")
    result = invoke("size", arm, "--task", task, "--out", sized, "--reserve", "0.1", "--tour-only")
    assert result.exit_code == 0, result.output
    said = re.search(r"arm of (\d+) kg, now (\d+) kg", result.output)
    assert said is not None
    before, after = (weigh(Chain(load_manipulator(file), np.eye(4))) for file in (arm, sized))
    assert (float(said[1]), float(said[2])) == (pytest.approx(before, abs=0.51), pytest.approx(after, abs=0.51))
    assert after < before
    used = [float(value) for value in re.findall(r"│ *(0\.\d\d) *│", result.output)]
    assert used
    assert max(used) <= 0.9
    scene = load_scene(task)
    chain = Chain(load_manipulator(sized), Site(scene).chain.mount)
    q = solve_first_goal(Site(scene))
    assert np.allclose(chain.tool(q)[0], scene.task.motion.goals[0].position)
    bar = solve_members(make_load_model(chain, scene.task.payload, scene.task.simulation.gravity), chain.nodes(q)).bar
    for member, force in zip(chain.truss.members, bar, strict=True):
        if member.role == "actuator":
            part = chain.manipulator.cylinders[member.section]
            assert -0.9 * part.push < force < 0.9 * part.pull
        else:
            tube = chain.manipulator.tubes[member.section]
            assert abs(force) < 0.9 * chain.manipulator.materials[tube.material].yield_strength * tube.area / 1.67


@pytest.mark.filterwarnings("ignore::vgtsim.errors.UnusualWarning")
def test_size_refuses_a_load_beyond_the_catalogue(tmp_path):
    said = refusal("size", NINE, "--task", small_task(tmp_path, "90000 kg"), "--out", tmp_path / "sized.toml")
    assert re.search(r"modules\.\w+\.\w+: found [\d.]+ kN of pull and [\d.]+ kN of push", said)
    assert not (tmp_path / "sized.toml").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("capacity", "none.toml"), r"none\.toml: file: found No such file"),
        (("size", "none.toml", "--task", ROOT / "scenes/type_ii_reach.toml"), r"none\.toml: file"),
        (("size", MODELS / "arm9/arm9.toml", "--task", "none.toml"), r"none\.toml: file"),
        (
            ("size", MODELS / "arm9/arm9.toml", "--task", ROOT / "scenes/type_ii_reach.toml"),
            r"5 module shapes; allowed: .*arm9, 3",
        ),
        (
            ("size", MODELS / "mixed/mixed.toml", "--task", ROOT / "scenes/type_ii_reach.toml"),
            r"5 module shapes; allowed: .*mixed, 4",
        ),
        (("export", "nowhere"), r"nowhere/log/_begin\.json"),
        (("models", ROOT / "docs"), r"docs: file: found no arms"),
        (("show", MODELS / "arm9/arm9.toml", "--lengths", "m1=1,1"), r"--lengths m1: found 2 values"),
        (("workspace", "none.toml"), r"none\.toml: file"),
        (
            (
                "track",
                MODELS / "octahedron_general/octahedron_general.toml",
                "--path",
                ROOT / "scenes/paths/waste_raster.toml",
            ),
            r"5 goal rows for 3 inputs",
        ),
        (
            (
                "ik",
                MODELS / "octahedron_general/octahedron_general.toml",
                "--position",
                0,
                0,
                -5,
                "--direction",
                0,
                0,
                -1,
            ),
            r"5 goal rows for 3 inputs",
        ),
    ],
)
def test_what_a_verb_cannot_do_is_named(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert re.search(said, refusal(*words))
    assert not list(tmp_path.iterdir())


def written(path, text):
    path.write_text(text)
    return path


def test_files_that_cannot_be_written_are_refused_before_any_work(tmp_path):
    goal = ("--position", 0, 0, -5, "--direction", 0, 0, -1)
    under = written(tmp_path / "file", "") / "a"
    task = small_task(tmp_path, "500 kg")
    assert "file, File exists; allowed: a folder" in refusal("size", NINE, "--task", task, "--out", under)
    assert "found a folder" in refusal("size", NINE, "--task", task, "--out", tmp_path)
    assert "file, File exists; allowed: a folder" in refusal("ik", NINE, *goal, "--json", under)
    said = refusal("ik", NINE, *goal, "--plot", tmp_path / "a.xyz")
    assert "found the ending '.xyz'; allowed: .svg or .png" in said


@pytest.mark.parametrize(
    ("piece", "shape"),
    [
        ('shape = "line"\nto = [6, -1, -5.8]', "line"),
        ('shape = "arc"\ncentre = [6, 0, 0]\naxis = [0, 1, 0]\nangle = 0', "arc"),
    ],
)
def test_track_refuses_a_piece_that_goes_nowhere(tmp_path, piece, shape):
    text = f'name = "still"\nstart = [6, -1, -5.8]\ndirection = [0.3, 0, -1]\n[[pieces]]\n{piece}\n'
    path = written(tmp_path / "still.toml", text)
    said = refusal("track", MODELS / "arm15/arm15.toml", "--path", path)
    assert f"pieces.0: found a {shape} that goes nowhere" in said


@pytest.mark.parametrize(
    "words",
    [
        ("capacity", MODELS / "arm9/arm9.toml", "--payload", "-5"),
        ("capacity", MODELS / "arm9/arm9.toml", "--safety-factor", "0.5"),
        ("size", MODELS / "arm9/arm9.toml"),
        ("size", MODELS / "arm9/arm9.toml", "--task", "x.toml", "--reserve", "1"),
        ("workspace", MODELS / "arm9/arm9.toml", "--samples", "0"),
        ("ik", MODELS / "arm9/arm9.toml", "--position", "0", "0", "-5"),
        ("export",),
        ("models", "--nonsense"),
    ],
)
def test_options_that_cannot_be_are_bad_input(words):
    assert invoke(*words).exit_code == cli.Status.BAD_INPUT


def test_show_draws_a_given_pose(tmp_path):
    arm = MODELS / "mixed/mixed.toml"
    result = invoke("show", arm, "--lengths", "m1=36 in,40 in,38 in", "--inputs", "h1=60 deg", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert {path.name for path in tmp_path.iterdir()} == {f"mixed.{kind}" for kind in ("png", "svg", "glb", "stl")}
    said = re.search(r"tool at (\S+) (\S+) (\S+) m, direction (\S+) (\S+) (\S+);", result.output)
    assert said is not None
    chain = Chain(load_manipulator(arm), hanging_mount(0.0))
    start = np.array(chain.straight)
    start[0] = np.pi / 3
    lengths = chain.lengths(start)
    lengths[1:4] = np.array([36, 40, 38]) * 0.0254
    point, axis = chain.tool(chain.inputs_from_lengths(lengths))
    assert np.allclose([float(value) for value in said.groups()], [*point, *axis], atol=1e-6)


def test_ik_finds_what_it_is_asked_for(tmp_path):
    chain = Chain(load_manipulator(MODELS / "arm9/arm9.toml"), hanging_mount(0.0))
    q = np.array(chain.straight)
    q[::3] = 0.1
    position, direction = chain.tool(q)
    words = ["--position", *position, "--direction", *direction, "--json", tmp_path / "ik.json"]
    result = invoke("ik", MODELS / "arm9/arm9.toml", *words)
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "ik.json").read_text())
    found = chain.tool(np.array(data["q"]))
    assert np.allclose(found[0], position, atol=1e-6)
    assert np.allclose(found[1], direction, atol=1e-6)


def test_models_lists_what_the_descriptions_give():
    rows = {}
    for line in invoke("models").output.splitlines():
        cells = [cell.strip() for cell in line.split("│")[1:-1]]
        if len(cells) == 6 and cells[0]:
            rows[cells[0]] = cells
    for file in MODELS.glob("*/*.toml"):
        arm = load_manipulator(file)
        chain = Chain(arm, hanging_mount(0.0))
        name, freedom, modules, _, mass, title = rows[arm.name]
        assert (name, int(freedom), int(modules)) == (arm.name, len(chain.truss.actuated), len(arm.modules))
        assert float(mass) == pytest.approx(weigh(chain), abs=0.51)
        assert title[:20] == arm.title[:20]
