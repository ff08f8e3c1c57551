"""Which scene a log is judged by: its file, where it is there, and what differs is told."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from vgtsim.description import digest_scene, find_original, load_scene
from vgtsim.description.shipped import list_shipped


@pytest.fixture(scope="module")
def scene():
    return load_scene("arm9_nullspace")


def loosen(scene, **limits):
    task = scene.task
    return replace(scene, task=task.model_copy(update={"limits": task.limits.model_copy(update=limits)}))


def test_copy_that_is_the_file_s_has_no_notes(scene):
    found, notes = find_original(scene)
    assert notes == ()
    assert digest_scene(found) == digest_scene(scene)


def test_limits_of_the_file_count_and_are_told_first(scene):
    heavier = scene.task.payload.model_copy(update={"mass": 1.0})
    copy = loosen(scene, closure=0.01)
    copy = replace(copy, task=copy.task.model_copy(update={"payload": heavier}))
    found, (limits, others) = find_original(copy)
    assert found.task.limits == scene.task.limits
    assert "limits changed" in limits
    assert f"limits.closure: 0.01 in the log, {scene.task.limits.closure} in the file" in limits
    assert "payload.mass: 1.0 in the log" in others


def test_change_of_the_arm_is_told_with_its_key(scene):
    steel = scene.manipulator.materials["steel"].model_copy(update={"yield_strength": 1e9})
    arm = scene.manipulator.model_copy(update={"materials": {"steel": steel}})
    found, (note,) = find_original(replace(scene, manipulator=arm))
    assert "arm.materials.steel.yield_strength: 1000000000.0 in the log" in note
    assert found.manipulator.materials["steel"].yield_strength < 1e9


def test_scene_from_elsewhere_is_looked_for_among_the_shipped_ones(scene):
    found, notes = find_original(replace(loosen(scene, closure=0.01), file=Path("/nowhere/arm9_nullspace.toml")))
    assert found.task.limits == scene.task.limits
    assert "limits.closure" in notes[0]


@pytest.mark.parametrize(
    ("content", "said"), [(None, "is not there"), ("name = [", "TOML"), ("base = 'type_ii_reach'", "is the scene type_ii_reach")]
)  # fmt: skip
def test_without_its_file_the_log_s_copy_counts(scene, tmp_path, content, said):
    file = tmp_path / "mine.toml"
    if content is not None:
        file.write_text(content)
    mine = replace(scene, file=file, task=scene.task.model_copy(update={"name": "mine"}))
    found, (note,) = find_original(mine)
    assert found is mine
    assert said in note
    assert "those of the log" in note


def test_digest_is_that_of_the_figures_and_not_of_the_place(scene, tmp_path):
    there = tmp_path / "scenes"
    shutil.copytree(list_shipped("scene")["arm9_nullspace"].parent, there)
    shutil.copytree(list_shipped("arm")["arm9"].parents[1], tmp_path / "models")
    assert digest_scene(load_scene(there / "arm9_nullspace.toml")) == digest_scene(scene)
    assert digest_scene(loosen(scene, closure=0.01)) != digest_scene(scene)
