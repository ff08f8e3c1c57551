"""The kinds of file that a user writes: how to tell them apart, and what each is for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.scene import SceneFile
from vgtsim.description.schema import Description
from vgtsim.description.study import StudyFile
from vgtsim.description.tank import Tank
from vgtsim.description.tool_path import ToolPath

ROOTS: dict[str, type[Description]] = {
    "arm": Manipulator,
    "tank": Tank,
    "scene": SceneFile,
    "path": ToolPath,
    "study": StudyFile,
}
USES = {
    "arm": "for an arm: `vgtsim show`, `check`, `build`, `workspace`, `capacity`, `size`; a scene names it as `manipulator`",
    "tank": "for a tank: `vgtsim show` and `check`; a scene names it as `tank`",
    "scene": "for a scene: `vgtsim run`, `check`, `show`, `build`, `ik`, `track`",
    "path": "for a path: `vgtsim track SCENE --path PATH`",
    "study": "for a study: `vgtsim study`",
}
_COMMON = {"name", "title"}  # keys that every kind has


def tell_kind(data: Iterable[Any]) -> str | None:
    """Kind of a file by the keys of its tables; nothing where no kind has most of them."""
    keys = set(data) - _COMMON
    counts = {kind: len(keys & set(root.model_fields)) for kind, root in ROOTS.items()}
    if "base" in keys:  # of those that may have one
        return "tank" if counts["tank"] > counts["scene"] else "scene"
    first, second = sorted(counts, key=lambda kind: -counts[kind])[:2]
    return first if counts[first] > counts[second] and 2 * counts[first] > len(keys) else None


def articled(kind: str) -> str:
    """A kind with its article."""
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
