"""Files that are wrong in seeded ways, and what each verb of the command line makes of them.

A case is made of shipped descriptions, or of the folder of a short run, with something of them mutated, and of a verb. It runs
in a child process that is forked from a warm one, with limits of processor time and memory. Whatever is wrong with the input, it
has to end with one of the statuses of bad input, without a traceback, and in time; a success prints no `nan`.
"""

from __future__ import annotations

import io
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir, nullcontext, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from good_files import ARMS, SHORT, write_files
from mutating import mutate
from mutating_logs import mutate_run
from spoilt_verbs import RUNS, VERBS, Case, fill
from synthetic_run import leave_out_plots

from vgtsim.description import load_catalogue, load_study, load_tank, load_tool_path
from vgtsim.errors import VgtError
from vgtsim.log import open_log
from vgtsim.site import load_arm, load_site

CPU = 60  # s of processor time after which a case hangs: three times the slowest verb on these arms
WALL = 60 * CPU  # s, for one that waits: many others may share the processor
MEMORY = 6 << 30  # bytes of address space: several times that of a good case
SOUND = frozenset({0, 1, 2, 3, 4})
_WINDOWS = ("render", "view")  # verbs that open a context of OpenGL, which no fork may share
LOADS = 20  # s after which a loader hangs
LOADERS: dict[str, Callable[[Path], object]] = {
    "arm.toml": load_arm,
    "tank.toml": load_tank,
    "scene.toml": load_site,
    "driven.toml": load_site,
    "record.jsonl": load_site,
    "path.toml": load_tool_path,
    "catalogue.toml": load_catalogue,
    "study.toml": load_study,
}
DRAWN = 5  # one report in so many has its plots, which take nine tenths of its time


@dataclass(frozen=True)
class Outcome:
    """How a case ended: its exit status, or minus the number of the signal that ended it, its output, processor time, s."""

    case: Case
    status: int
    output: str
    seconds: float

    @property
    def fault(self) -> str:
        """What is wrong with the way it ended; empty if it ended as it has to."""
        if self.status not in SOUND:
            return f"ended with {self.status}"
        if "Traceback (most recent" in self.output:
            return "printed a traceback"
        if self.status == 0 and re.search(r"\b(nan|inf)\b", self.output):
            return "a success printed nan or inf"
        if self.status == 2 and "rror" not in self.output:
            return "refused without a word"
        return ""


def load_spoilt(seed: int, folder: Path, runs: Path) -> Outcome:
    """Spoil one file, or the log of a run, and load it in this process: quicker by far than a verb."""
    rng = random.Random(seed)
    target = rng.choice((*LOADERS, "scene.toml", *RUNS))
    write_files(folder, rng.choice(ARMS) if target == "arm.toml" else SHORT)
    if target in RUNS:
        shutil.copytree(runs / target, folder / target, ignore=shutil.ignore_patterns("scene.*", "report.*"))
    spoil = mutate_run if target in RUNS else mutate
    done = tuple(f"{target}: {spoil(folder / target, rng)}" for _ in range(rng.choice((1, 1, 1, 2, 3))))
    start, status, told = time.process_time(), 0, ""
    signal.signal(signal.SIGALRM, _stop)
    signal.alarm(LOADS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _load(folder, target)
    except VgtError as error:
        status, told = 2, f"error: {error}"
    except BaseException:
        status, told = 70, traceback.format_exc()
    finally:
        signal.alarm(0)
    return Outcome(Case(seed, ("load", target), done), status, told, time.process_time() - start)


def _load(folder: Path, target: str) -> None:
    """Read a file, or each array of a log."""
    if target in RUNS:
        book = open_log(folder / target / "log")
        book.read(0, book.count)
    else:
        LOADERS[target](folder / ("driven.toml" if target == "record.jsonl" else target))


def _stop(*_: object) -> None:
    raise TimeoutError(f"longer than {LOADS} s")


def make_runs(folder: Path, cases: int) -> None:
    """Make the runs whose folders are spoilt: a tour of 5 mm, and one second of an operator; then warm verbs up on them.

    All in this process: a child then has at once what a verb imports and compiles, which takes longer than most cases. Verbs
    of which so many cases have no two stay cold: one child then does what the warming would have done.
    """
    _make_light()
    write_files(folder, SHORT)
    with pytest.MonkeyPatch.context() as patch:  # no case reads the plots of these
        leave_out_plots(patch)
        for name, scene in RUNS.items():
            status, printed = _call(("run", str(folder / f"{scene}.toml"), "--out", str(folder / name)))
            if status not in (0, 1):
                raise RuntimeError(printed)
    shares: Counter[str] = Counter()
    for verb in VERBS:
        shares[verb.words[0]] += verb.share
    often = {name for name, share in shares.items() if cases * share >= 2 * shares.total()} - {*_WINDOWS}
    with tempfile.TemporaryDirectory() as name, chdir(name):  # `size` writes where it is called
        copy = Path(name) / "runs"
        shutil.copytree(folder, copy)
        for words in {verb.words[0]: verb.words for verb in VERBS if verb.words[0] in often}.values():
            _call(fill(words, copy))


def _call(words: tuple[str, ...]) -> tuple[int, str]:
    """Run a command line in this process: its exit status and what it printed."""
    from vgtsim.cli import main

    sys.argv, printed = ["vgtsim", *words], io.StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(printed):
            main()
    except SystemExit as error:
        return (error.code if isinstance(error.code, int) else 0 if error.code is None else 1), printed.getvalue()
    return 0, printed.getvalue()


def run_case(case: Case, folder: Path) -> Outcome:
    """Run the command line of a case in a forked child, and say how it ended."""
    start, output = time.monotonic(), folder / "printed.txt"
    child = os.fork()
    if child == 0:
        _become(case, folder, output)
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() - start > WALL:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.01)
    code = os.waitstatus_to_exitcode(status)
    return Outcome(case, code, output.read_text(errors="replace"), used.ru_utime + used.ru_stime)


def _become(case: Case, folder: Path, output: Path) -> None:
    """Be the child: run the verb and leave, whatever happens."""
    status = 99
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        printed = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        for stream in (0, 1, 2):
            os.dup2(os.open(os.devnull, os.O_RDONLY) if stream == 0 else printed, stream)
        sys.stdout, sys.stderr = (os.fdopen(stream, "w") for stream in (1, 2))  # not those of pytest
        os.chdir(folder)
        os.environ["TMPDIR"] = str(folder)
        os.environ.pop("DISPLAY", None)
        if case.seed % DRAWN:
            leave_out_plots(pytest.MonkeyPatch())
        sys.argv = ["vgtsim", *case.words]
        from vgtsim.cli import main

        try:
            main()
            status = 0
        except SystemExit as error:
            status = error.code if isinstance(error.code, int) else 0 if error.code is None else 1
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(status)


def _make_light() -> None:
    """Let `study` work in a thread, as processes of its own would import all again."""
    import vgtsim.study

    def use_thread(_workers: int) -> nullcontext[vgtsim.study.Engine]:
        return nullcontext(vgtsim.study.Engine("here", lambda: ThreadPoolExecutor(1), 2, ()))

    vgtsim.study.use_processes = use_thread
