"""Every verb on files that are wrong in seeded ways; `scripts/fuzz` runs many more of them."""

from __future__ import annotations

import pytest
from fuzzing import make_case, run_case, warm_up

CASES = 48  # most of a minute of processor time
FIRST = 20_000


@pytest.fixture(scope="module", autouse=True)
def _warm():
    warm_up()


@pytest.mark.long
@pytest.mark.parametrize("block", range(4))
def test_no_input_ends_in_a_traceback_or_a_hang(block, tmp_path):
    wrong = []
    for seed in range(FIRST + block, FIRST + CASES, 4):
        folder = tmp_path / str(seed)
        folder.mkdir()
        outcome = run_case(make_case(seed, folder), folder)
        if outcome.fault:
            wrong.append(f"scripts/fuzz 1 {seed}: {outcome.fault}: {outcome.output[-300:]}")
    assert not wrong, "\n".join(wrong)


def test_the_same_seed_makes_the_same_case(tmp_path):
    cases = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        case = make_case(7, tmp_path / name)
        files = {file.name: file.read_bytes() for file in sorted((tmp_path / name).glob("*.toml")) if file.is_file()}
        cases.append((case.mutations, [word.replace(name, "") for word in case.words], files))
    assert cases[0] == cases[1]
