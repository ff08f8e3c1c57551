"""Every case is done, whatever becomes of the workers."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from pathlib import Path

import pytest

from vgtsim.errors import ClusterError
from vgtsim.study import Engine, dispatch
from vgtsim.study.cases import plan_study
from vgtsim.study.dispatch import make_row


class LostError(Exception):
    """A worker is gone."""


@pytest.fixture
def shop(make_study, monkeypatch):
    """Work off twelve cases in threads where some batches are lost: rows that arrived, and how often each case was begun."""
    order, cases = plan_study(make_study("[grid]\nwork.seed = { least = 0, greatest = 11, count = 12 }"), Path("out"))

    def work(is_lost, error=LostError, width=3):
        begun, rows = Counter(), []

        def fake(_, batch):
            begun.update(case.entries[0] for case in batch)
            for case in batch:
                if is_lost(case.entries[0], begun[case.entries[0]]):
                    raise error("gone")
            return [make_row(order, case, dict.fromkeys(order.columns, 1.0), None, 0.01) for case in batch]

        monkeypatch.setattr(dispatch, "work_off", fake)
        monkeypatch.setattr(dispatch, "_TICK", 0.01)
        engine = Engine("of a test", lambda: ThreadPoolExecutor(2), width, (LostError, BrokenExecutor))
        dispatch.dispatch(order, cases, engine, rows.extend)
        return {row["work.seed"]: row["error"] for row in rows}, len(rows), begun

    return work


def test_each_case_is_done_once(shop):
    errors, count, begun = shop(lambda *_: False)
    assert count == len(errors) == 12
    assert set(begun.values()) == {1}
    assert not any(errors.values())


@pytest.mark.parametrize("error", [LostError, BrokenExecutor])
def test_the_cases_of_a_lost_worker_are_done_again(shop, error):
    errors, count, begun = shop(lambda case, times: case in (4, 9) and times == 1, error)
    assert count == len(errors) == 12
    assert begun[4] == begun[9] == 2
    assert not any(errors.values())


@pytest.mark.parametrize("error", [LostError, BrokenExecutor])
def test_a_case_that_ends_its_worker_is_a_row_and_the_others_are_done(shop, error):
    errors, count, begun = shop(lambda case, _: case == 5, error)
    assert count == len(errors) == 12
    assert {case for case, said in errors.items() if said} == {5}
    assert errors[5].startswith("LostWorker")
    assert begun[5] == 4  # twice among others, twice alone


def test_no_case_is_blamed_for_losses_among_others(shop):
    errors, count, _ = shop(lambda _, times: times <= 3)
    assert count == len(errors) == 12
    assert not any(errors.values())


def test_processes_that_cannot_work_at_all_end_the_study(shop):
    with pytest.raises(ClusterError, match="of a test: its processes end before the first case"):
        shop(lambda *_: True, BrokenExecutor)


def test_workers_without_the_same_packages_end_the_study(shop):
    with pytest.raises(ClusterError, match="of a test: a worker cannot begin: gone"):
        shop(lambda case, _: case == 5, ImportError)
