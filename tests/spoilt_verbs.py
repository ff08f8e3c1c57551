"""What is spoilt for each verb of the command line, and the words that it is called with."""

from __future__ import annotations

import os
import random
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from good_files import ARMS, SHORT, STUDY, write_files
from mutating import mutate
from mutating_logs import mutate_run

CAPABLE = ("octahedron_double", SHORT)  # arms that `capacity` maps
RUNS = {"tour": "near", "operation": "driven"}  # folder of a run, and the scene that it is of
SCENE = ("arm.toml", "tank.toml", "scene.toml", "scene.toml")
ODD = ("nan", "inf", "1e300", "-1", "0", "1e-300", "x", "1_0", "9" * 400)  # in the place of a number of a command line


@dataclass(frozen=True)
class Case:
    """A folder of files, the words of a command line, and what was done to the files."""

    seed: int
    words: tuple[str, ...]
    mutations: tuple[str, ...]


@dataclass(frozen=True)
class Verb:
    """How often a verb is tried, the arms and files it is tried on, and what follows it on the command line.

    `{out}`, `{arm}` and the like stand for paths in the folder, `<100>` for a number that may be an odd one.
    """

    share: int
    targets: tuple[str, ...]
    words: tuple[str, ...]
    arms: tuple[str, ...] = (SHORT,)


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
        ("ik", "{scene}", "--position", "<-4.167>", "<0.7>", "<2.5>", "--direction", "<-0.855>", "0.138", "-0.5"),
    ),
    Verb(
        *(6, ("arm.toml",)),
        ("ik", "{arm}", "--position", "<3.93>", "<0>", "<-5.17>", "--direction", "<0.788>", "0", "<-0.615>"),
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
    place = interrupt(folder / "tour") if "--resume" in verb.words else folder / target
    spoil = mutate_run if target in RUNS else mutate
    done = [spoil(place, rng) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    if verb.words[0] == "models":
        (folder / "arms/arm").mkdir(parents=True)
        if os.path.lexists(folder / "arm.toml"):  # a mutation may be that it is gone
            os.rename(folder / "arm.toml", folder / "arms/arm/arm.toml")
    return Case(seed, fill(verb.words, folder, rng), tuple(f"{target}: {text}" for text in done))


def _choose_work(rng: random.Random) -> str:
    """A study of two cases, of any verb."""
    work = rng.choice(("run", "plan", "ik", "ik", "workspace", "workspace", "capacity"))
    more = {"workspace": ", samples = 10, seed = 1", "capacity": ", shapes = 10, seed = 1"}.get(work, "")
    return STUDY.replace('"VERB"', f'"{work}"{more}')


def interrupt(folder: Path) -> Path:
    """Make the folder of a run one of a run that was killed; gives the folder of what is there."""
    unfinished = folder.with_name("unfinished")
    folder.rename(unfinished)
    folder.mkdir()
    unfinished.rename(folder / "unfinished")
    (folder / "unfinished/log/_end.json").unlink()
    return folder / "unfinished"


def fill(words: tuple[str, ...], folder: Path, rng: random.Random | None = None) -> tuple[str, ...]:
    """The words of a verb with paths and numbers, of which some are odd where a generator is given."""

    def number(found: re.Match[str]) -> str:
        return found[1] if rng is None or rng.random() < 0.95 else rng.choice(ODD)

    def path(found: re.Match[str]) -> str:
        name = {"folder": "arms", "out": "out", "new": "made.toml"}.get(found[1])
        return str(folder / (name or (found[1] if found[1] in RUNS else f"{found[1]}.toml")))

    return tuple(re.sub(r"\{(\w+)\}", path, re.sub("<([^>]*)>", number, word)) for word in words)
