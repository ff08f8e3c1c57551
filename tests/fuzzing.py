"""Files that are wrong in seeded ways, and what each verb of the command line makes of them.

A case is made of shipped descriptions, or of the folder of a short run, with something of them mutated, and of a verb. It runs
in a child process that is forked from a warm one, with limits of processor time and memory. Whatever is wrong with the input, it
has to end with one of the statuses of bad input, without a traceback, and in time; a success prints no `nan`.
"""

from __future__ import annotations

import os
import random
import re
import resource
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from mutating import mutate
from mutating_logs import mutate_run

from vgtsim.description import load_catalogue, load_study, load_tank, load_tool_path
from vgtsim.errors import VgtError
from vgtsim.logbook import open_log
from vgtsim.site import load_arm, load_site

ROOT = Path(__file__).parents[1]
CPU = 60  # s of processor time after which a case hangs: three times the slowest verb on these arms
WALL = 10 * CPU  # s, for one that waits: others may share the processor
MEMORY = 6 << 30  # bytes of address space: several times that of a good case
SOUND = frozenset({0, 1, 2, 3, 4})
ARMS = ("tetra4", "stewart", "octahedron_double", "octahedron_general", "octahedron_offset", "arm9")
CAPABLE = ("octahedron_double", "arm9")  # arms that `capacity` maps
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
ODD = (
    "nan",
    "inf",
    "1e300",
    "-1",
    "0",
    "1e-300",
    "x",
    "1_0",
    "9" * 400,
)  # on the command line, in the place of a number
RUNS = {"tour": "near", "operation": "driven"}  # folder of a run, and the scene that it is of
SCENE = ("arm.toml", "tank.toml", "scene.toml", "scene.toml")
DRIVEN = """
base = "scene.toml"
name = "driven"

[operator]
record = "record.jsonl"

[simulation]
log_rate = "200 Hz"
timestep = "5 ms"

[motion]
goals = []
"""
NEAR = """
base = "scene.toml"
name = "near"

[motion]
objective = ["length_variation"]
hold = "0.2 s"
acceleration = "0.1 m/s**2"

[[motion.goals]]
name = "near"
position = [-7.5404, 1.3296, 2.0172]
direction = [-0.95125, 0.16773, -0.25882]

[simulation]
log_rate = "10 Hz"
"""
RECORD = """{"time":0.05,"twist":[0.05,0.0,0.02,0.0,0.0,0.1]}
{"time":0.2,"goal":[-7.54,1.34,2.02,-0.951,0.168,-0.259],"method":"newton"}
{"time":0.4,"inputs":[-0.296,-0.052,0.495,-0.255,-0.045,0.495,-0.086,-0.015,0.495],"objective":["mid_stroke"]}
{"time":0.5,"hold":true}
{"time":0.6,"hold":true}
"""
STUDY = """
name = "several"
scene = "scene.toml"
work = { verb = "VERB" }
keep = []

[grid]
scene.payload.mass = { least = "500 lb", greatest = "2000 lb", count = 2 }
arm.materials.steel.yield_strength = ["250 MPa"]
"""
PATH = """
name = "line"
start = ["-5.08 m", "6.05 m", "2.40 m"]
direction = [-0.637, 0.759, -0.139]
tolerance = "0.1 mm"
rate_fraction = 0.8
acceleration = "0.05 m/s**2"
speed = "0.25 m/s"

[[pieces]]
shape = "line"
to = ["-5.00 m", "6.05 m", "2.45 m"]

[[pieces]]
shape = "raster"
width = [0.0, "0.1 m", 0.0]
depth = ["-0.05 m", 0.0, 0.0]
rows = 2
"""


@dataclass(frozen=True)
class Case:
    """A folder of files, the words of a command line, and what was done to the files."""

    seed: int
    words: tuple[str, ...]
    mutations: tuple[str, ...]


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


def write_files(folder: Path, arm: str) -> None:
    """Write good files of every kind: a scene, one that an operator drives, one that goes 5 mm, and all that they name."""
    for name, text in _read_files(arm).items():
        (folder / name).write_text(text)


@lru_cache(maxsize=len(ARMS))
def _read_files(arm: str) -> dict[str, str]:
    """Texts of the good files, by name."""
    scene = (ROOT / "scenes/arm9_nullspace.toml").read_text()
    scene = scene.replace("../models/arm9/arm9.toml", "arm.toml").replace("tanks/type_ii.toml", "tank.toml")
    one = r"(\[\[motion\.goals\]\].*?)\[\[motion\.goals\]\].*(?=\[limits\])"
    scene = re.sub(one, r"\1", scene, flags=re.DOTALL)  # one goal
    scene = scene.replace("speed = 4.0", "speed = 1.0\nwidth = 160\nheight = 120\nfps = 5")
    return {
        "scene.toml": scene.replace('hold = { value = "2 s"', 'hold = { value = "1 s"'),
        "driven.toml": DRIVEN,
        "near.toml": NEAR,
        "record.jsonl": RECORD,
        "arm.toml": (ROOT / f"models/{arm}/{arm}.toml").read_text(),
        "tank.toml": (ROOT / "scenes/tanks/type_ii.toml").read_text(),
        "path.toml": PATH,
        "catalogue.toml": (ROOT / "vgtsim/description/catalogue.toml").read_text(),
        "study.toml": STUDY.replace("VERB", "ik"),
    }


@dataclass(frozen=True)
class Verb:
    """How often a verb is tried, the arms and files it is tried on, and what follows it on the command line.

    `{out}`, `{arm}` and the like stand for paths in the folder, `<100>` for a number that may be an odd one.
    """

    share: int
    targets: tuple[str, ...]
    words: tuple[str, ...]
    arms: tuple[str, ...] = ("arm9",)


VERBS = (
    Verb(12, ("arm.toml",), ("check", "{arm}"), ARMS),
    Verb(12, (*SCENE, "path.toml"), ("check", "{scene}")),
    Verb(4, ("tank.toml",), ("check", "{tank}")),
    Verb(4, ("path.toml",), ("check", "{path}")),
    Verb(4, ("study.toml",), ("check", "{study}")),
    Verb(3, ("arm.toml",), ("show", "{arm}", "--out", "{out}"), ARMS),
    Verb(1, (*SCENE,), ("show", "{scene}", "--out", "{out}")),
    Verb(6, ("arm.toml",), ("build", "{arm}", "--out", "{out}"), ARMS),
    Verb(6, SCENE, ("build", "{scene}", "--out", "{out}")),
    Verb(4, ("arm.toml",), ("workspace", "{arm}", "--samples", "<200>", "--seed", "<1>", "--out", "{out}"), ARMS),
    Verb(
        *(6, ("arm.toml",)),
        ("capacity", "{arm}", "--payload", "<100>", "--safety-factor", "<1.67>", "--plane-only", "--out", "{out}"),
        CAPABLE,
    ),
    Verb(
        *(6, SCENE),
        ("ik", "{scene}", "--position", "<-5.08>", "<6.05>", "<2.4>", "--direction", "<-0.637>", "0.759", "-0.139"),
    ),
    Verb(
        *(6, ("arm.toml",)),
        ("ik", "{arm}", "--position", "<4.5>", "<0>", "<-8.4>", "--direction", "<0.7>", "0", "<-0.7>"),
    ),
    Verb(1, (*SCENE, "path.toml", "path.toml"), ("track", "{scene}", "--path", "{path}", "--out", "{out}")),
    Verb(
        *(2, (*SCENE, "catalogue.toml")),
        ("size", "{arm}", "--task", "{scene}", "--catalogue", "{catalogue}", "--reserve", "<0.05>", "--tour-only"),
    ),
    Verb(8, (*SCENE, "near.toml"), ("run", "{near}", "--out", "{out}")),
    Verb(6, (*SCENE, "driven.toml", *("record.jsonl",) * 8), ("run", "{driven}", "--out", "{out}")),
    Verb(1, ("arm.toml",), ("models", "{folder}"), ARMS),
    Verb(6, (*SCENE, *("study.toml",) * 8), ("study", "{study}", "--out", "{out}")),
    Verb(25, ("tour",), ("verify", "{tour}")),
    Verb(25, ("tour",), ("verify", "{tour}", "--no-plan")),
    Verb(12, ("operation",), ("verify", "{operation}")),
    Verb(12, ("tour", "arm.toml", "near.toml"), ("verify", "{tour}")),  # against the scene's file
    Verb(10, ("tour",), ("export", "{tour}", "--time", "<0.3>")),
    Verb(3, ("tour",), ("render", "{tour}")),
    Verb(6, ("tour/scene.xml", "tour/scene.mjb"), ("view", "{tour}/scene.xml")),
    Verb(6, ("tour/scene.mjb",), ("view", "{tour}/scene.mjb")),
    Verb(4, ("tour",), ("run", "{near}", "--resume", "--out", "{tour}")),
    Verb(2, ("catalogue.toml",), ("new", "arm", "{new}", "--reach", "<9> m", "--riser", "<1> m", "--modules", "<3>")),
    Verb(2, ("arm.toml",), ("new", "scene", "{new}", "--arm", "{arm}", "--tank", "type_ii", "--goals", "<2>")),
    Verb(2, ("tank.toml",), ("new", "scene", "{new}", "--arm", "arm9", "--tank", "{tank}", "--goals", "<2>")),
)


def make_case(seed: int, folder: Path, runs: Path) -> Case:
    """Write the files of a case into an empty folder; the same seed makes the same case. `runs` is that of `make_runs`."""
    rng = random.Random(seed)
    verb = rng.choices(VERBS, [verb.share for verb in VERBS])[0]
    write_files(folder, rng.choice(verb.arms))
    for name in RUNS:
        if any(f"{{{name}}}" in word for word in verb.words):
            left = shutil.ignore_patterns("scene.*" if verb.words[0] != "view" else "log", "report.html")
            shutil.copytree(runs / name, folder / name, ignore=left)
    if "study.toml" in verb.targets:
        (folder / "study.toml").write_text(_choose_work(rng))
    target = rng.choice(verb.targets)
    place = _interrupt(folder / "tour") if "--resume" in verb.words else folder / target
    spoil = mutate_run if target in RUNS else mutate
    done = [spoil(place, rng) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    if verb.words[0] == "models":
        (folder / "arms/arm").mkdir(parents=True)
        os.rename(folder / "arm.toml", folder / "arms/arm/arm.toml")
    return Case(seed, _fill(verb.words, folder, rng), tuple(f"{target}: {text}" for text in done))


def _choose_work(rng: random.Random) -> str:
    """A study of two cases, of any verb."""
    work = rng.choice(("run", "plan", "ik", "ik", "workspace", "workspace", "capacity"))
    more = {"workspace": ", samples = 10, seed = 1", "capacity": ", shapes = 10, seed = 1"}.get(work, "")
    return STUDY.replace('"VERB"', f'"{work}"{more}')


def _interrupt(folder: Path) -> Path:
    """Make the folder of a run one of a run that was killed; gives the folder of what is there."""
    unfinished = folder.with_name("unfinished")
    folder.rename(unfinished)
    folder.mkdir()
    unfinished.rename(folder / "unfinished")
    (folder / "unfinished/log/_end.json").unlink()
    return folder / "unfinished"


def load_spoilt(seed: int, folder: Path, runs: Path) -> Outcome:
    """Spoil one file, or the log of a run, and load it in this process: quicker by far than a verb."""
    rng = random.Random(seed)
    target = rng.choice((*LOADERS, "scene.toml", *RUNS))
    write_files(folder, rng.choice(ARMS) if target == "arm.toml" else "arm9")
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


def _fill(words: tuple[str, ...], folder: Path, rng: random.Random) -> tuple[str, ...]:
    """The words of a verb with paths and numbers."""

    def number(found: re.Match[str]) -> str:
        return found[1] if rng.random() < 0.95 else rng.choice(ODD)

    def path(found: re.Match[str]) -> str:
        name = {"folder": "arms", "out": "out", "new": "made.toml"}.get(found[1])
        return str(folder / (name or (found[1] if found[1] in RUNS else f"{found[1]}.toml")))

    return tuple(re.sub(r"\{(\w+)\}", path, re.sub("<([^>]*)>", number, word)) for word in words)


def make_runs(folder: Path) -> None:
    """Make the runs whose folders are spoilt, in a folder of their own: a tour of 5 mm, and one second of an operator."""
    write_files(folder, "arm9")
    for name, scene in RUNS.items():
        case = Case(0, ("run", str(folder / f"{scene}.toml"), "--out", str(folder / name)), ())
        outcome = run_case(case, folder)
        if outcome.status not in (0, 1):
            raise RuntimeError(outcome.output)


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
        _go_without(case.seed % DRAWN != 0)
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


def _go_without(plots: bool) -> None:
    """Let `study` work in a thread, as processes of its own would import all again; leave out the plots of a report."""
    import vgtsim.output.html_report
    import vgtsim.study

    def use_thread(_workers: int) -> nullcontext[vgtsim.study.Engine]:
        return nullcontext(vgtsim.study.Engine("here", lambda: ThreadPoolExecutor(1), 2, ()))

    vgtsim.study.use_processes = use_thread
    if plots:
        vgtsim.output.html_report._draw = lambda plot, _: {
            "name": plot.name,
            "lacking": ["time"],
            "title": "",
            "caption": "",
        }


def warm_up() -> None:
    """Import what the verbs import, so that a child has it at once."""
    import vgtsim.cli
    import vgtsim.mjcf
    import vgtsim.output.maps
    import vgtsim.output.track_files
    import vgtsim.planning.capacity
    import vgtsim.planning.design
    import vgtsim.planning.following
    import vgtsim.planning.resolution
    import vgtsim.plant
    import vgtsim.study
    import vgtsim.verification  # noqa: F401
    from vgtsim.units import to_si

    to_si("1 in", "m")
