"""First files written for a user: they load, pass `check`, and say what they were asked for."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.constants import GRAVITY, PAYLOAD_RADIUS, SAFETY_FACTOR
from vgtsim.description import Payload, load_manipulator, load_scene, load_tank
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.checks import RISER_SPARE, riser_fit
from vgtsim.positioning import make_box
from vgtsim.positioning.restarts import make_postures
from vgtsim.site import load_arm, load_site
from vgtsim.statics import find_use, make_load_model, make_sections, weigh

pytestmark = pytest.mark.long  # sizes are chosen in thousands of postures

SMALL = ["--reach", "6 m", "--riser", "24 in", "--payload", "50 kg", "--modules", "4"]
TANKS = sorted(path.stem for path in (Path(__file__).parents[1] / "scenes/tanks").glob("*.toml"))
ROUNDING = 1e-5  # m: lengths in a file have five digits
HEAVIER = 1.1  # mass of a drafted arm over that of the shipped one of the same layout


def call(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.exception or result.output
    return result.output


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    file = tmp_path_factory.mktemp("new") / "small.toml"
    call("new", "arm", file, *SMALL)
    return file


def test_a_new_arm_is_as_asked_and_passes_its_check(small):
    chain = load_arm(small)
    arm = chain.manipulator
    assert len(arm.active) == 4
    assert np.linalg.norm(chain.tool(chain.straight)[0]) == pytest.approx(6.0, abs=8 * ROUNDING)
    assert riser_fit(chain, 24 * 0.0254).spare >= RISER_SPARE
    assert not arm.provenance  # plain figures
    assert "4 active modules, 12 actuators, 6.00 m straight" in call("check", small)


def test_a_new_arm_carries_its_payload_in_any_posture(small):
    """By the utilisation of a run's report, in postures that the sizes were not chosen for."""
    arm = load_manipulator(small)
    chain = Chain(arm, hanging_mount(0.0))
    model = make_load_model(chain, Payload(mass=50.0, radius=PAYLOAD_RADIUS), GRAVITY)
    nodes = chain.nodes(make_postures(make_box(chain, 0.0)).q)
    assert find_use(model, make_sections(chain), nodes, SAFETY_FACTOR).worst.max() < 1.0


def test_a_new_arm_of_the_shipped_layout_weighs_as_much(tmp_path):
    """The shipped arm was sized for a tour and for fewer postures; its layout and its payload are the same."""
    call("new", "arm", tmp_path / "a.toml")
    assert 1 - ROUNDING < weigh(load_arm(tmp_path / "a.toml")) / weigh(load_arm("arm15")) < HEAVIER


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--riser", "12 in"], r"riser: found a bore of 0\.305 m; allowed: some 0\.\d+ m or more"),
        (["--reach", "1 m"], "modules: found 1 modules over 1.00 m .*; allowed: a longer reach, or a narrower riser"),
        (["--modules", "40"], "modules: found 40 modules over .*; allowed: at most 10, or a longer reach"),
        (
            ["--payload", "4000 lb", *SMALL[:4], "--modules", "3"],
            "what the largest of .* sizes in the catalogue carries.*ask for less payload",
        ),
        (["--reach", "-3 m"], "--reach: found '-3 m'; allowed: more than zero"),
        (["--reach", "3 kg"], "--reach: found '3 kg'.*dimension"),
    ],
)
def test_an_arm_that_cannot_be_is_refused_with_the_reason(tmp_path, options, words):
    result = CliRunner().invoke(app, ["new", "arm", str(tmp_path / "a.toml"), *options])
    assert re.search(words, str(result.exception))
    assert not (tmp_path / "a.toml").exists()


def test_a_short_arm_has_as_many_modules_as_it_has_room_for(tmp_path):
    call("new", "arm", tmp_path / "short.toml", "--reach", "6 m", "--payload", "100 kg")
    assert "4 active modules" in call("check", tmp_path / "short.toml")


@pytest.mark.parametrize("kind", TANKS)
def test_a_new_tank_is_the_shipped_one(tmp_path, kind):
    """All of it, what it takes from its base included, but for names and the notes on sources."""
    file = tmp_path / "mine.toml"
    call("new", "tank", file, "--type", kind)
    mine, shipped = load_tank(file), load_tank(kind)
    kept = {"name": shipped.name, "title": shipped.title, "provenance": shipped.provenance}
    assert mine.name == "mine"
    assert mine.model_copy(update=kept | {"meshes": shipped.meshes}) == shipped
    parts = [[mesh.parts for mesh in tank.meshes] for tank in (mine, shipped)]
    assert parts[0] == parts[1]
    if kind == "type_ii":
        assert "sourced: osti.gov" in file.read_text()


@pytest.fixture(scope="module")
def scene(small):
    file = small.with_name("mine.toml")
    said = call("new", "scene", file, "--arm", small, "--tank", "type_ii", "--payload", "50 kg", "--goals", "2")
    assert "2 goals that small comes to" in said
    return file


def test_a_new_scene_passes_its_check(scene):
    file = scene
    assert "2 goals within reach" in call("check", file)
    site = load_site(file)
    assert site.task.motion.start is None
    assert load_scene(file).task.motion.goals[0].at is not None
    assert site.task.payload.mass == pytest.approx(50.0)


def uncomment(text):
    """The file with every commented table and key in force, those of the sentences about other shapes and waste left out."""
    head, mark, more = text.partition("# More that")
    assert mark
    return head + re.sub(r"^# (?=\[|\w+ = )", "", "# More that" + more, flags=re.MULTILINE)


def test_every_commented_table_of_a_new_tank_is_right(tmp_path):
    file = tmp_path / "mine.toml"
    call("new", "tank", file, "--type", "type_ii")
    trimesh.creation.box((400, 400, 900)).export(tmp_path / "pump.stl")
    file.write_text(uncomment(file.read_text()))
    tank = load_tank(file)
    assert "side" in {item.name for item in tank.risers}
    assert {"lance", "cabinet_1", "cabinet_2", "pump"} <= {item.name for item in tank.things}
    assert tank.guide is not None
    assert len(tank.waste.all_mounds(11.0)) == 41


def test_every_commented_table_of_a_new_scene_is_right(scene):
    commented = scene.with_name("full.toml")
    commented.write_text(uncomment(scene.read_text()))
    task = load_scene(commented).task
    assert [step.do for step in task.mission] == ["move", "hold", "raster", "follow"]
    assert task.tool is not None
    assert task.conveyance is not None
    assert [patch.name for patch in task.patches] == ["heel"]


def test_a_new_mission_has_a_hoist_that_lifts_the_arm_out(small, tmp_path):
    """The stroke against the stowed arm's length, and the force against the weight, both worked out anew."""
    file = tmp_path / "mine.toml"
    call("new", "scene", file, "--arm", small, "--tank", "type_ii", "--payload", "50 kg", "--goals", "1", "--mission")
    site = load_site(file)
    assert [step.do for step in site.task.mission] == ["insert", "move", "withdraw"]
    feed, chain, flange = site.task.mast.feed, site.chain, site.tank.grade + site.tank.arm_riser.above_grade
    assert feed is not None
    assert feed.stroke > flange - chain.tool(chain.stowed)[0][2] > feed.stroke - 2
    assert feed.force == pytest.approx(1.5 * GRAVITY * (weigh(chain) + 50.0 + site.mast.mass), rel=0.05)


def test_a_file_that_is_there_is_kept(small):
    before = small.read_text()
    result = CliRunner().invoke(app, ["new", "tank", str(small)])
    assert "found a file that is there; allowed: a new file, or --force" in str(result.exception)
    assert small.read_text() == before
