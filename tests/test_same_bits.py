"""The same scene gives the same plan, log and report, bit for bit, on any number of threads and from any folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description.shipped import list_shipped
from vgtsim.site import load_site

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
WAY = 0.04  # m, from the start to the goal: a short run
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# set to 4: a thread that waits sleeps after 2^4 ticks, not 2^26, in which it would take a core from the run
ASLEEP = "OPENBLAS_THREAD_TIMEOUT"
PROGRAM = """
import sys, numpy as np, vgtsim
from vgtsim.digests import digest
site = vgtsim.load(sys.argv[1])
tour = vgtsim.plan(site)
log = vgtsim.run(site, tour)
report = vgtsim.verify(site, log, tour)
arrays = {name: value for name, value in vars(log).items() if isinstance(value, np.ndarray)}
print(digest(tour.digest.encode()), len(log.time), report.passed)
print(digest(*(value.tobytes() for value in arrays.values())))
print(digest(repr(report.to_dict()["checks"]).replace(sys.argv[1], "").encode()))
print(digest(*(value.tobytes() for value in report.series.values())), log.digests)
"""


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Two folders with the same scene: the nine-actuator arm with one goal beside its start, held shortly."""
    site = load_site("arm9_nullspace")
    position, direction = site.chain.tool(site.start)
    goal = np.round(position + [0.0, 0.0, WAY], 4).tolist()
    found = []
    for name in ("here", "there"):
        folder = tmp_path_factory.mktemp(name)
        shutil.copytree(list_shipped("scene")["arm9_nullspace"].parent, folder / "scenes")
        shutil.copytree(list_shipped("arm")["arm9"].parent, folder / "models" / "arm9")
        text = f'base = "arm9_nullspace.toml"\n[motion]\nhold = "0.2 s"\n[[motion.goals]]\nname = "beside"\nposition = {goal}\n'
        (folder / "scenes" / "short.toml").write_text(f"{text}direction = {np.round(direction, 6).tolist()}\n")
        found.append(folder)
    return found


def tell(folder: Path, threads: int) -> str:
    env = os.environ | {"PYTHONPATH": str(ROOT), ASLEEP: "4"} | dict.fromkeys(THREADS, str(threads))
    words = [sys.executable, "-c", PROGRAM, "scenes/short.toml"]
    return subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, check=True).stdout


def test_threads_and_folders_change_no_bit(places):
    here, there = places
    once, again = tell(here, 1), tell(there, 4)
    assert once == again
    assert once.splitlines()[0].endswith("True")  # the run passes
