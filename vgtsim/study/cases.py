"""From a study's file to its cases, each with a digest by which its row is known again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from importlib.metadata import version
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Axis, Description, Scene, Span, Steps, Study, change_entries, dump_scene, locate
from vgtsim.errors import DescriptionError
from vgtsim.study.verbs import VERBS
from vgtsim.units import to_base

_MOST = 10_000_000  # cases: those of a study are held in memory, some 300 bytes each
_KEPT = ("vgtsim", "mujoco", "numba", "numpy", "scipy")  # packages whose versions a figure may hang on


@dataclass(frozen=True)
class Case:
    """One case: the entries of the keys, in their order, as written or, of spans, in SI base units."""

    digest: str
    entries: tuple[Any, ...]


@dataclass(frozen=True)
class Order:
    """All that the cases of a study have in common; it is sent to the workers.

    Attributes:
        scene: Text of the scene, as `dump_scene` writes it.
        steps: Way to the entry of each key.
        figures: Whether the entries of each key are figures.
        columns: Names of what is kept of each case.
        folder: Of the study; runs may leave their own folders there.
        versions: Version of each package that figures may hang on.
    """

    scene: str
    work: Description
    keys: tuple[str, ...]
    steps: tuple[Steps, ...]
    figures: tuple[bool, ...]
    columns: tuple[str, ...]
    folder: Path
    versions: tuple[tuple[str, str], ...]

    @cached_property
    def _common(self) -> str:
        whole = [self.scene, self.work.model_dump(mode="json"), self.columns, self.versions]
        return hashlib.sha256(json.dumps(whole).encode()).hexdigest()

    def make_case(self, entries: tuple[Any, ...]) -> Case:
        """The case of these entries; its digest is that of all that its figures follow from."""
        own = json.dumps(sorted(zip(self.keys, entries, strict=True)), default=str)
        return Case(hashlib.sha256((self._common + own).encode()).hexdigest()[:32], entries)

    def list_keys(self, case: Case) -> dict[str, Any]:
        """Keys and entries of a case as they stand in the table: figures in SI base units, the rest as text."""
        pairs = zip(self.keys, case.entries, self.figures, strict=True)
        return {key: _as_figure(entry) if figure else str(entry) for key, entry, figure in pairs}


def list_case_versions() -> tuple[tuple[str, str], ...]:
    """Name and version of each package that figures may hang on."""
    return tuple((name, version(name)) for name in _KEPT)


def split_scene(scene: Scene, work: Description) -> dict[str, Description]:
    """The descriptions that the keys of a study lead into, by the first word of a key."""
    return {"scene": scene.task, "arm": scene.manipulator, "tank": scene.tank, "work": work}


def join_scene(scene: Scene, parts: Mapping[str, Any]) -> Scene:
    """The scene of changed parts; a `DescriptionError` where they do not fit together."""
    return replace(scene, task=parts["scene"], manipulator=parts["arm"], tank=parts["tank"])


def plan_study(study: Study, folder: Path) -> tuple[Order, list[Case]]:
    """What the cases of a study have in common, and the cases in their order; the same study gives the same ones.

    Raises:
        DescriptionError: A key leads nowhere, none of its entries can be right, or nothing that is kept has such a name.
    """
    task, file = study.task, study.file
    axes = task.sample.over if task.sample else task.grid
    # of a span its ends
    choices = {key: [axis.least, axis.greatest] if isinstance(axis, Span) else list(axis) for key, axis in axes.items()}
    choices = choices or {key: [case[key] for case in task.cases] for key in task.cases[0]}
    keys = tuple(choices)
    scene = replace(study.scene, file=Path(study.scene.file.name))  # the same table in every folder
    parts = split_scene(scene, task.work)
    steps = tuple(locate(parts, key, file) for key in keys)
    for key, way in zip(keys, steps, strict=True):
        inside = [
            other for other, longer in zip(keys, steps, strict=True) if longer != way and longer[: len(way)] == way
        ]
        if inside or steps.count(way) > 1:
            raise DescriptionError(
                file, key, "the same entry twice", f"one key for it, not also {', '.join(inside) or key}"
            )
    order = Order(
        scene=dump_scene(scene),
        work=task.work,
        keys=keys,
        steps=steps,
        figures=tuple(_is_column(entries) for entries in choices.values()),
        columns=VERBS[task.work.verb].choose(task.keep, file),
        folder=folder,
        versions=list_case_versions(),
    )
    for (key, entries), way in zip(choices.items(), steps, strict=True):
        _refuse_hopeless(parts, key, way, (entries[0], entries[-1]), file)
    return order, [order.make_case(entries) for entries in _list_entries(study, keys)]


def _refuse_hopeless(
    parts: Mapping[str, Description], key: str, steps: Steps, ends: tuple[Any, Any], file: Path
) -> None:
    """Refuse a key if neither its first nor its last entry can stand there: a wrong unit, or no such choice."""
    place, faults = ".".join(map(str, steps)), []
    for entry in ends:
        try:
            change_entries(parts, {steps: entry}, file)
        except DescriptionError as error:
            if not error.key.startswith(place):  # it may fit with other entries beside it
                return
            faults.append(DescriptionError(file, key, error.found, error.allowed))
    if len(faults) == len(ends):
        raise faults[0]


def _list_entries(study: Study, keys: tuple[str, ...]) -> Iterator[tuple[Any, ...]]:
    task, file = study.task, study.file
    if task.cases:
        yield from (tuple(case[key] for key in keys) for case in task.cases)
    elif task.sample:
        draws = _draw(task.sample.method, task.sample.count, len(keys), task.sample.seed)
        columns = [_place(task.sample.over[key], draws[:, i], key, file) for i, key in enumerate(keys)]
        yield from zip(*columns, strict=True)
    else:
        axes = [
            _place(axis, np.linspace(0, 1, axis.count or 2), key, file) if isinstance(axis, Span) else list(axis)
            for key, axis in task.grid.items()
        ]
        if (count := prod(map(len, axes))) > _MOST:
            raise DescriptionError(
                file, "grid", f"{count} cases", f"at most {_MOST}: a sample covers so many keys better"
            )
        yield from product(*axes)


def _draw(method: str, count: int, keys: int, seed: int) -> Array:
    """Seeded figures from 0 to 1, shape (count, keys)."""
    if method == "uniform":
        return np.random.default_rng(seed).random((count, keys))
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    if method == "latin_hypercube":
        return qmc.LatinHypercube(keys, rng=rng).random(count)
    # a balanced sample has a power of two, of which these are the first
    return qmc.Sobol(keys, rng=rng).random_base2((count - 1).bit_length())[:count]


def _place(axis: Axis, part: Array, key: str, file: Path) -> list[Any]:
    """Entries of an axis at parts of it from 0 to 1."""
    if not isinstance(axis, Span):
        return [axis[min(int(p * len(axis)), len(axis) - 1)] for p in part]
    try:
        (least, kind), (greatest, other) = to_base(axis.least), to_base(axis.greatest)
    except ValueError as error:
        raise DescriptionError(file, key, f"{axis.least!r} to {axis.greatest!r}", str(error)) from None
    if kind != other:
        raise DescriptionError(file, key, f"{axis.least!r} to {axis.greatest!r}", "two figures of one dimension")
    return (least + part * (greatest - least)).tolist()


@lru_cache(maxsize=4096)
def _read(text: str) -> float | str:
    """A quantity in SI base units; other text as it is."""
    try:
        return to_base(text)[0] if text[:1] in "+-.0123456789" else text
    except ValueError:
        return text


def _as_figure(entry: Any) -> Any:
    return _read(entry) if isinstance(entry, str) else float(entry) if type(entry) is int else entry


def _is_column(entries: Iterable[Any]) -> bool:
    """Whether entries are all numbers, or all truth values, and so a column of the table; others stand there as text."""
    kinds = {type(_as_figure(entry)) for entry in entries}
    return kinds in ({float}, {bool})
