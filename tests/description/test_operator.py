"""Records of commands: read back bit for bit, and refused by line and key."""

from __future__ import annotations

import dataclasses
import json
import os

import pytest

from vgtsim.description import (
    OperatorCommand,
    digest_commands,
    digest_scene,
    dump_scene,
    load_commands,
    load_scene,
    parse_scene,
    write_command,
)
from vgtsim.errors import DescriptionError

LINES = [
    {"time": 0.1, "twist": [0.1, 1 / 3, -0.1, 0, 0, 0]},
    {"time": 0.1, "goal": [1, 2, 3, 0, 0, 1], "method": "newton", "objective": ["mid_stroke"]},
    {"time": 0.30000000000000004, "lengths": [0.9, 0.9, 0.9]},
    {"time": 2, "inputs": [0.1, 0.2, 0.3], "objective": []},
    {"time": 3, "hold": True},
]


def write(path, lines):
    path.write_text("\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines) + "\n")
    return path


def test_a_record_is_read_back_bit_for_bit(tmp_path):
    commands = load_commands(write(tmp_path / "a.jsonl", [*LINES, ""]))
    assert [item.target for item in commands] == ["twist", "goal", "lengths", "inputs", "hold"]
    assert commands[0].twist[1] == 1 / 3
    again = load_commands(write(tmp_path / "b.jsonl", [write_command(item) for item in commands]))
    assert again == commands
    assert digest_commands(again) == digest_commands(commands) != digest_commands(commands[1:])


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "no command"),
        (["{"], "line 1: found {; allowed: Invalid JSON"),
        (
            [LINES[0], {"time": 0.0, "hold": True}],
            r"line 2.time: found 0 s after 0.1 s; allowed: times that do not fall",
        ),
        ([{"time": 1}], "line 1: found .*one of twist, goal, inputs, lengths, hold, not none"),
        ([{"time": 1, "hold": True, "lengths": [1]}], "not lengths and hold"),
        ([{"time": 1, "twist": [0, 0, 0]}], "line 1.twist.3"),
        ([{"time": -1, "hold": True}], "line 1.time"),
        ([{"time": 1, "hold": False}], "line 1.hold"),
        ([{"time": 1, "twists": [0] * 6}], "unknown key 'twists'; did you mean 'twist'"),
        ([{"time": 1, "goal": [0] * 6, "method": "guess"}], "line 1.method"),
        (['{"time": 1, "lengths": [NaN]}'], "line 1.lengths.0"),
    ],
)
def test_a_wrong_line_is_refused_by_file_line_and_key(tmp_path, lines, words):
    with pytest.raises(DescriptionError, match=words) as caught:
        load_commands(write(tmp_path / "a.jsonl", lines))
    assert caught.value.file == tmp_path / "a.jsonl"


def test_a_missing_record_is_refused(tmp_path):
    with pytest.raises(DescriptionError, match="No such file"):
        load_commands(tmp_path / "none.jsonl")


def scene_file(tmp_path, text, commands=LINES[:1]):
    write(tmp_path / "own.jsonl", commands)
    path = tmp_path / "own.toml"
    path.write_text(f'base = "type_ii_reach"\nname = "own"\n{text}')
    return path


GOOD = """
[operator]
record = "own.jsonl"
speed = "0.1 m/s"
[simulation]
log_rate = "50 Hz"
timestep = "20 ms"
[motion]
goals = []
"""


def test_a_scene_carries_its_record_and_its_digest(tmp_path):
    scene = load_scene(scene_file(tmp_path, GOOD))
    assert scene.commands == (OperatorCommand(**LINES[0]),)
    assert scene.task.operator.speed == 0.1
    assert parse_scene(dump_scene(scene)) == scene
    assert digest_scene(scene) == digest_scene(dump_scene(scene))
    assert digest_scene(scene) != digest_scene(dataclasses.replace(scene, commands=()))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("goals = []", "", "either motion.goals or a table"),
        ("[operator]", "[operator]\nspeeed = 1", "did you mean 'speed'"),
        ('"20 ms"', '"10 ms"', "timestep of 1 / log_rate"),
        ('"own.jsonl"', '"other.jsonl"', "other.jsonl: file: found"),
        ('[operator]\nrecord = "own.jsonl"\nspeed = "0.1 m/s"', "", r"motion.goals, .*or a table \[operator\]"),
    ],
)
def test_a_scene_with_a_wrong_operator_is_refused(tmp_path, old, new, words):
    assert old in GOOD
    with pytest.raises(DescriptionError, match=words):
        load_scene(scene_file(tmp_path, GOOD.replace(old, new)))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes and devices")
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "loop", "missing", "UTF-16"])
def test_a_record_that_is_no_file_of_text_is_refused_at_once(tmp_path, kind):
    file = tmp_path / "record.jsonl"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "UTF-16":
        file.write_text('{"time":0}', encoding="utf-16")
    elif kind != "missing":
        file.symlink_to("/dev/zero" if kind == "device" else file.name)
    with pytest.raises(DescriptionError, match="record\\.jsonl"):
        load_commands(file)
