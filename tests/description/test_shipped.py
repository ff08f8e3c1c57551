"""Shipped arms, tanks, scenes and paths are found by name from any folder."""

from __future__ import annotations

import re

import pytest

from vgtsim.description import load_manipulator, load_scene, load_tank, load_tool_path
from vgtsim.description.shipped import find_file, list_shipped
from vgtsim.errors import DescriptionError

# Limits of what an arm is to do, not of how exact a run is: a clean figure beside them is no measure of them.
PERFORMANCE = {"tracking_position", "tracking_angle"}
WITH_CLEAN_FIGURE = {"closure", "kinematics_agreement", "axial_force_moving"}
LOADERS = {"arm": load_manipulator, "tank": load_tank, "scene": load_scene, "path": load_tool_path}


@pytest.mark.long
@pytest.mark.parametrize("kind", LOADERS)
def test_a_name_loads_the_same_as_its_file_from_any_folder(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert list_shipped(kind)
    for name, file in list_shipped(kind).items():
        assert find_file(name, kind) == file
        assert LOADERS[kind](name) == LOADERS[kind](file)


def test_no_two_arms_or_scenes_share_a_name():
    assert not set(list_shipped("arm")) & set(list_shipped("scene"))


@pytest.mark.parametrize("name", ["./arm15", "arm15.toml", "some/arm15"])
def test_a_path_is_never_taken_for_a_name(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DescriptionError, match="No such file"):
        load_manipulator(name)


def test_a_file_goes_before_a_shipped_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm15").write_text(list_shipped("arm")["arm9"].read_text())
    assert load_manipulator("arm15").name == "arm9"


def test_an_unknown_name_gives_the_nearest_and_the_list():
    with pytest.raises(DescriptionError) as raised:
        find_file("amr15", "scene", "arm")
    said = str(raised.value)
    assert "found 'amr15'" in said
    assert "did you mean 'arm15'?" in said
    for name in (*list_shipped("scene"), *list_shipped("arm")):
        assert name in said


def test_a_scene_of_the_users_names_a_shipped_base_arm_and_tank(tmp_path):
    text = list_shipped("scene")["arm9_nullspace"].read_text()
    text = text.replace("../models/arm9/arm9.toml", "arm9").replace("tanks/type_ii.toml", "type_ii")
    (tmp_path / "mine.toml").write_text(text)
    (tmp_path / "over.toml").write_text('base = "mine.toml"\nname = "over"\n')
    (tmp_path / "other.toml").write_text('base = "type_ii_reach"\nname = "other"\n')
    for name in ("mine", "over"):
        scene = load_scene(tmp_path / f"{name}.toml")
        assert (scene.manipulator.name, scene.tank.name) == ("arm9", "type_ii")
    assert load_scene(tmp_path / "other.toml").manipulator == load_manipulator("arm15")


@pytest.mark.parametrize("name", list_shipped("scene"))
def test_limits_stand_ten_times_above_the_clean_figure_beside_them(name):
    task = load_scene(name).task
    notes = {key.removeprefix("limits."): origin.note for key, origin in task.provenance.items()}
    assert all(re.search("clean run|as in type_ii_sections", notes[key]) for key in WITH_CLEAN_FIGURE)
    clean = {key: float(found[1]) for key, note in notes.items() if (found := re.search(r"clean run ([\d.e-]+)", note))}
    close = {key for key, figure in clean.items() if 10 * figure > getattr(task.limits, key)}
    assert close <= PERFORMANCE
