"""Changed entries of descriptions that have been read, by dotted key paths such as `scene.payload.mass`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vgtsim.description.complaints import translate
from vgtsim.description.schema import Description, closest
from vgtsim.errors import DescriptionError

Steps = tuple[Any, ...]

_FIXED = ("provenance", "manipulator", "tank")  # read from other files, or said of them


def locate(parts: Mapping[str, Description], key: str, file: Path | None) -> Steps:
    """Find an entry of named descriptions by its key path, in which entries of lists go by index or by name.

    It gives the steps that lead there: names of fields and tables, and indices.

    Raises:
        DescriptionError: There is no such entry; the error gives the nearest one.
    """
    node: Any = parts
    steps: Steps = ()
    for word in key.split("."):
        names = _names(node)
        if word not in names:
            above = ".".join(map(str, steps)) or "the study"
            raise DescriptionError(file, key, repr(word), f"an entry of {above}{closest(word, names)}")
        step = names[word]
        node = getattr(node, step) if isinstance(node, Description) else node[step]
        steps = (*steps, step)
    if len(steps) < 2:
        raise DescriptionError(
            file, key, "a whole description", f"an entry inside it, such as {key}.{next(iter(_names(node)))}"
        )
    return steps


def _names(node: Any) -> dict[str, Any]:
    """The words that stand for the entries of a node, each with its step."""
    if isinstance(node, Description):
        return {name: name for name in type(node).model_fields if name not in _FIXED}
    if isinstance(node, Mapping):
        return {str(name): name for name in node}
    if isinstance(node, tuple):
        return {str(i): i for i in range(len(node))} | {
            item.name: i for i, item in enumerate(node) if hasattr(item, "name")
        }
    return {}


def change_entries(
    parts: Mapping[str, Description], changes: Mapping[Steps, Any], file: Path | None
) -> dict[str, Description]:
    """Change entries of named descriptions, each at the end of its steps, and validate the results.

    A changed figure has no provenance any more, so the range that its file declares does not bind it.

    Raises:
        DescriptionError: An entry is wrong; the error's key begins with the name of the description.
    """
    data = {name: parts[name].model_dump(mode="json") for name in dict.fromkeys(steps[0] for steps in changes)}
    for (name, *way, last), value in changes.items():
        node = data[name]
        for step in way:
            node = node[step]
        node[last] = value
        if "provenance" in data[name]:
            here = ".".join(map(str, (*way, last, "")))
            kept = {key: label for key, label in data[name]["provenance"].items() if not _overlap(f"{key}.", here)}
            data[name]["provenance"] = kept
    changed = dict(parts)
    for name, entries in data.items():
        try:
            changed[name] = type(parts[name]).model_validate(entries)
        except ValidationError as error:
            raise translate(error, file, name) from None
    return changed


def _overlap(one: str, other: str) -> bool:
    return one.startswith(other) or other.startswith(one)
