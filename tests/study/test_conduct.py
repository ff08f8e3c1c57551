"""A study in one process: its table, its files, its failures, and what it does when it is called again."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyarrow.parquet as pq
import pytest

from vgtsim.description import load_scene
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.workspace import sample_workspace
from vgtsim.output import figure, study_plot
from vgtsim.planning import make_problem, report_solution
from vgtsim.positioning import solve_by_method, tool_goal
from vgtsim.site import Site
from vgtsim.study import Engine, conduct_study, dispatch, records

KEEP = 'keep = ["reach", "max tilt", "mobility"]\n'
SEEDS = KEEP + "[grid]\nwork.seed = [3, 1, 2]\n"


@pytest.fixture
def no_plots(monkeypatch):
    """For tests of a study's rows: a picture takes as long as all their work."""
    monkeypatch.setattr(study_plot, "plot_study", lambda *_: None)
    monkeypatch.setattr(figure, "save_figure", lambda *_: None)


def test_the_table_holds_what_the_verb_finds(make_study, one_thread, tmp_path):
    found = conduct_study(make_study(SEEDS), tmp_path / "out", one_thread)
    site = Site(load_scene("arm9_nullspace"))
    for row, seed in zip(found.table.to_pylist(), (3, 1, 2), strict=True):
        alone = sample_workspace(site.chain, 10, seed)
        assert row["work.seed"] == seed
        assert (row["reach, m"], row["max tilt"]) == (alone.reach, alone.tilt.max())
    assert found.table.column_names == ["case", "work.seed", "reach, m", "max tilt", "mobility", "error"]
    assert pq.read_table(tmp_path / "out/table.parquet").equals(found.table)
    assert len((tmp_path / "out/table.csv").read_text().splitlines()) == 4
    assert (tmp_path / "out/plots.png").read_bytes().startswith(b"\x89PNG")


def test_the_figures_of_ik_are_those_of_its_request(make_study, one_thread, no_plots, tmp_path):
    head = 'name = "g"\nscene = "arm9_nullspace"\nwork.verb = "ik"\nkeep = ["value", "clearance", "min lengths"]\n'
    text = "[[cases]]\nscene.motion.goals.heel.position = [-6.7, -1.8, 1.0]\n"
    found = conduct_study(make_study(text, head), tmp_path / "out", one_thread)
    site = Site(load_scene("arm9_nullspace"))
    motion = site.task.motion
    goal = tool_goal((-6.7, -1.8, 1.0), motion.goals[0].direction)
    problem = make_problem(site, goal, motion.method, motion.objective)
    told = report_solution(site, problem, solve_by_method("ik", problem, site.start), motion.objective)
    (row,) = found.table.to_pylist()
    assert (row["value"], row["clearance, m"]) == (told["facts"]["value"], told["facts"]["clearance, m"])
    assert row["min lengths"] == min(told["lengths"])
    assert json.loads(row["scene.motion.goals.heel.position"]) == [-6.7, -1.8, 1.0]


def test_a_failed_case_is_a_row_with_its_error(make_study, one_thread, no_plots, tmp_path):
    text = KEEP + '[grid]\nscene.mast.pivot_depth = ["1.75 m", "90 m", "-1 m"]\nwork.seed = [0]\n'
    rows = conduct_study(make_study(text), tmp_path / "out", one_thread).table.to_pylist()
    assert rows[0]["error"] is None
    assert rows[1]["error"].startswith("DescriptionError: arm9_nullspace.toml: mast.pivot_depth: found 90 m")
    assert rows[2]["error"].startswith("DescriptionError: arm9_nullspace.toml: scene.mast.pivot_depth: found '-1 m'")
    assert rows[1]["reach, m"] is None is rows[2]["mobility"]


def test_a_defect_in_one_case_does_not_end_the_others(make_study, one_thread, no_plots, tmp_path, monkeypatch):
    verb = dispatch.VERBS["workspace"]

    def fail(site, settings, folder):
        assert settings.seed != 1, "a defect"
        return verb.do(site, settings, folder)

    monkeypatch.setitem(dispatch.VERBS, "workspace", type(verb)(fail, verb.figures, verb.arrays))
    rows = conduct_study(make_study(SEEDS), tmp_path / "out", one_thread).table.to_pylist()
    assert [(row["error"] or "").split("\n")[0] for row in rows] == ["", "AssertionError: a defect", ""]


def count_work(monkeypatch):
    done = []
    plain = dispatch._do_case

    def counted(order, case):
        done.append(case.entries[0])
        return plain(order, case)

    monkeypatch.setattr(dispatch, "_do_case", counted)
    return done


def test_a_study_goes_on_and_does_no_case_twice(make_study, one_thread, no_plots, tmp_path, monkeypatch):
    done = count_work(monkeypatch)
    first = conduct_study(make_study(SEEDS), tmp_path / "out", one_thread)
    assert sorted(done) == [1, 2, 3]
    done.clear()
    again = conduct_study(make_study(SEEDS), tmp_path / "out", one_thread)
    assert (done, again.done) == ([], 0)
    assert again.table.equals(first.table)
    longer = conduct_study(make_study(KEEP + "[grid]\nwork.seed = [1, 4, 4]\n"), tmp_path / "out", one_thread)
    assert done == [4]
    assert longer.table["work.seed"].to_pylist() == [1, 4, 4]
    assert longer.table.slice(0, 1)["reach, m"] == first.table.slice(1, 1)["reach, m"]


def test_an_interrupted_study_keeps_what_is_finished(make_study, one_thread, no_plots, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "_EVERY_S", 0.0)

    def stop(finished, total):
        if finished:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        conduct_study(make_study(SEEDS), tmp_path / "out", one_thread, stop)
    rows = sum(len(pq.read_table(file)) for file in (tmp_path / "out/parts").iterdir())
    assert rows in (1, 2)
    assert conduct_study(make_study(SEEDS), tmp_path / "out", one_thread).done == 3 - rows


def test_the_table_is_the_same_bit_for_bit_in_any_order_of_work(make_study, one_thread, tmp_path):
    class Backward(ThreadPoolExecutor):
        """Holds its work back until all has been handed in, and then begins at the end."""

        def __init__(self, total):
            super().__init__(1)
            self.left, self.total = [], total

        def submit(self, *call):
            import concurrent.futures

            future = concurrent.futures.Future()
            self.left.append((future, call))
            if len(self.left) == self.total:
                for waiting, (function, *words) in reversed(self.left):
                    waiting.set_result(function(*words))
            return future

    text = KEEP + '[grid]\nscene.mast.pivot_depth = ["1.75 m", "90 m"]\nwork.seed = [1, 2]\n'
    conduct_study(make_study(text), tmp_path / "a", one_thread)
    conduct_study(make_study(text), tmp_path / "b", Engine("here", lambda: Backward(4), 4, ()))
    for name in ("table.parquet", "table.csv", "plots.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_many_parts_are_packed_and_nothing_is_lost(make_study, one_thread, no_plots, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "_EVERY_S", 0.0)
    monkeypatch.setattr(records, "_MOST_PARTS", 3)
    found = conduct_study(
        make_study(KEEP + "[grid]\nwork.seed = [0, 1, 2, 3, 4, 5, 6]\n"), tmp_path / "out", one_thread
    )
    names = [file.name.split("-")[0] for file in (tmp_path / "out/parts").iterdir()]
    assert sorted(names) == ["pack", "pack", "part"]
    assert found.table["work.seed"].to_pylist() == [*range(7)]
    assert np.isfinite(found.numbers["reach, m"]).all()


def test_two_studies_do_not_share_a_folder(make_study, one_thread, no_plots, tmp_path):
    (tmp_path / "out").mkdir()
    held = records.Records(tmp_path / "out")
    with pytest.raises(DescriptionError, match="one study at a time"):
        conduct_study(make_study(SEEDS), tmp_path / "out", one_thread)
    held.close()
    conduct_study(make_study(SEEDS), tmp_path / "out", one_thread)
