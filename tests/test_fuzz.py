"""Every verb on files that are wrong in seeded ways; `scripts/fuzz` runs many more of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from fuzzing import make_case

ROOT = Path(__file__).parents[1]
CASES = 48  # most of a minute of processor time
FIRST = 20_000


@pytest.mark.long
def test_no_input_ends_in_a_traceback_or_a_hang():
    """In a process of its own: cases are forked, and a process of tests has threads that a fork would leave behind."""
    script = [sys.executable, str(ROOT / "scripts/fuzz"), str(CASES), str(FIRST)]
    run = subprocess.run(script, cwd=ROOT, capture_output=True, text=True, check=False, timeout=600)
    assert run.returncode == 0, run.stdout + run.stderr
    assert f"{CASES} cases, 0 faults" in run.stdout


def test_the_same_seed_makes_the_same_case(tmp_path):
    cases = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        case = make_case(7, tmp_path / name)
        files = {file.name: file.read_bytes() for file in sorted((tmp_path / name).glob("*.toml")) if file.is_file()}
        cases.append((case.mutations, [word.replace(name, "") for word in case.words], files))
    assert cases[0] == cases[1]
