"""The page of every key of every file, docs/reference.md, from the descriptions and the shipped files."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from vgtsim.description import catalogue
from vgtsim.description.figures import Figure, find_figure
from vgtsim.description.reference import BASED, FILES, find_meaning, find_models, models_in, summary, walk
from vgtsim.description.schema import Provenance
from vgtsim.description.shipped import Kind, list_shipped

CATALOGUE = Path(catalogue.__file__).with_name("catalogue.toml")
_HEAD = """# Every key of every file

Made by `scripts/make_reference` from the code that reads the files; do not edit it. A bare number is in the SI unit of the
column "type". A text is one number and one unit, such as "42 in", "3 1/2 in", "3 ft 6 in", "12° 30' 15\\"" or "1.5e-3 m". Any
figure may be a table `{ value = ..., label = "sourced" | "derived" | "assumed", note = "...", range = [low, high] }`. A figure
outside its range is refused. `vgtsim schema KIND` prints the JSON schema of a kind of file. An editor with TOML support takes
it from a first line `#:schema PATH`.
"""


def write_reference() -> str:
    """The page of every key, as Markdown."""
    examples = _collect_examples()
    lines = [_HEAD]
    seen: set[type[BaseModel]] = {Provenance}
    for kind, root in FILES.items():
        lines += [f"## Files of kind {kind}", ""]
        for model in find_models(root):
            if model in seen:
                continue
            seen.add(model)
            lines += [f"### {model.__name__}", "", summary(model), ""]
            lines += ["| key | type | default | meaning | example |", "|---|---|---|---|---|"]
            fields = {key: field for key, field in model.model_fields.items() if key != "provenance"}
            lines += [_row(model, key, field, examples) for key, field in fields.items()]
            if kind in BASED and model is root:
                meaning, example = BASED[kind]
                lines.append(f'| `base` | text | none | {meaning} | `"{example}"` |')
            lines.append("")
    return "\n".join(lines)


def _row(model: type[BaseModel], key: str, field: FieldInfo, examples: Mapping[tuple[str, str], Any]) -> str:
    given = None if field.is_required() else field.get_default(call_default_factory=True)
    default = "**needed**" if field.is_required() else "none" if given is None else f"`{_toml(given)}`"
    example = examples.get((model.__name__, key))
    shown = f"`{_toml(example)}`" if example is not None else _make_example(field)
    cells = (f"`{key}`", write_type(field), default, find_meaning(model, key), shown)
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def write_type(field: FieldInfo) -> str:
    """Type, unit and bounds of a field in words."""
    figure = find_figure(field.annotation, field.metadata)
    if figure is not None:
        return f"quantity, {_unit(figure)}{_bounds(field)}"
    form = str(field.annotation)
    if models := list(models_in(field.annotation)):
        names = " or ".join(f"[{model.__name__}](#{model.__name__.lower()})" for model in models)
        if "Any" in form:  # of a case: what a scene has, of whatever kind
            return f"by dotted key: {names}, or a list of values"
        return ("tables by name: " if "dict[" in form else "list of " if "tuple[" in form else "") + names
    if "Any" in form:
        return "list of tables"
    inner = [item for item in walk(field.annotation) if isinstance(item, Figure)]
    if inner:
        return f"list of quantities, {', '.join(dict.fromkeys(_unit(item) for item in inner))}"
    literals = [item for item in walk(field.annotation) if isinstance(item, str)]
    if literals:
        return " or ".join(f'`"{item}"`' for item in dict.fromkeys(literals))
    kinds = [item for item in walk(field.annotation) if isinstance(item, type)]
    members = [f'`"{member.value}"`' for item in kinds if issubclass(item, Enum) for member in item]
    if members:
        return " or ".join(members)
    word = {"str": "text", "int": "whole number", "float": "number", "bool": "true or false"}
    names = [word[item.__name__] for item in kinds if item.__name__ in word]
    return ("list of " if "tuple[" in form else "") + " or ".join(dict.fromkeys(names)) + _bounds(field)


def _unit(figure: Figure) -> str:
    return "pure number" if figure.unit == "dimensionless" else figure.unit


def _bounds(field: FieldInfo) -> str:
    signs = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
    limits = [(word, getattr(item, sign, None)) for item in _walk_metadata(field) for sign, word in signs.items()]
    found = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
    return f", {', '.join(dict.fromkeys(found))}" if found else ""


def _walk_metadata(field: FieldInfo) -> Iterator[Any]:
    for item in field.metadata:
        yield from getattr(item, "metadata", None) or (item,)


def _collect_examples() -> dict[tuple[str, str], Any]:
    """First value of each key in the shipped files."""
    found: dict[tuple[str, str], Any] = {}
    for kind, root in FILES.items():
        files = [CATALOGUE] if kind == "catalogue" else list_shipped(cast(Kind, kind)).values()
        for file in files:
            _collect(tomllib.loads(file.read_text(encoding="utf-8")), root, found)
    return found


def _collect(data: dict[str, Any], model: type[BaseModel], found: dict[tuple[str, str], Any]) -> None:
    for key, value in data.items():
        plain = value["value"] if isinstance(value, dict) and "value" in value else value
        field = model.model_fields.get(key)
        inner = list(models_in(field.annotation)) if field else []
        if field is None or not inner:
            found.setdefault((model.__name__, key), plain)
            continue
        tables = plain if isinstance(plain, list) else [*plain.values()] if "dict" in str(field.annotation) else [plain]
        for table in tables:
            named = [item for item in inner if table.get("kind", table.get("shape")) in set(walk(_kind_of(item)))]
            _collect(table, (named or inner)[0], found)


def _kind_of(model: type[BaseModel]) -> Any:
    field = model.model_fields.get("kind") or model.model_fields.get("shape")
    return field.annotation if field else None


def _make_example(field: FieldInfo) -> str:
    figure = find_figure(field.annotation, field.metadata)
    if figure is not None:
        return "`1.0`" if figure.unit == "dimensionless" else f'`"1 {figure.unit}"`'
    if any(models_in(field.annotation)):
        return "see its table"
    form = str(field.annotation)
    if literals := [item for item in walk(field.annotation) if isinstance(item, str) and f"'{item}'" in form]:
        return f"`{_toml(literals[0])}`"
    if field.annotation is bool:
        return "`true`"
    return "`[]`" if "tuple[" in form else '`"text"`' if "str" in form else "`1`"


def _toml(value: Any) -> str:
    if isinstance(value, BaseModel | dict):
        return "{}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
