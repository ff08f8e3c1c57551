"""Files that are wrong before their entries are looked at: each kind is refused with a word, at once."""

from __future__ import annotations

import os

import pytest

from vgtsim.description import load_manipulator, load_scene, load_tool_path
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import DescriptionError

ARM = list_shipped("arm")["stewart"].read_text()


def refuse(file, words, load=load_manipulator):
    with pytest.raises(DescriptionError, match=words) as caught:
        load(file)
    assert len(str(caught.value)) < 1000
    return caught.value


def test_a_byte_order_mark_is_accepted(tmp_path):
    file = tmp_path / "arm.toml"
    file.write_bytes(b"\xef\xbb\xbf" + ARM.encode())
    assert load_manipulator(file) == load_manipulator("stewart")


@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        ("utf-16", "text in UTF-16.*UTF-8: save"),
        ("utf-32", "text in UTF-32"),
        ("latin-1", "byte 0xe9 in line 1, which is not UTF-8.*Latin-1"),
    ],
)
def test_another_encoding_is_named(tmp_path, encoding, words):
    file = tmp_path / "arm.toml"
    file.write_bytes(("# é\n" + ARM).encode(encoding, errors="replace"))
    refuse(file, words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = " + "[" * 3000 + "]" * 3000, "deep"),
        (".".join(["a"] * 5000) + " = 1", "12 deep at most"),
        ("x = " + "9" * 5000, "4300"),
        ("name = 0x" + "f" * 5000, "."),
        ("x = " + "9" * 400, "unknown key 'x'"),
        ("x = 1\n" * 300_000, "more than 1000000 bytes"),
        ("provenance = {}\n" + ARM, "provenance: .*no such key"),
        ('[materials]\nvalue = { steel = 1 }\nlabel = "assumed"', "materials: found a label beside a table"),
        ("base\0 = 1", "syntax"),
    ],
    ids=lambda text: text[:12],
)
def test_text_that_is_no_description_is_refused(tmp_path, text, words):
    file = tmp_path / "arm.toml"
    file.write_text(text)
    refuse(file, words)


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [
        ("title", "title = ", 'title = "\\u001b[31mred"\n#'),
        ("title", "title = ", f'title = "{"x" * 300}"\n#'),
        ("name", "name = ", f'name = "{"x" * 300}"\n#'),
        ("face_side", "face_side = ", f"face_side = {'9' * 400}\n#"),
        ("face_side", "face_side = ", f"face_side = 0x{'f' * 5000}\n#"),
        (
            "face_side",
            "face_side = ",
            'face_side = { value = [["1 m"]], label = "assumed", note = "", range = [0, 1] }\n#',
        ),
    ],
    ids=lambda text: text[:24],
)
def test_an_entry_of_absurd_length_is_refused_by_its_key(tmp_path, key, old, new):
    file = tmp_path / "arm.toml"
    file.write_text(ARM.replace(old, new, 1))
    assert refuse(file, ".").key == key


def test_what_is_no_regular_file_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    (tmp_path / "folder.toml").mkdir()
    for name in ("pipe", "zero", "folder"):
        refuse(tmp_path / f"{name}.toml", "a folder, a pipe or a device")
    refuse(tmp_path / "loop.toml", "symbolic links")
    refuse(f"{'x' * 300}.toml", "name too long")
    refuse("arm\0.toml", "zero byte")


def test_bases_end_after_some_files_or_in_a_loop_of_links(tmp_path):
    for i in range(40):
        (tmp_path / f"s{i}.toml").write_text(f'base = "s{i + 1}.toml"\n')
    refuse(tmp_path / "s0.toml", "at most 16", load_scene)
    (tmp_path / "other.toml").symlink_to("first.toml")
    (tmp_path / "first.toml").write_text('base = "other.toml"\n')
    refuse(tmp_path / "first.toml", "does not lead back here", load_scene)
    (tmp_path / "zero.toml").write_text('base = "x\\u0000.toml"\n')
    refuse(tmp_path / "zero.toml", "zero byte", load_scene)


def test_an_integer_that_no_message_can_show_is_refused(tmp_path, capfd):
    """Written in base 16, where Python reads any length; as the kind of a table it made pydantic print a traceback."""
    path = tmp_path / "line.toml"
    path.write_text(f'name = "line"\nstart = [0, 0, 0]\ndirection = [0, 0, 1]\n[[pieces]]\nshape = 0x{"f" * 5000}\n')
    with pytest.raises(DescriptionError, match="an integer of thousands of digits"):
        load_tool_path(path)
    assert capfd.readouterr() == ("", "")
