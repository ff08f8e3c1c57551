"""Everything wrong with a file at once, and files of another kind."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vgtsim.description import list_faults, load_manipulator, load_scene, load_tank, tell_file
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import DescriptionError


@pytest.mark.parametrize("kind", ["arm", "tank", "scene", "path", "study"])
def test_shipped_files_are_told_by_their_keys_and_have_no_faults(kind):
    files = list(list_shipped(kind).values())
    assert {tell_file(file) for file in files} == {kind}
    assert list_faults(files[0], kind) == []


@pytest.mark.parametrize(
    ("load", "kind", "words"),
    [
        (load_scene, "arm", "found an arm; allowed: a scene; for an arm: `vgtsim show`.*as `manipulator`"),
        (load_scene, "tank", "found a tank; allowed: a scene"),
        (load_manipulator, "scene", "found a scene; allowed: an arm; for a scene: `vgtsim run`"),
        (load_tank, "study", "found a study; allowed: a tank; for a study: `vgtsim study`"),
    ],
)
def test_a_file_of_another_kind_is_refused_with_its_verb(load, kind, words):
    file = next(iter(list_shipped(kind).values()))
    with pytest.raises(DescriptionError, match=words):
        load(file)


def test_the_name_of_another_kind_is_refused_with_its_verb():
    with pytest.raises(DescriptionError, match="'arm15', an arm; allowed: a scene; for an arm: `vgtsim show`"):
        load_scene("arm15")


def test_all_faults_of_a_scene_and_its_files_are_listed(tmp_path):
    arm = Path(list_shipped("arm")["arm9"]).read_text().replace("tool_offset", "tool_ofset").replace('"m2"', '"m1"')
    (tmp_path / "arm.toml").write_text(arm)
    file = tmp_path / "scene.toml"
    file.write_text(
        'name = "w"\ntitel = "w"\nmanipulator = "arm.toml"\ntank = "typ_ii"\n'
        '[mast]\npivot_depth = "1.75 n"\nouter_diam = "36 in"\n[motion]\nstart = "stowd"\ngoals = []\n'
    )
    said = "\n".join(map(str, list_faults(file, "scene")))
    for words in (
        "unknown key 'titel'; did you mean 'title'?",
        "title: found nothing; allowed: this key",
        "unknown key 'outer_diam'; did you mean 'outer_diameter'?",
        "mast.outer_diameter: found nothing",
        "mast.pivot_depth: found '1.75 n'; allowed: not a quantity",
        "payload: found nothing",
        "motion.start: found 'stowd'",
        "tank: found 'typ_ii'; allowed: the path of a file, or the name of a shipped tank; did you mean 'type_ii'?",
        "unknown key 'tool_ofset'; did you mean 'tool_offset'?",
        "tip_plate.tool_offset: found nothing",
    ):
        assert words in said


@pytest.mark.parametrize(
    ("key", "wrong", "words"),
    [
        (
            'do = "hold"',
            'do = "holds"',
            r"mission\.5\.do: found 'holds'; allowed: one of insert, .*; did you mean 'hold'\?",
        ),
        ('do = "hold"', "", r"mission\.5\.do: found nothing; allowed: this key"),
        ('goal = "aside"', 'goals = "aside"', r"mission\.2: unknown key 'goals'; did you mean 'goal'\?"),
        ('time = { value = "5 s"', 'time = { value = "5 m"', r"mission\.5\.time: found '5 m'"),
    ],
)
def test_a_wrong_step_of_a_mission_is_told_by_its_place(tmp_path, key, wrong, words):
    shipped = list_shipped("scene")["type_ii_mission"]
    file = tmp_path / "mission.toml"
    file.write_text(shipped.read_text(encoding="utf-8").replace(key, wrong), encoding="utf-8")
    assert any(re.search(words, str(fault)) for fault in list_faults(file, "scene"))


def test_a_file_of_no_kind_is_refused(tmp_path):
    file = tmp_path / "x.toml"
    file.write_text('name = "x"\ncolour = "red"\n')
    with pytest.raises(DescriptionError, match="keys of no kind of file; allowed: for an arm"):
        tell_file(file)
