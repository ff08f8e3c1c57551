"""The scene that a log is a run of: its file, where it is still there, before the copy in the log."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from vgtsim.description.files import load_scene
from vgtsim.description.scene import Scene
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import DescriptionError

_SHOWN = 8  # differences that are told one by one
_APART = ("provenance", "video")  # where figures come from, and the film: a run does not follow from them


def find_original(
    copy: Scene, prepare: Callable[[Scene], Scene] = lambda scene: scene
) -> tuple[Scene, tuple[str, ...]]:
    """Scene of the file that a log names, or else the log's copy, with notes on how the two differ.

    `prepare` does to the scene of the file what was done to the log's before the run: it looks up the places of goals.
    A scene that was read from elsewhere is looked for among the shipped ones of its name.
    """
    name, file = copy.task.name, copy.file
    if file.suffix != ".toml" or not os.path.isfile(file):
        file = list_shipped("scene").get(name, file)
    if not os.path.isfile(file):
        return copy, (f"{file} is not there: limits and description are those of the log",)
    try:
        scene = prepare(load_scene(file))
    except DescriptionError as error:
        return copy, (f"limits and description are those of the log: {error}",)
    if scene.task.name != name:
        found = f"{file} is the scene {scene.task.name} now"
        return copy, (f"{found}: limits and description are those of the log, {name}",)
    return scene, _tell(file, list(_list_differences(_plain(copy), _plain(scene))))


def _plain(scene: Scene) -> dict[str, Any]:
    parts = {"": scene.task, "arm": scene.manipulator, "tank": scene.tank}
    return {key: part.model_dump(mode="json", exclude=set(_APART)) for key, part in parts.items()}


def _list_differences(log: Any, file: Any, key: str = "") -> Iterator[str]:
    """Each figure that differs, with its key path."""
    if isinstance(log, dict) and isinstance(file, dict):
        for name in (*log, *(name for name in file if name not in log)):
            yield from _list_differences(log.get(name), file.get(name), f"{key}.{name}".strip("."))
    elif log != file:
        yield f"{key}: {_short(log)} in the log, {_short(file)} in the file"


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _tell(file: Path, differences: list[str]) -> tuple[str, ...]:
    """Notes on differences, those of the limits first: a report must not be taken for one of other limits."""
    limits = [item for item in differences if item.startswith("limits.")]
    others = [item for item in differences if item not in limits]
    notes = []
    if limits:
        notes.append(f"limits changed since the run; those of {file} count: {_join(limits)}")
    if others:
        notes.append(f"description changed since the run; that of {file} counts: {_join(others)}")
    return tuple(notes)


def _join(items: list[str]) -> str:
    more = [f"and {len(items) - _SHOWN} more"] if len(items) > _SHOWN else []
    return "; ".join([*items[:_SHOWN], *more])
