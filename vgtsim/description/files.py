"""The only file parser: TOML text to validated, frozen descriptions."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.modules import KINDS
from vgtsim.description.scene import Scene, SceneFile
from vgtsim.description.schema import Description, Provenance
from vgtsim.description.tank import Tank
from vgtsim.description.tool_path import SHAPES, ToolPath
from vgtsim.errors import DescriptionError

_Model = TypeVar("_Model", bound=Description)


def load_manipulator(path: str | Path) -> Manipulator:
    """Read an arm.

    Args:
        path: TOML file of the arm.

    Returns:
        The validated arm.

    Raises:
        DescriptionError: The file is missing, is not TOML, or describes no possible arm.
    """
    return _load(Path(path), Manipulator)


def load_tank(path: str | Path) -> Tank:
    """Read a tank.

    Args:
        path: TOML file of the tank.

    Returns:
        The validated tank.

    Raises:
        DescriptionError: The file is missing, is not TOML, or describes no possible tank.
    """
    return _load(Path(path), Tank)


def load_tool_path(path: str | Path) -> ToolPath:
    """Read a path of the tool.

    Args:
        path: TOML file of the path.

    Returns:
        The validated path.

    Raises:
        DescriptionError: The file is missing, is not TOML, or describes no path.
    """
    return _load(Path(path), ToolPath)


def load_scene(path: str | Path) -> Scene:
    """Read a scene together with the arm and tank it names.

    Args:
        path: TOML file of the scene; the arm's and tank's paths in it are relative to it.

    Returns:
        The validated scene.

    Raises:
        DescriptionError: One of the three files is missing, is not TOML, or is inconsistent.
    """
    file = Path(path)
    written = _load(file, SceneFile)
    manipulator = load_manipulator(file.parent / written.manipulator)
    tank = load_tank(file.parent / written.tank)
    return Scene(task=written, manipulator=manipulator, tank=tank, file=file)


def dump_scene(scene: Scene) -> str:
    """Write a scene with its arm and tank as one JSON text, for a run's log.

    Args:
        scene: The scene.

    Returns:
        Text that `parse_scene` reads back; figures are SI.
    """
    parts = {"task": scene.task, "manipulator": scene.manipulator, "tank": scene.tank}
    return json.dumps({name: part.model_dump(mode="json") for name, part in parts.items()} | {"file": str(scene.file)})


def parse_scene(text: str) -> Scene:
    """Read a scene back.

    Args:
        text: From `dump_scene`.

    Returns:
        The scene.

    Raises:
        DescriptionError: The text is not a scene of this version.
    """
    try:
        data = json.loads(text)
        return Scene(
            task=SceneFile.model_validate(data["task"]),
            manipulator=Manipulator.model_validate(data["manipulator"]),
            tank=Tank.model_validate(data["tank"]),
            file=Path(data["file"]),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise DescriptionError(None, "scene in the log", str(error), "a scene of this version of vgtsim") from None


def is_scene(path: str | Path) -> bool:
    """Tell a scene's file from an arm's: a scene names an arm.

    Args:
        path: TOML file.

    Returns:
        Whether it is a scene.

    Raises:
        DescriptionError: The file is missing or is not TOML.
    """
    return "manipulator" in _read_toml(Path(path))


def _load(file: Path, kind: type[_Model]) -> _Model:
    plain, provenance = _split_provenance(_read_toml(file), "", file)
    if "provenance" in kind.model_fields:
        plain["provenance"] = provenance
    try:
        return kind.model_validate(plain)
    except ValidationError as error:
        raise _translate(error, file) from None


def _read_toml(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DescriptionError(file, "", error.strerror or str(error), "a readable TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(file, "", f"a TOML syntax error, {error}", "TOML 1.0") from None


def _split_provenance(node: Any, key: str, file: Path) -> tuple[Any, dict[str, Provenance]]:
    """Replace each `{value, label, note, range}` table by its value and collect the labels by key path."""
    if isinstance(node, dict) and "value" in node:
        label = {name: entry for name, entry in node.items() if name != "value"}
        try:
            return node["value"], {key: Provenance.model_validate(label)}
        except ValidationError as error:
            raise _translate(error, file, key) from None
    entries = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    found: dict[str, Provenance] = {}
    plain: dict[Any, Any] = {}
    for name, entry in entries:
        plain[name], inner = _split_provenance(entry, f"{key}.{name}" if key else str(name), file)
        found |= inner
    if isinstance(node, dict):
        return plain, found
    return (list(plain.values()), found) if isinstance(node, list) else (node, found)


def _translate(error: ValidationError, file: Path, prefix: str = "") -> DescriptionError:
    """Turn the first of pydantic's complaints into ours, counting the others."""
    first, *others = error.errors(include_url=False)
    path = [str(part) for part in first["loc"] if part not in (*KINDS, *SHAPES)]  # a union adds the choice
    allowed = first["msg"].removeprefix("Value error, ")
    if others:
        allowed += f" [and {len(others)} more: {', '.join('.'.join(map(str, o['loc'])) for o in others[:4])}]"
    whole = first["type"] == "value_error" and isinstance(first["input"], dict)  # says itself what it found
    found = "nothing" if first["type"] == "missing" else "" if whole else _short(first["input"])
    return DescriptionError(file, ".".join([prefix, *path] if prefix else path), found, allowed)


def _short(value: Any) -> str:
    if isinstance(value, dict):
        return f"a table with {', '.join(map(str, value))}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
