"""Files that are wrong in seeded ways, and what each verb of the command line makes of them.

A case is made of shipped descriptions, one of them mutated, and of a verb. It runs in a child process that is forked from a
warm one, with limits of processor time and memory. Whatever is wrong with the input, it has to end with one of the statuses of
bad input, without a traceback, and in time; a success prints no `nan`.
"""

from __future__ import annotations

import os
import random
import re
import resource
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
CPU = 60  # s of processor time after which a case hangs: three times the slowest verb on these arms
WALL = 10 * CPU  # s, for one that waits: others may share the processor
MEMORY = 6 << 30  # bytes of address space: several times that of a good case
SOUND = frozenset({0, 1, 2, 3, 4})
ARMS = ("tetra4", "stewart", "octahedron_double", "octahedron_general", "octahedron_offset", "arm9")
CAPABLE = ("octahedron_double", "arm9")  # arms that `capacity` maps
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
LITERAL = re.compile(r'"[^"\n]*"|(?<![\w"])-?\d[\d.e+-]*')
HOSTILE = (
    *(
        "0",
        "-1",
        "1",
        "nan",
        "inf",
        "-inf",
        "1e-300",
        "5e-324",
        "1e300",
        "1e200",
        "1e9",
        "1e-9",
        "1e17",
        "true",
        "[]",
        "{}",
    ),
    *(
        "9" * 400,
        "9" * 5000,
        "0x" + "f" * 5000,
        "1979-05-27",
        '"9**9**9 kg"',
        '"1 kg**9**9"',
        '"' + "m" * 100_000 + '"',
    ),
    *(
        '"0 m"',
        '"-1 m"',
        '"1e200 m"',
        '"1e-300 m"',
        '"75e9 ft"',
        '"1e9 kg"',
        '"1e-9 kg/m**3"',
        '"1e-6 s"',
        '"5e-324 s"',
    ),
    *(
        '"1e-300 1/s"',
        '"1e300 Pa"',
        '"1,5 m"',
        '"\u22121 m"',
        '"3 1/2 in"',
        '"1 m\\u0000"',
        '"../../../etc/passwd"',
        '"/dev/zero"',
    ),
    *('"\\u0000"', '"[/]"', '"-->"', '"$x^{$"', '"<script>"', '"\\u001b[31m"', '""', '"none"', '"steel"', "[1, 2]"),
    *('["1 m", "1 m", "1 m"]', "[" * 2000 + "]" * 2000, '"1 in"', '"1 deg"', '"89.999 deg"', '"180 deg"'),
)
LINES = (
    "[",
    "[[modules]]",
    "[materials.steel]",
    "[value]",
    'base = "scene.toml"',
    "\x00",
    "provenance = 1",
    "x" * 100_000,
)


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
    """Write an arm, a tank, a scene, a path and a catalogue, all good."""
    scene = (ROOT / "scenes/arm9_nullspace.toml").read_text()
    scene = scene.replace("../models/arm9/arm9.toml", "arm.toml").replace("tanks/type_ii.toml", "tank.toml")
    scene = re.sub(
        r"(\[\[motion\.goals\]\].*?)\[\[motion\.goals\]\].*(?=\[limits\])", r"\1", scene, flags=re.DOTALL
    )  # one goal
    (folder / "scene.toml").write_text(scene.replace('hold = { value = "2 s"', 'hold = { value = "1 s"'))
    (folder / "arm.toml").write_text((ROOT / f"models/{arm}/{arm}.toml").read_text())
    (folder / "tank.toml").write_text((ROOT / "scenes/tanks/type_ii.toml").read_text())
    (folder / "path.toml").write_text(PATH)
    (folder / "catalogue.toml").write_text((ROOT / "vgtsim/description/catalogue.toml").read_text())


def make_case(seed: int, folder: Path) -> Case:
    """Write the files of a case into an empty folder; the same seed makes the same case."""
    rng = random.Random(seed)
    verb = rng.choice(
        ("show", "show", "build", "build", "workspace", "capacity", "ik", "ik", "track", "size", "run", "models")
    )
    whole = verb in ("run", "size", "track") or (verb in ("build", "ik") and rng.random() < 0.5)
    write_files(folder, "arm9" if whole or verb == "ik" else rng.choice(CAPABLE if verb == "capacity" else ARMS))
    if not whole:
        targets: tuple[str, ...] = ("arm.toml",)
    else:
        targets = ("arm.toml", "tank.toml", "scene.toml", "scene.toml")
        targets += ("path.toml",) * 2 if verb == "track" else ("catalogue.toml",) if verb == "size" else ()
    target = rng.choice(targets)
    done = [_mutate(folder / target, rng) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    return Case(seed, _make_words(verb, whole, folder, rng), tuple(f"{target}: {text}" for text in done))


def _make_words(verb: str, whole: bool, folder: Path, rng: random.Random) -> tuple[str, ...]:
    description, out = str(folder / ("scene.toml" if whole else "arm.toml")), ("--out", str(folder / "out"))
    arm = str(folder / "arm.toml")

    def number(good: str) -> str:
        return (
            good
            if rng.random() < 0.95
            else rng.choice(("nan", "inf", "1e300", "-1", "0", "1e-300", "x", "1_0", "9" * 400))
        )

    if verb == "models":
        (folder / "arms/arm").mkdir(parents=True)
        os.rename(folder / "arm.toml", folder / "arms/arm/arm.toml")
        return verb, str(folder / "arms")
    if verb in ("show", "build"):
        return verb, arm if verb == "show" else description, *out
    if verb == "workspace":
        return verb, arm, "--samples", number("200"), "--seed", number("1"), *out
    if verb == "capacity":
        return verb, arm, "--payload", number("100"), "--safety-factor", number("1.67"), "--plane-only", *out
    if verb == "ik":
        goal = (
            (number("-5.08"), number("6.05"), number("2.4")) if whole else (number("4.5"), number("0"), number("-8.4"))
        )
        direction = (number("-0.637"), "0.759", "-0.139") if whole else ("0.7", "0", number("-0.7"))
        return verb, description, "--position", *goal, "--direction", *direction
    if verb == "track":
        return verb, description, "--path", str(folder / "path.toml"), *out
    if verb == "size":
        choice = ("--catalogue", str(folder / "catalogue.toml"), "--reserve", number("0.05"), "--tour-only")
        return verb, arm, "--task", str(folder / "scene.toml"), *choice, "--out", str(folder / "sized.toml")
    return verb, description, *out


def _mutate(file: Path, rng: random.Random) -> str:
    """Change a file, and say how."""
    if not file.is_file() or file.is_symlink() or rng.random() < 0.04:
        return _replace_file(file, rng)
    if rng.random() < 0.1:
        return _mutate_bytes(file, rng)
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return _mutate_bytes(file, rng)
    entries = [i for i, line in enumerate(lines) if " = " in line and not line.startswith("#")] or [0]
    place = rng.choice(entries)
    old = lines[place] if lines else ""
    choice = rng.random()
    if choice < 0.72:
        new = _mutate_value(old, rng)
    elif choice < 0.78:
        new = ""
    elif choice < 0.82:
        new = f"{old}\n{old}"
    elif choice < 0.88:
        name, sign, value = old.partition(" = ")
        new = (
            rng.choice((name[:-1], f"{name}.{name}", f'"{name}\\u0000"', ".".join(["a"] * 3000), "value"))
            + sign
            + value
        )
    elif choice < 0.94:
        new = lines[rng.choice(entries)]
    else:
        new = rng.choice(LINES)
    lines[place : place + 1] = [new]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return f"{_cut(old)} -> {_cut(new)}"


def _mutate_value(line: str, rng: random.Random) -> str:
    """Put another value in the place of one in a line: a hostile one, or the same number with another size or sign."""
    name, sign, value = line.partition(" = ")
    found = list(LITERAL.finditer(value))
    if not found:
        return f"{name}{sign}{rng.choice(HOSTILE)}"
    item = found[0] if rng.random() < 0.85 else rng.choice(found[:2])
    number = re.search(r"-?\d[\d.]*(?:e-?\d+)?", item[0])
    if number and rng.random() < 0.75:
        far = 10 ** rng.uniform(-14, 14)
        factor = rng.choice((-1.0, 0.0, 0.5, 0.8, 0.9, 0.97, 0.99, 1.01, 1.03, 1.1, 1.3, 2.0, 0.2, 5.0, far, far))
        new = item[0].replace(number[0], repr(float(number[0].rstrip(".")) * factor), 1)
    else:
        new = rng.choice(HOSTILE)
    value = value[: item.start()] + new + value[item.end() :]
    if rng.random() < 0.8:
        value = re.sub(
            r", range = \[[^\]]*\]", "", value
        )  # it would refuse most figures before anything else sees them
    return name + sign + value


def _mutate_bytes(file: Path, rng: random.Random) -> str:
    content, place = bytearray(file.read_bytes()), 0
    kind = rng.choice(("bom", "utf-16", "latin-1", "flip", "insert", "cut", "nothing"))
    if content:
        place = rng.randrange(len(content))
    if kind == "bom":
        content[:0] = b"\xef\xbb\xbf"
    elif kind == "utf-16":
        content = bytearray(bytes(content).decode("latin-1").encode("utf-16"))
    elif kind == "latin-1":
        content[place:place] = b"\xe9"
    elif kind == "flip" and content:
        content[place] ^= 1 << rng.randrange(8)
    elif kind == "insert":
        content[place:place] = rng.randbytes(8)
    elif kind == "cut":
        del content[place:]
    else:
        content.clear()
    file.write_bytes(content)
    return f"bytes: {kind} at {place}"


def _replace_file(file: Path, rng: random.Random) -> str:
    kind = rng.choice(("pipe", "folder", "loop", "zero", "large", "gone", "chain", "itself"))
    if file.is_file() or file.is_symlink():
        file.unlink()
    elif file.exists():
        return "left as it is"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "loop":
        file.symlink_to(file.name)
    elif kind == "zero":
        file.symlink_to("/dev/zero")
    elif kind == "large":
        file.write_text("x = 1\n" * 400_000)
    elif kind == "chain":
        for i in range(1500):
            (file.parent / f"base{i}.toml").write_text(f'base = "base{i + 1}.toml"\n')
        file.write_text('base = "base0.toml"\n')
    elif kind == "itself":
        file.write_text(f'base = "{file.name}"\n')
    return f"the file is {kind}"


def _cut(text: str) -> str:
    return repr(text if len(text) < 120 else f"{text[:100]}... ({len(text)})")


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
    import vgtsim.verification  # noqa: F401
    from vgtsim.units import to_si

    to_si("1 in", "m")
