"""The only file parser: TOML text to validated, frozen descriptions."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import ValidationError

from vgtsim.description.complaints import shorten, translate
from vgtsim.description.figures import warn_of_unusual
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mesh_file import list_meshes, split_meshes
from vgtsim.description.operator import OperatorCommand, load_commands
from vgtsim.description.scene import Scene, SceneFile
from vgtsim.description.schema import Description, Provenance
from vgtsim.description.shipped import ROOTS, USES, Kind, articled, find_file, tell_kind
from vgtsim.description.study import Study, StudyFile
from vgtsim.description.tank import Tank
from vgtsim.description.toml_file import read_text, read_toml
from vgtsim.description.tool_path import ToolPath
from vgtsim.digests import digest
from vgtsim.errors import DescriptionError
from vgtsim.units import to_base

_Model = TypeVar("_Model", bound=Description)

_BASES = 16  # files that a scene or a tank may stand on, one over the other
_ROUNDING = 1e-9  # of a range's end, for figures and ranges in different units


def load_manipulator(arm: str | Path) -> Manipulator:
    """Read an arm: the path of its TOML file, or the name of a shipped one. Errors are those of `load_description`."""
    return load_description(find_file(arm, "arm"), Manipulator)


def load_tank(tank: str | Path) -> Tank:
    """Read a tank: the path of its TOML file, or the name of a shipped one.

    A tank may name another as its `base`. It then holds the entries that differ, table by table; a list is one entry.

    Raises:
        DescriptionError: A file is missing, is not TOML, or describes no tank; or a mesh cannot be read.
    """
    file = find_file(tank, "tank")
    return split_meshes(_validate(file, Tank, read_tables(file, "tank")), file)


def load_tool_path(path: str | Path) -> ToolPath:
    """Read a path of the tool: the path of its TOML file, or a shipped name. Errors are those of `load_description`."""
    return load_description(find_file(path, "path"), ToolPath)


def load_scene(scene: str | Path) -> Scene:
    """Read a scene with its arm and its tank: the path of its TOML file, or the name of a shipped one.

    A scene may name another as its `base`. It then holds the entries that differ, table by table; a list is one entry.
    Paths in a scene are relative to its file; a shipped arm, tank or base may be named instead.

    Raises:
        DescriptionError: One of the files is missing, is not TOML, or is inconsistent.
    """
    file = find_file(scene, "scene")
    task = _validate(file, SceneFile, read_tables(file))
    if task.phase is not None:
        raise DescriptionError(file, "phase", "a table", "no such table: the program makes the phases of a mission")
    manipulator = load_description(find_file(task.manipulator, "arm", beside=file.parent), Manipulator)
    tank = load_tank(find_file(task.tank, "tank", beside=file.parent))
    try:
        tank = tank.enter_by(task.mast.riser)
    except ValueError as error:
        raise DescriptionError(file, "mast.riser", repr(task.mast.riser), str(error)) from None
    record = task.operator and task.operator.record
    commands = load_commands(file.parent / record) if record else ()
    return Scene(task=task, manipulator=manipulator, tank=tank, file=file, commands=commands)


def load_study(study: str | Path) -> Study:
    """Read a study and its scene: the path of the study's TOML file, or a shipped name. Errors are those of `load_scene`."""
    file = find_file(study, "study")
    task = load_description(file, StudyFile)
    return Study(task, load_scene(find_file(task.scene, "scene", beside=file.parent)), file)


def dump_scene(scene: Scene) -> str:
    """Write a scene, its arm and its tank as one JSON text for a log; figures are SI. `parse_scene` reads it back."""
    parts = {"task": scene.task, "manipulator": scene.manipulator, "tank": scene.tank}
    whole = {name: part.model_dump(mode="json") for name, part in parts.items()} | {"file": str(scene.file)}
    if scene.commands:
        whole["commands"] = [item.model_dump(mode="json") for item in scene.commands]
    return json.dumps(whole)


def digest_scene(scene: Scene | str) -> str:
    """Digest of a scene, its arm and its tank, or of the text that `dump_scene` wrote of them, wherever the file lies."""
    data = json.loads(scene if isinstance(scene, str) else dump_scene(scene))
    parts = ("task", "manipulator", "tank", "commands")
    return digest(json.dumps({name: data[name] for name in parts if name in data}).encode())


def parse_scene(text: str) -> Scene:
    """Read a scene from the text that `dump_scene` wrote; a DescriptionError where it is no scene of this version."""
    try:
        data = json.loads(text)
        return Scene(
            task=SceneFile.model_validate(data["task"]),
            manipulator=Manipulator.model_validate(data["manipulator"]),
            tank=Tank.model_validate(data["tank"]),
            file=Path(data["file"]),
            commands=tuple(OperatorCommand.model_validate(item) for item in data.get("commands", ())),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise DescriptionError(None, "scene in the log", str(error), "a scene of this version of vgtsim") from None


def is_scene(path: str | Path) -> bool:
    """Tell the file of a scene, which names an arm or a base, from that of an arm. Errors are those of `read_toml`."""
    data = read_toml(Path(path))
    return "manipulator" in data or ("base" in data and tell_kind(data) == "scene")


def read_tables(file: Path, kind: Literal["scene", "tank"] = "scene", above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Read the tables of a scene or a tank over those of its base; `above` are the files that led here."""
    data = read_toml(file)
    _read_start(file, data)
    _read_paths(file, data)
    base = data.pop("base", None)
    if base is None:
        return data
    if not isinstance(base, str):
        raise DescriptionError(file, "base", shorten(base), f"the path of a {kind}'s file")
    path = find_file(base, kind, beside=file.parent)
    above = (*above, Path(os.path.realpath(file)))
    if Path(os.path.realpath(path)) in above:
        raise DescriptionError(file, "base", base, f"a {kind} that does not lead back here")
    if len(above) > _BASES:
        raise DescriptionError(file, "base", f"{kind}s over {kind}s, {len(above)} of them", f"at most {_BASES}")
    under = read_tables(path, kind, above)
    named: dict[str, Kind] = {"manipulator": "arm", "tank": "tank"} if kind == "scene" else {}
    for name, other in named.items():
        if isinstance(under.get(name), str):
            under[name] = os.path.relpath(find_file(under[name], other, beside=path.parent), file.parent)
    for mesh in list_meshes(under) if kind == "tank" else ():
        mesh["file"] = os.path.relpath(path.parent / mesh["file"], file.parent)
    return _overlay(under, data)


def _read_start(file: Path, data: dict[str, Any]) -> None:
    """Put the inputs that `vgtsim ik --json` left in a file in the place of the file's name."""
    motion = data.get("motion")
    if not isinstance(motion, dict):
        return
    start = motion.get("start")
    saved = file.parent / start if isinstance(start, str) and start != "stowed" else None
    if saved is not None and os.path.isfile(saved):
        try:
            motion["start"] = {"inputs": json.loads(read_text(saved))["q"]}
        except (ValueError, KeyError, TypeError):
            raise DescriptionError(saved, "", "no inputs `q`", "a file that `vgtsim ik --json` left") from None


def _read_paths(file: Path, data: dict[str, Any]) -> None:
    """Put the tool paths that steps of a mission name in the place of their names."""
    for step in data.get("mission", ()) if isinstance(data.get("mission"), list) else ():
        if isinstance(step, dict) and isinstance(step.get("path"), str):
            path = load_description(find_file(step["path"], "path", beside=file.parent), ToolPath)
            step["path"] = path.model_dump(exclude_none=True)


def _overlay(under: Any, over: Any) -> Any:
    """One set of tables over another; a figure or a list replaces the entry under it."""
    if not (isinstance(under, dict) and isinstance(over, dict)) or "value" in {*under, *over}:
        return over
    return under | {name: _overlay(under[name], entry) if name in under else entry for name, entry in over.items()}


def load_description(file: Path, kind: type[_Model]) -> _Model:
    """Read a TOML file of any kind.

    Raises:
        DescriptionError: The file is missing, is not TOML, or describes nothing of that kind.
    """
    return _validate(file, kind, read_toml(file))


def _validate(file: Path, kind: type[_Model], data: dict[str, Any]) -> _Model:
    plain = take_provenance(data, kind, file)
    try:
        model = kind.model_validate(plain)
    except ValidationError as error:
        refuse_other_kind(file, data, kind)
        raise translate(error, file) from None
    for key, label in plain.get("provenance", {}).items():
        if label.range is not None:
            _require_range(file, key, _find(plain, key), label.range)
    warn_of_unusual(file, model)
    return model


def take_provenance(data: dict[str, Any], kind: type[Description], file: Path) -> dict[str, Any]:
    """Tables of plain values, with labels by key path where the kind of file has them; a DescriptionError for a wrong label."""
    plain, provenance = _split_provenance(data, "", file)
    if "provenance" in plain:
        raise DescriptionError(
            file, "provenance", shorten(plain["provenance"]), "labels beside the figures, no such key"
        )
    return plain | ({"provenance": provenance} if "provenance" in kind.model_fields else {})


def refuse_other_kind(file: Path, data: dict[str, Any], wanted: type[Description]) -> None:
    """Raise an error with the right verb where a file is plainly of another kind than wanted."""
    kind = tell_kind(data)
    if kind is not None and ROOTS[kind] is not wanted:
        asked = next((name for name, root in ROOTS.items() if root is wanted), "catalogue")
        raise DescriptionError(file, "", articled(kind), f"{articled(asked)}; {USES[kind]}")


def _find(plain: Any, key: str) -> Any:
    for part in key.split("."):
        plain = plain[int(part)] if isinstance(plain, list) else plain[part]
    return plain


def _require_range(file: Path, key: str, value: Any, limits: tuple[float | str, float | str]) -> None:
    """Refuse a figure outside the range that its own file declares; of a vector, every figure has that range."""
    entries = value if isinstance(value, list) else [value]
    if any(isinstance(entry, bool) or not isinstance(entry, int | float | str) for entry in entries):
        raise DescriptionError(file, f"{key}.range", shorten(list(limits)), "a range beside a figure or a vector")
    try:
        low, high, *numbers = (to_base(item) for item in (*limits, *entries))
    except ValueError as error:
        raise DescriptionError(file, f"{key}.range", shorten(list(limits)), str(error)) from None
    for entry, (number, dimension) in zip(entries, numbers, strict=True):
        if len({item for item in (dimension, low[1], high[1]) if item}) > 1:
            raise DescriptionError(file, f"{key}.range", shorten(list(limits)), f"the dimension of {shorten(entry)}")
        slack = _ROUNDING * max(abs(low[0]), abs(high[0]))
        if not low[0] - slack <= number <= high[0] + slack:
            raise DescriptionError(file, key, shorten(entry), f"{limits[0]} to {limits[1]}, the range beside it")


def _split_provenance(node: Any, key: str, file: Path) -> tuple[Any, dict[str, Provenance]]:
    """Replace each `{value, label, note, range}` table by its value and collect the labels by key path."""
    if isinstance(node, dict) and "value" in node:
        label, value = {name: entry for name, entry in node.items() if name != "value"}, node["value"]
        if isinstance(value[0] if isinstance(value, list) and value else value, dict):
            raise DescriptionError(file, key, "a label beside a table", "labels beside figures and texts in the table")
        try:
            return value, {key: Provenance.model_validate(label)}
        except ValidationError as error:
            raise translate(error, file, key) from None
    entries = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    found: dict[str, Provenance] = {}
    plain: dict[Any, Any] = {}
    for name, entry in entries:
        plain[name], inner = _split_provenance(entry, f"{key}.{name}" if key else str(name), file)
        found |= inner
    if isinstance(node, dict):
        return plain, found
    return (list(plain.values()), found) if isinstance(node, list) else (node, found)
