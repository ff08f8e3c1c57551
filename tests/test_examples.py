"""Every example runs from an empty folder, and each figure that it prints beside an expected one agrees with it.

One that draws runs in a process of its own, as a user starts it. The others run in the process of the tests, which spares
what a program loads first.
"""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
FILMS = {"12_film"}  # need EGL
MOST_LINES = 60
PAIR = re.compile(r"(-?\d+(?:\.\d+)?)[^,\d\n]*, expected (-?\d+(?:\.\d+)?)")


@pytest.mark.parametrize(
    "path", [pytest.param(path, marks=[pytest.mark.render] * (path.stem in FILMS), id=path.stem) for path in EXAMPLES]
)
@pytest.mark.long
def test_an_example_prints_what_it_expects(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if path.stem in FILMS:
        done = subprocess.run([sys.executable, path], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        printed = done.stdout
    else:
        runpy.run_path(str(path), run_name="__main__")
        printed = capsys.readouterr().out
    pairs = PAIR.findall(printed)
    assert pairs, printed
    for found, expected in pairs:
        if "." in expected:  # either may be rounded the other way: one unit in the last place
            assert abs(float(found) - float(expected)) < 1.01 * 10 ** -len(expected.partition(".")[2]), (
                found,
                expected,
            )
        else:
            assert found == expected  # a count, which no rounding changes


def test_examples_are_numbered_short_and_start_from_the_package():
    assert [path.name[:3] for path in EXAMPLES] == [f"{number:02d}_" for number in range(1, len(EXAMPLES) + 1)]
    for path in EXAMPLES:
        text = path.read_text()
        assert len(text.splitlines()) < MOST_LINES, path.name
        assert "\nimport vgtsim\n" in text, path.name
