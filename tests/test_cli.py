"""The command line: each error names its cause, has its status, and leaves nothing behind."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import vgtsim.site
from vgtsim import cli
from vgtsim.errors import DivergenceError, MissingLibraryError

ROOT = Path(__file__).parents[1]
ARM, TANK, SCENE = "models/arm15/arm15.toml", "scenes/tanks/type_ii.toml", "scenes/type_ii_reach.toml"


def call(monkeypatch, capsys, *words):
    """Exit status and what was said on standard error."""
    monkeypatch.setattr(sys, "argv", ["vgtsim", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return ended.value.code or 0, " ".join(capsys.readouterr().err.split())


def copy_project(tmp_path, name, old, new):
    """Arm, tank and scene with one piece of text of one of them replaced; returns the scene."""
    for source in (ARM, TANK, SCENE):
        target = tmp_path / source
        target.parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / source).read_text()
        if source == name:
            assert old in text
            text = text.replace(old, new)
        target.write_text(text)
    return tmp_path / SCENE


LONGERON = 'longeron = { value = "31.177 in"'
BAD_INPUT = {
    "syntax": (SCENE, "[payload]", "[payload", ["TOML syntax error"]),
    "unknown key": (SCENE, "pivot_depth", "pivot_dept", ["unknown key 'pivot_dept'", "did you mean 'pivot_depth'"]),
    "wrong dimension": (SCENE, 'mass = { value = "1000 lb"', 'mass = { value = "45 m"', ["payload.mass", "dimension"]),
    "not finite": (SCENE, 'mass = { value = "1000 lb"', "mass = { value = nan", ["payload.mass", "finite"]),
    "out of range": (SCENE, 'hold = { value = "2 s"', 'hold = { value = "-2 s"', ["motion.hold", "more than 0"]),
    "open triangle": (ARM, LONGERON, 'longeron = { value = "15 in"', ["module m1", "do not close a triangle"]),
    "stroke": (ARM, 'stroke = { value = "23 in"', 'stroke = { value = "27 in"', ["m1", "does not assemble"]),
    "riser": (TANK, 'bore = { value = "42 in"', 'bore = { value = "40 in"', ["riser", "node"]),
    "inside an obstacle": (
        SCENE,
        '["9.96 m", "0.87 m", "2.5 m"]',
        '["1.54 m", "1.84 m", "2.5 m"]',
        ["saltwell_screen"],
    ),
    "outside the tank": (SCENE, '["9.96 m", "0.87 m", "2.5 m"]', '["12.5 m", "1.74 m", "2.5 m"]', ["behind", "shell"]),
    "pivot": (SCENE, 'pivot_depth = { value = "1.75 m"', 'pivot_depth = { value = "9.5 m"', ["mast.pivot_depth"]),
    "out of reach": (SCENE, '["9.96 m", "0.87 m", "2.5 m"]', '["-3 m", "0 m", "3.0 m"]', ["behind", "out of reach by"]),
}


@pytest.mark.long
@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_named_and_nothing_is_written(case, tmp_path, monkeypatch, capsys):
    name, old, new, words = BAD_INPUT[case]
    scene = copy_project(tmp_path, name, old, new)
    if case == "stroke":  # a dead length that still holds two eyes
        text = (tmp_path / ARM).read_text()
        (tmp_path / ARM).write_text(text.replace('retracted = { value = "31 in"', 'retracted = { value = "35 in"'))
    status, said = call(monkeypatch, capsys, "run", scene, "--out", tmp_path / "out")
    assert status == cli.Status.BAD_INPUT
    for word in words:
        assert word in said
    assert not (tmp_path / "out").exists()


def test_a_missing_scene_is_named(tmp_path, monkeypatch, capsys):
    status, said = call(monkeypatch, capsys, "run", tmp_path / "none.toml", "--out", tmp_path / "out")
    assert status == cli.Status.BAD_INPUT
    assert "none.toml" in said
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_named(tmp_path, monkeypatch, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    status, said = call(monkeypatch, capsys, "build", ROOT / ARM, "--out", blocked / "out")
    assert status == cli.Status.BAD_INPUT
    assert "output folder" in said


def test_a_divergence_has_its_own_status(monkeypatch, capsys):
    def diverge(*_):
        raise DivergenceError(1.25, "m1/longeron/3/closure", 0.4)

    monkeypatch.setattr(vgtsim.site, "load_scene", diverge)
    status, said = call(monkeypatch, capsys, "run", "any.toml")
    assert status == cli.Status.DIVERGED
    assert "t = 1.250 s" in said
    assert "m1/longeron/3/closure" in said


def test_a_missing_library_has_its_own_status(monkeypatch, capsys):
    def lack(*_):
        raise MissingLibraryError("EGL", "apt-get install libegl1")

    monkeypatch.setattr(vgtsim.site, "load_scene", lack)
    status, said = call(monkeypatch, capsys, "run", "any.toml")
    assert status == cli.Status.MISSING_LIBRARY
    assert "apt-get install libegl1" in said


@pytest.mark.long
def test_build_writes_a_model_beside_the_arm(tmp_path, monkeypatch, capsys):
    status, _ = call(monkeypatch, capsys, "build", ROOT / ARM, "--out", tmp_path)
    assert status == cli.Status.PASSED
    assert sorted(os.listdir(tmp_path)) == ["arm15.mjb", "arm15.xml", "scene.xml"]


@pytest.mark.parametrize("verb", ["run", "build", "verify", "render", "view", "track", "live"])
def test_help_shows_an_example(verb, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["vgtsim", verb, "--help"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert f"vgtsim {verb} " in " ".join(capsys.readouterr().out.split()).split("Example:")[1]


def test_help_shows_every_word_of_its_options():
    """Square brackets too, such as those of a default."""
    seen = []
    for names, verb in list_verbs(typer.main.get_command(cli.app)):
        shown = CliRunner().invoke(cli.app, [*names, "--help"], env={"COLUMNS": "500"}).output
        for option in verb.params:
            if option.help and not option.hidden:
                assert option.help.split("`")[0] in shown, (names, option.name)
                seen.append(option.help)
    assert any("[default: 45 ft]" in told for told in seen)


def list_verbs(command, names=()):
    """Each verb with the names that lead to it."""
    inner = getattr(command, "commands", {})
    yield from (found for name, verb in inner.items() for found in list_verbs(verb, (*names, name)))
    if not inner:
        yield names, command


def test_a_defect_of_the_program_has_a_status_of_its_own(monkeypatch, capsys, tmp_path):
    def fail(*_):
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(vgtsim.site, "load_arm", fail)
    status, said = call(monkeypatch, capsys, "show", "arm15", "--out", tmp_path)
    assert status == cli.Status.DEFECT == 70
    assert "ZeroDivisionError: by zero" in said
    assert "Traceback" not in said
    (report,) = tmp_path.glob("vgtsim-defect-*.txt")
    assert "Traceback" in report.read_text()


def test_titles_and_paths_are_no_markup(monkeypatch, capsys, tmp_path):
    text = (ROOT / "models/stewart/stewart.toml").read_text()
    arm = tmp_path / "arms/[red]/arm.toml"
    arm.parent.mkdir(parents=True)
    title = "[/] -->-- <b> $x^{$ :smile:"
    arm.write_text(text.replace('title = "', f'title = "{title} '))
    assert call(monkeypatch, capsys, "build", arm)[0] == 0
    written = (arm.parent / "stewart.xml").read_text()
    comment, model = written.split("-->", 1)
    assert "--" not in comment.removeprefix("<!--")
    assert "<mujoco" in model
    monkeypatch.setattr(sys, "argv", ["vgtsim", "models", str(tmp_path / "arms")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert "[/] -->--" in capsys.readouterr().out
    status, said = call(monkeypatch, capsys, "build", tmp_path / "[/red]\x1b[31m.toml")
    assert status == 2
    assert "/[/red]\\x1b[31m.toml: " in said
