"""Files that describe: what is shipped is whole and labelled, what is wrong is named."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from vgtsim.description import load_manipulator, load_scene, load_tank
from vgtsim.errors import DescriptionError
from vgtsim.units import to_si

ROOT = Path(__file__).parents[2]
ARM, TANK, SCENE = (
    ROOT / name for name in ("models/arm15/arm15.toml", "scenes/tanks/type_ii.toml", "scenes/type_ii_reach.toml")
)
# paths of the tool are commands: there are no figures of the world in them
SHIPPED = sorted([*ROOT.glob("models/*/*.toml"), *ROOT.glob("scenes/*.toml"), *ROOT.glob("scenes/tanks/*.toml")])


def leaves(node, key=""):
    """Every entry of a TOML tree that is a number or a quantity, with its key path."""
    if isinstance(node, dict):
        for name, entry in node.items():
            yield from leaves(entry, f"{key}.{name}")
    elif isinstance(node, list):
        for entry in node:
            yield from leaves(entry, key)
    elif isinstance(node, float | int | str) and not isinstance(node, bool) and str(node)[:1].isdigit():
        yield key, node


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_every_shipped_figure_has_a_label(path):
    bare = [
        key
        for key, _ in leaves(tomllib.loads(path.read_text()))
        if not key.endswith((".value", ".range", ".note", ".title")) and not key.startswith(".video")
    ]
    assert not bare


def figures(node, key=""):
    if isinstance(node, dict) and "value" in node:
        yield key, node
    elif isinstance(node, dict | list):
        for name, entry in node.items() if isinstance(node, dict) else enumerate(node):
            yield from figures(entry, f"{key}.{name}")


@pytest.mark.parametrize("path", [ARM, TANK], ids=lambda path: path.name)
def test_assumed_figures_lie_in_their_ranges(path):
    checked = 0
    for key, entry in figures(tomllib.loads(path.read_text())):
        if entry["label"] != "assumed" or isinstance(entry["value"], list):
            continue
        low, high = entry["range"]
        unit = str(entry["value"]).split(" ", 1)[1] if isinstance(entry["value"], str) else "dimensionless"
        checked += 1
        assert to_si(low, unit) <= to_si(entry["value"], unit) <= to_si(high, unit), key
    assert checked


HUB = 'radius = { value = "1.5 in", label = "assumed", note = "joint ball; sets the node circle with the riser\'s bore", range = '


@pytest.mark.parametrize(
    ("value", "limits", "key", "words"),
    [
        (
            '"2 in"',
            '["1.25 in", "1.5 in"]',
            "hub.radius",
            r"found '2 in'; allowed: 1\.25 in to 1\.5 in, the range beside",
        ),
        ('"1.2 in"', '["1.25 in", "1.5 in"]', "hub.radius", "found '1.2 in'"),
        ("0.039", '["1.25 in", "1.5 in"]', "hub.radius", "found 0.039"),
        ('"1.5 in"', '["1 kg", "2 kg"]', "hub.radius.range", "the dimension of '1.5 in'"),
        ('"1.5 in"', '["1 in", "broad"]', "hub.radius.range", "not a quantity"),
        ('"1.5 in"', '["2 in", "1 in"]', "hub.radius", "2 in to 1 in"),
    ],
)
def test_a_figure_outside_its_own_range_is_refused(tmp_path, value, limits, key, words):
    path = changed(tmp_path, ARM, f'{HUB}["1.25 in", "1.5 in"]', HUB.replace('"1.5 in"', value, 1) + limits)
    with pytest.raises(DescriptionError, match=words) as caught:
        load_manipulator(path)
    assert caught.value.key == key


@pytest.mark.parametrize(("value", "limits"), [('"38.1 mm"', '["1.25 in", "1.5 in"]'), ('"1.5 in"', "[0.03, 0.0381]")])
def test_figures_and_ranges_may_have_different_units(tmp_path, value, limits):
    path = changed(tmp_path, ARM, f'{HUB}["1.25 in", "1.5 in"]', HUB.replace('"1.5 in"', value, 1) + limits)
    assert load_manipulator(path).hub.radius == pytest.approx(0.0381)


def test_every_figure_of_a_vector_keeps_to_its_range(tmp_path):
    note = 'label = "assumed", note = "under the dome, 9 m out"'
    path = changed(tmp_path, SCENE, note, f'{note}, range = ["-6 m", "7 m"]')
    with pytest.raises(DescriptionError, match=r"'7\.37 m'; allowed: -6 m to 7 m") as caught:
        load_scene(path)
    assert caught.value.key == "motion.goals.0.position"


def test_provenance_is_kept_by_key_path():
    arm = load_manipulator(ARM)
    assert arm.provenance["hub.radius"].label == "assumed"
    assert arm.provenance["modules.0.longeron"].label == "derived"
    assert arm.materials["steel"].yield_strength == pytest.approx(315e6)


def changed(tmp_path: Path, source: Path, old: str, new: str) -> Path:
    """A copy of a shipped file with one piece of text replaced, its own references still good."""
    text = source.read_text()
    assert old in text
    text = text.replace(old, new, 1)
    for name in ("../models/arm15/arm15.toml", "tanks/type_ii.toml"):
        text = text.replace(f'"{name}"', f'"{(source.parent / name).resolve()}"')
    path = tmp_path / source.name
    path.write_text(text)
    return path


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DescriptionError, match=r"nowhere\.toml: .*No such file"):
        load_scene(tmp_path / "nowhere.toml")


def test_a_missing_arm_is_named(tmp_path):
    path = changed(tmp_path, SCENE, "../models/arm15/arm15.toml", "../models/arm51/arm51.toml")
    with pytest.raises(DescriptionError, match=r"arm51\.toml"):
        load_scene(path)


def test_a_syntax_error_gives_line_and_column(tmp_path):
    path = changed(tmp_path, ARM, "[hub]", "[hub")
    with pytest.raises(DescriptionError, match=r"TOML syntax error.*line \d+, column \d+"):
        load_manipulator(path)


def test_an_unknown_key_names_the_nearest_one(tmp_path):
    path = changed(tmp_path, ARM, "tool_offset", "tool_ofset")
    with pytest.raises(DescriptionError, match=r"tip_plate.*unknown key 'tool_ofset'; did you mean 'tool_offset'"):
        load_manipulator(path)


def test_an_unknown_section_names_the_nearest_one(tmp_path):
    name = load_manipulator(ARM).modules[0].longeron_tube
    path = changed(tmp_path, ARM, f'longeron_tube = {{ value = "{name}"', f'longeron_tube = {{ value = "{name}0"')
    with pytest.raises(DescriptionError, match=rf"modules\.0\.longeron_tube = '{name}0'.*did you mean '{name}'"):
        load_manipulator(path)


@pytest.mark.parametrize(
    ("source", "load", "old", "new", "key", "words"),
    [
        (
            ARM,
            load_manipulator,
            'radius = { value = "1.5 in"',
            'radius = { value = "45 kg"',
            "hub.radius",
            "dimension",
        ),
        (
            ARM,
            load_manipulator,
            'radius = { value = "1.5 in"',
            'radius = { value = "-1 in"',
            "hub.radius",
            "more than 0",
        ),
        (
            ARM,
            load_manipulator,
            'radius = { value = "1.5 in"',
            "radius = { value = nan",
            "hub.radius",
            "finite",
        ),
        (TANK, load_tank, 'crown = { value = "9.07 m"', 'crown = { value = "5 m"', "shell", "dome rise"),
        (TANK, load_tank, 'level = { value = "0.145 m"', 'level = { value = "8 m"', "", "waste.level below"),
        (ARM, load_manipulator, 'label = "assumed"', 'label = "guessed"', "hub.radius.label", "assumed"),
    ],
)
def test_a_figure_that_cannot_be_is_named(tmp_path, source, load, old, new, key, words):
    with pytest.raises(DescriptionError, match=words) as caught:
        load(changed(tmp_path, source, old, new))
    assert caught.value.key == key
    assert caught.value.file is not None
    assert caught.value.file.name == source.name


def test_longerons_too_short_for_their_face_name_the_module(tmp_path):
    path = changed(tmp_path, ARM, 'longeron = { value = "31.177 in"', 'longeron = { value = "15 in"')
    with pytest.raises(DescriptionError, match=r"module m1: longerons of 0\.381 m do not close a triangle"):
        load_manipulator(path)


def test_a_pivot_outside_the_tank_is_refused(tmp_path):
    written = next(line for line in SCENE.read_text().splitlines() if line.startswith("pivot_depth"))
    path = changed(tmp_path, SCENE, written, 'pivot_depth = "9.5 m"')
    with pytest.raises(DescriptionError, match="pivot inside the tank") as caught:
        load_scene(path)
    assert caught.value.key == "mast.pivot_depth"


def test_a_missing_key_is_named(tmp_path):
    path = changed(tmp_path, SCENE, "[payload]\nmass", "[payload]\n#mass")
    with pytest.raises(DescriptionError, match="found nothing") as caught:
        load_scene(path)
    assert caught.value.key == "payload.mass"


def test_start_must_fit_the_arm(tmp_path):
    text = SCENE.read_text()
    first = text.index("[[motion.start]]")
    second = text.index("[[motion.start]]", first + 1)
    path = changed(tmp_path, SCENE, text[first:second], "")
    with pytest.raises(DescriptionError, match="4 module shapes"):
        load_scene(path)


METHOD = 'method = "nullspace"'
OBJECTIVE = 'value = ["clearance", "stroke_barrier:0.01", "in_plane:10"]'


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        (
            METHOD,
            'method = "nulspace"',
            "motion.method",
            r"found 'nulspace'.*'nullspace', 'coupled', 'anchored' or 'sh",
        ),
        (OBJECTIVE, 'value = ["clearence"]', "motion.objective.0", "found 'clearence'.*did you mean 'clearance'"),
        (OBJECTIVE, 'value = ["clearance", "in_plane:nan"]', "motion.objective.1", "'in_plane:nan'.*above zero"),
        (OBJECTIVE, 'value = ["in_plane:-1"]', "motion.objective.0", "above zero"),
        (OBJECTIVE, 'value = ["in_plane:"]', "motion.objective.0", "above zero"),
        (OBJECTIVE, "value = [nan]", "motion.objective.0", "found nan.*a text"),
        (OBJECTIVE, "value = []", "motion.objective", "a list of 1 or more"),
        (
            METHOD,
            'method = "nullspace"\ncoupling = [["m1", "m2"]]',
            "motion",
            'with method = "coupled" or "anchored" only',
        ),
        (METHOD, 'method = "coupled"\ncoupling = []', "motion.coupling", "at least one pair.*m1, m2, m3, m4, m5"),
        (METHOD, 'method = "coupled"\ncoupling = [["m1", "s2"]]', "motion.coupling", "'s2' is none.*m1, m2"),
        (METHOD, 'method = "coupled"\ncoupling = [["m1", "m1"]]', "motion.coupling", "leads and follows"),
        (
            METHOD,
            'method = "coupled"\ncoupling = [["m1", "m5"], ["m2", "m5"], ["m3", "m5"], ["m4", "m5"]]',
            "motion.coupling",
            "at most 3 pairs: a tool goal has 5 rows, and 3 inputs would be left",
        ),
    ],
)
def test_a_resolution_that_cannot_be_is_named(tmp_path, old, new, key, words):
    with pytest.raises(DescriptionError, match=words) as caught:
        load_scene(changed(tmp_path, SCENE, old, new))
    assert caught.value.key == key
    assert caught.value.file is not None
    assert caught.value.file.name == SCENE.name


def test_a_coupled_scene_couples_the_modules_at_both_ends(tmp_path):
    scene = load_scene(changed(tmp_path, SCENE, METHOD, 'method = "coupled"'))
    assert scene.coupled_modules() == ((0, 1), (4, 3))
    scene = load_scene(changed(tmp_path, SCENE, METHOD, 'method = "coupled"\ncoupling = [["m5", "m1"]]'))
    assert scene.coupled_modules() == ((4, 0),)


def test_a_scene_over_another_differs_where_it_says_so_and_nowhere_else():
    reach, elastic = (load_scene(ROOT / f"scenes/type_ii_{name}.toml") for name in ("reach", "elastic"))
    assert (elastic.task.simulation.members, elastic.task.name) == ("elastic", "type_ii_elastic")
    assert elastic.task.motion.goals == reach.task.motion.goals
    assert elastic.task.limits == reach.task.limits
    assert elastic.manipulator == reach.manipulator
    assert elastic.task.provenance["payload.mass"] == reach.task.provenance["payload.mass"]
    assert elastic.task.simulation.log_rate == reach.task.simulation.log_rate


def test_a_scene_over_one_in_another_folder_finds_its_arm(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(f'base = "{SCENE}"\nname = "mine"\n[payload]\nmass = "10 kg"\n')
    scene = load_scene(file)
    assert scene.manipulator.name == "arm15"
    assert (scene.task.payload.mass, scene.task.payload.radius) == (10.0, 0.15)


def test_a_base_that_leads_back_is_named(tmp_path):
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    first.write_text('base = "second.toml"\n')
    second.write_text('base = "first.toml"\n')
    with pytest.raises(DescriptionError, match=r"base: found first\.toml; allowed: a scene that does not lead back"):
        load_scene(first)
    first.write_text("base = 3\n")
    with pytest.raises(DescriptionError, match="the path of a scene's file"):
        load_scene(first)
