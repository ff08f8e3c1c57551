"""Real workers: processes, and a scheduler with two workers; each is killed in mid-study."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time

import psutil
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import load_study
from vgtsim.errors import ClusterError, MissingLibraryError
from vgtsim.study import conduct_study, use_cluster, use_processes

CASES = 8  # of some 0.7 s each: a part is written every second, and two workers must not be done by then
STUDY = f"""
name = "cheap"
scene = "arm9_nullspace"
work = {{ verb = "workspace", samples = 8000, seed = 0 }}
keep = ["reach", "max tilt", "near singular"]
[grid]
work.seed = {[*range(CASES)]}
"""
PROGRAM = (sys.executable, "-c", "from vgtsim.cli import main; main()", "study")


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """File of the study, and its table by one process that is left alone."""
    folder = tmp_path_factory.mktemp("plain")
    file = folder / "cheap.toml"
    file.write_text(STUDY)
    done = CliRunner().invoke(app, ["study", str(file), "--workers", "1", "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    assert f"{CASES} cases, {CASES} of them now" in done.output
    return file, (folder / "out/table.parquet").read_bytes()


def count_rows(folder):
    return sum(len(pq.read_table(file)) for file in folder.glob("parts/pa*.parquet"))


def wait_for_rows(folder, begun):
    """Wait until some, not all, cases of a program's study are finished; gives their number."""
    for _ in range(2400):
        assert begun.poll() is None, "the study ended before it could be disturbed"
        if rows := count_rows(folder):
            assert rows < CASES
            return rows
        time.sleep(0.05)
    raise AssertionError("no case was finished in two minutes")


@pytest.mark.long
def test_a_killed_process_loses_no_case(plain, tmp_path):
    file, table = plain
    killed = []

    def kill_one(finished, total):
        if 0 < finished < total and not killed:
            killed.append(multiprocessing.active_children()[0])
            os.kill(killed[0].pid, signal.SIGKILL)

    with use_processes(2) as engine:
        conduct_study(load_study(file), tmp_path / "out", engine, kill_one)
    assert killed
    assert (tmp_path / "out/table.parquet").read_bytes() == table
    assert count_rows(tmp_path / "out") == CASES
    assert not multiprocessing.active_children()


@pytest.mark.long
def test_a_killed_study_leaves_no_process_and_goes_on_where_it_was(plain, tmp_path):
    file, table = plain
    out = tmp_path / "out"
    begun = subprocess.Popen([*PROGRAM, file, "--workers", "2", "--out", out], stdout=subprocess.DEVNULL)
    wait_for_rows(out, begun)
    children = psutil.Process(begun.pid).children(recursive=True)
    begun.kill()
    begun.wait()
    rows = count_rows(out)
    assert not psutil.wait_procs(children, timeout=30)[1]
    done = CliRunner().invoke(app, ["study", str(file), "--workers", "2", "--out", str(out)])
    assert f"{CASES} cases, {CASES - rows} of them now" in done.output
    assert count_rows(out) == CASES
    assert (out / "table.parquet").read_bytes() == table


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, and its two workers, of one thread each."""
    told = tmp_path / "scheduler.json"
    dask = (sys.executable, "-m", "dask")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [*dask, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", told], **quiet
    )
    every = (*dask, "worker", "--scheduler-file", told, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    workers = [subprocess.Popen(every, **quiet, cwd=tmp_path) for _ in range(2)]
    while not told.exists():
        assert scheduler.poll() is None
        time.sleep(0.05)
    yield json.loads(told.read_text())["address"], workers
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


@pytest.mark.long
def test_a_cluster_gives_the_same_table_though_a_worker_is_killed(plain, tmp_path, cluster):
    file, table = plain
    address, workers = cluster
    out = tmp_path / "out"
    begun = subprocess.Popen([*PROGRAM, file, "--cluster", address, "--out", out], stdout=subprocess.DEVNULL)
    wait_for_rows(out, begun)
    workers[0].kill()
    assert begun.wait(timeout=300) == 0
    assert (out / "table.parquet").read_bytes() == table
    assert count_rows(out) == CASES


def test_without_dask_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(MissingLibraryError, match=r"distributed is missing; .*vgtsim\[study\]"),
        use_cluster("tcp://h:1"),
    ):
        pass


@pytest.mark.parametrize("address", ["nonsense://h:1", "h"])
def test_a_wrong_address_is_named(address):
    with pytest.raises(ClusterError, match=f"cluster {address}: no scheduler answers"), use_cluster(address):
        pass


def test_the_settings_of_processes_are_put_back(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with use_processes(2) as engine:
        assert (os.environ["OMP_NUM_THREADS"], os.environ["MKL_NUM_THREADS"]) == ("1", "1")
        assert engine.width == 4
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ
