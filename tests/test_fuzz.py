"""Every verb on files that are wrong in seeded ways; `scripts/fuzz` runs many more of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from spoilt_verbs import RUNS, VERBS, make_case

from vgtsim import cli

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


@pytest.mark.parametrize("seed", range(8))
def test_the_same_seed_makes_the_same_case(tmp_path, seed):
    cases = []
    for name in RUNS:  # of which no chunk is needed here
        (tmp_path / "runs" / name / "log").mkdir(parents=True)
        (tmp_path / "runs" / name / "log/_end.json").write_text('{\n "records": 0\n}\n')
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        case = make_case(seed, tmp_path / name, tmp_path / "runs")
        files = {file.name: file.read_bytes() for file in sorted((tmp_path / name).rglob("*.*")) if file.is_file()}
        cases.append((case.mutations, [word.replace(name, "") for word in case.words], files))
    assert cases[0] == cases[1]


def test_every_verb_is_tried():
    tried = {verb.words[0] for verb in VERBS}
    groups = {group.name for group in cli.app.registered_groups}
    verbs = {command.name or command.callback.__name__ for command in cli.app.registered_commands if command.callback}
    assert tried == (verbs | groups) - {"schema", "live"}  # one reads nothing, the other serves until it is stopped
