"""Everything that is wrong with a file and with the files that it names, at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError

from vgtsim.description.complaints import translate_all
from vgtsim.description.files import load_description, load_scene, load_study, load_tank, read_tables, take_provenance
from vgtsim.description.schema import UNKNOWN_KEY, Description
from vgtsim.description.shipped import ROOTS, USES, Kind, find_file, tell_kind
from vgtsim.description.toml_file import read_toml
from vgtsim.errors import DescriptionError

_ROUNDS = 20  # validations, each without the unknown keys of the one before: a file nests less deep


def tell_file(file: Path) -> str:
    """Kind of a file; a DescriptionError where it cannot be read or is of no kind."""
    kind = tell_kind(read_toml(file))
    if kind is None:
        raise DescriptionError(file, "", "keys of no kind of file", "; ".join(USES.values()))
    return kind


def list_faults(file: Path, kind: str) -> list[DescriptionError]:
    """All that is wrong in a file of a kind and, of a scene, in its arm and tank; what no key tells only without such faults."""
    faults = list(_list_all(file, kind))
    if not faults:
        try:
            whole = {"scene": load_scene, "study": load_study, "tank": load_tank}
            whole.get(kind, lambda path: load_description(path, ROOTS[kind]))(file)
        except DescriptionError as error:
            faults.append(error)
    return faults


def _list_all(file: Path, kind: str) -> Iterator[DescriptionError]:
    try:
        data = read_tables(file, kind) if kind in ("scene", "tank") else read_toml(file)
        plain = take_provenance(data, ROOTS[kind], file)
    except DescriptionError as error:
        yield error
        return
    yield from _validate(file, ROOTS[kind], plain)
    named = {"scene": {"manipulator": "arm", "tank": "tank"}, "study": {"scene": "scene"}}.get(kind, {})
    for key, inner in named.items():
        if not isinstance(plain.get(key), str):
            continue
        try:
            other = find_file(plain[key], cast(Kind, inner), beside=file.parent)
            found = tell_kind(read_toml(other))
        except DescriptionError as error:
            yield DescriptionError(file, key, error.found, error.allowed)
            continue
        if found not in (inner, None):
            yield DescriptionError(file, key, f"{plain[key]!r}, a file of kind {found}", f"a file of kind {inner}")
        else:
            yield from _list_all(other, inner)


def _validate(file: Path, root: type[Description], plain: dict[str, Any]) -> Iterator[DescriptionError]:
    """All complaints: an unknown key hides those about its table, so it is told and taken away."""
    told: set[str] = set()
    for _ in range(_ROUNDS):
        try:
            root.model_validate(plain)
            return
        except ValidationError as error:
            for fault in translate_all(error, file):
                if str(fault) not in told:
                    told.add(str(fault))
                    yield fault
            unknown = [item for item in error.errors(include_url=False) if item["type"] == UNKNOWN_KEY]
            if not unknown:
                return
            for item in unknown:
                table = _walk(plain, item["loc"])
                for key in item.get("ctx", {})["keys"]:
                    table.pop(key, None)


def _walk(node: Any, place: tuple[int | str, ...]) -> dict[str, Any]:
    """The table at a place; a union adds its choice to the place."""
    for part in place:
        if isinstance(node, dict):
            node = node.get(part, node)
        elif isinstance(part, int):
            node = node[part]
    return node if isinstance(node, dict) else {}
