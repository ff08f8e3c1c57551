"""The kinds of file that a user writes, and the shipped ones: found by name, in a checkout and in an installed package alike."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.scene import SceneFile
from vgtsim.description.schema import Description, closest
from vgtsim.description.study import StudyFile
from vgtsim.description.tank import Tank
from vgtsim.description.tool_path import ToolPath
from vgtsim.errors import DescriptionError

Kind = Literal["arm", "model", "tank", "scene", "path", "study"]  # a model is the MJCF of an arm and its floor

_PACKAGE = Path(__file__).resolve().parents[1]
# The wheel holds both folders inside the package; in a checkout they stand beside it.
_ROOT = _PACKAGE if (_PACKAGE / "models").is_dir() else _PACKAGE.parent
MODELS = _ROOT / "models"
_PATTERNS: dict[Kind, str] = {
    "arm": "models/*/*.toml",
    "model": "models/*/scene.xml",
    "tank": "scenes/tanks/*.toml",
    "scene": "scenes/*.toml",
    "path": "scenes/paths/*.toml",
    "study": "scenes/studies/*.toml",
}
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


def list_shipped(kind: Kind) -> dict[str, Path]:
    """Files of all shipped descriptions of a kind by name, in the order of their names."""
    files = sorted(_ROOT.glob(_PATTERNS[kind]))
    return {file.parent.name if kind == "model" else file.stem: file for file in files}


def find_file(name: str | Path, *kinds: Kind, beside: Path | None = None) -> Path:
    """Find a description by the path of its file, such as "my/arm.toml", or a shipped one by its name, such as "arm15".

    A file of that path goes first. Text with a folder or an ending is always a path, relative to the folder `beside`.
    A name may stand for a shipped description of any of the `kinds`.

    Raises:
        DescriptionError: There is no such name; the error gives the nearest one and the list. Or no path can be so.
    """
    if "\0" in str(name):
        raise DescriptionError(None, " or ".join(kinds), repr(str(name)), "a path without a zero byte")
    path = (beside or Path()) / name
    if os.path.isfile(path) or Path(name).name != str(name) or Path(name).suffix:
        return path
    known = {key: file for kind in kinds for key, file in list_shipped(kind).items()}
    if str(name) not in known:
        what = " or ".join(kinds)
        others = [kind for kind in _PATTERNS if kind not in (*kinds, "model") and str(name) in list_shipped(kind)]
        if others:
            raise DescriptionError(
                None, what, f"{str(name)!r}, {articled(others[0])}", f"{articled(what)}; {USES[others[0]]}"
            )
        allowed = f"the path of a file, or the name of a shipped {what}{closest(str(name), known)}"
        raise DescriptionError(None, what, repr(str(name)), allowed)
    return known[str(name)]


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
