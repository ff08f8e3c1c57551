"""Real workers: processes, and a scheduler with two workers; each is killed with a case in hand."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import load_study
from vgtsim.errors import ClusterError, MissingLibraryError
from vgtsim.study import conduct_study, use_cluster, use_processes

CASES = 8
FREE = 2  # of `held`
PATIENCE = 600  # s: on a machine that does other things besides
HELD = Path(__file__).with_name("held.py")
STUDY = f"""
name = "cheap"
scene = "arm9_nullspace"
work = {{ verb = "workspace", samples = 40, seed = 0 }}
keep = ["reach", "max tilt", "near singular"]
[grid]
work.seed = {[*range(CASES)]}
"""
PROGRAM = (sys.executable, str(HELD), "study")


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


@pytest.fixture
def gate(tmp_path, monkeypatch):
    """A file at which all cases but the first ones wait, see `held`."""
    file = tmp_path / "gate"
    file.touch()
    monkeypatch.setenv("GATE", str(file))
    yield file
    file.unlink(missing_ok=True)


def list_held(gate):
    """Numbers of the processes that have a case in hand."""
    return [int(file.stem) for file in gate.parent.glob("*.held")]


def wait_at(gate, folder, begun):
    """Wait until a program's study has written its first cases, and two workers have others in hand; gives their numbers."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        assert begun.poll() is None, "the study ended before it could be disturbed"
        if count_rows(folder) == FREE and len(held := list_held(gate)) == 2:
            return held
        time.sleep(0.05)
    raise AssertionError(f"two workers were not at the gate in {PATIENCE} s")


@pytest.mark.long
def test_a_killed_process_loses_no_case(plain, gate, tmp_path, monkeypatch):
    file, table = plain
    killed = []

    def kill_one(finished, total):
        if finished and not killed and list_held(gate):
            killed.append(list_held(gate)[0])
            assert killed[0] in [process.pid for process in multiprocessing.active_children()]
            assert finished == FREE < total
            os.kill(killed[0], signal.SIGKILL)
            gate.unlink()

    main = sys.modules["__main__"]
    monkeypatch.setattr(main, "__spec__", None, raising=False)
    monkeypatch.setattr(main, "__file__", str(HELD), raising=False)
    with use_processes(2) as engine:
        conduct_study(load_study(file), tmp_path / "out", engine, kill_one)
    assert killed
    assert (tmp_path / "out/table.parquet").read_bytes() == table
    assert count_rows(tmp_path / "out") == CASES
    assert not multiprocessing.active_children()


@pytest.mark.long
def test_a_killed_study_leaves_no_process_and_goes_on_where_it_was(plain, gate, tmp_path):
    file, table = plain
    out = tmp_path / "out"
    begun = subprocess.Popen([*PROGRAM, file, "--workers", "2", "--out", out], stdout=subprocess.DEVNULL)
    held = wait_at(gate, out, begun)
    children = psutil.Process(begun.pid).children(recursive=True)
    assert {child.pid for child in children} >= {*held}
    begun.kill()
    begun.wait()
    assert not psutil.wait_procs(children, timeout=PATIENCE)[1]
    done = CliRunner().invoke(app, ["study", str(file), "--workers", "2", "--out", str(out)])
    assert f"{CASES} cases, {CASES - FREE} of them now" in done.output
    assert count_rows(out) == CASES
    assert (out / "table.parquet").read_bytes() == table


@pytest.fixture
def cluster(tmp_path, gate):
    """Address of a scheduler, and its two workers, of one thread each."""
    told = tmp_path / "scheduler.json"
    dask = (sys.executable, "-m", "dask")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [*dask, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", told],
        **quiet,
        env=os.environ
        | {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"},  # the study itself sends a lost batch again
    )
    alone = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
    every = (*dask, "worker", "--scheduler-file", told, "--preload", HELD, *alone)
    workers = [subprocess.Popen(every, **quiet, cwd=tmp_path) for _ in range(2)]
    try:
        while not (told.exists() and told.read_text().endswith("}")):  # the file is there before its text
            assert scheduler.poll() is None
            time.sleep(0.05)
        yield json.loads(told.read_text())["address"], workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


@pytest.mark.long
def test_a_cluster_gives_the_same_table_though_a_worker_is_killed(plain, gate, tmp_path, cluster):
    file, table = plain
    address, workers = cluster
    out = tmp_path / "out"
    begun = subprocess.Popen([*PROGRAM, file, "--cluster", address, "--out", out], stdout=subprocess.DEVNULL)
    held = wait_at(gate, out, begun)
    assert sorted(held) == sorted(worker.pid for worker in workers)
    workers[0].kill()
    gate.unlink()
    assert begun.wait(timeout=PATIENCE) == 0
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
