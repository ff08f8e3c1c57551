"""The shipped arms, tanks, scenes, paths and studies: found by name, in a checkout and in an installed package alike."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from vgtsim.description.kinds import USES, articled
from vgtsim.description.schema import closest
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
