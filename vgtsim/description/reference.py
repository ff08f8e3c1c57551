"""The meaning of every key of every file, and the JSON schemas for editors: both are made from the descriptions."""

from __future__ import annotations

import inspect
import json
import re
from collections import Counter
from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel

from vgtsim.description.catalogue import Catalogue
from vgtsim.description.schema import Description
from vgtsim.description.shipped import ROOTS

FILES: dict[str, type[Description]] = ROOTS | {"catalogue": Catalogue}
BASED = {  # kinds of file that may stand on another of the kind, and an example
    kind: (
        f"A {kind} that this one differs from, by path or shipped name; this file then holds only what differs.",
        name,
    )
    for kind, name in (("scene", "type_ii_reach"), ("tank", "type_ii"))
}
_BY_TABLE = ("inner_diameter", "knuckle_radius", "wall_top", "haunch_radius", "dish_depth")
_COMMON = {  # meanings of keys whose name says nearly all; a table's own text goes first
    "name": "Name: letters, digits and underscores, a letter first.",
    "title": "One line for people.",
    "provenance": "Sources of the figures by key path.",
    "material": "Name of a material in this file.",
    "do": "Kind of the step.",
    "verb": "What is done in every case.",
    "kind": "Kind of the module; of waste, a word for people.",
    "shape": "Kind of the piece.",
    "cylinder": "Name of a cylinder of the arm.",
    "tube": "Name of a tube of the arm.",
    "base": "Sides 12, 23, 31 of its base; absent for the arm's face side.",
    "top": "Sides 12, 23, 31 of its top; absent for the arm's face side, or for the sides of a section's base.",
    "longeron_tube": "Tube of the three longerons, by name.",
    "cross_longeron_tube": "Tube of the three diagonals, by name.",
    "batten_tube": "Tube of the three battens of its top face, by name.",
    "outer_diameter": "Outer diameter.",
    "diameter": "Diameter.",
    "wall": "Thickness of the wall.",
    "barrel_wall": "Thickness of the barrel's wall.",
    "thickness": "Thickness.",
    "dome_thickness": "Thickness of the dome.",
    "liner_thickness": "Thickness of the liner.",
    "density": "Mass over volume.",
    "youngs_modulus": "Young's modulus E.",
    "yield_strength": "Yield strength Fy.",
    "bulk_modulus": "Bulk modulus of the oil.",
    "length": "Length; of a static module, between the centroids of its faces.",
    "longeron": "Length of each of the twelve longerons.",
    "cylinder_length": "Length of every actuator in the stowed pose.",
    "stroke": "Extended length less the retracted length.",
    "bore": "Diameter of the piston.",
    "rod": "Diameter of the rod.",
    "head": "Total thickness of steel at bore diameter in the two heads and the piston.",
    "eye": "Distance from a pin to the barrel or to the full rod.",
    "pin": "Diameter of the pins at its ends, in double shear; absent where the joint is not rated.",
    "pressure": "Supply pressure.",
    "hub": "The ball nodes.",
    "tip_plate": "The plate that carries the tool.",
    "materials": "Materials by name.",
    "tubes": "Tubes: by name in an arm, a list of stock sizes in a catalogue.",
    "cylinders": "Cylinders: by name in an arm, a list of stock sizes in a catalogue.",
    "modules": "The modules from the mast to the tool.",
    "shell": "Liner and dome.",
    "risers": "Risers besides the arm's own.",
    "equipment": "What stands or hangs in the tank.",
    "waste": "The waste left in the tank.",
    "mast": "The pipe that carries the arm.",
    "payload": "The load at the tool.",
    "motion": "The tour and how it is driven.",
    "simulation": "Settings of the step loop.",
    "limits": "Limits of the checks.",
    "video": "The film.",
    "mass": "Mass.",
    "radius": "Radius; of a hub or payload, of its ball.",
    "method": "How redundancy is resolved.",
    "gravity": "Acceleration of gravity, along -z of frame G.",
    "width": "Width of the picture, pixels.",
    "height": "Height of the picture, pixels.",
    "fps": "Frames a second.",
    "speed": "Simulated seconds in a second of film.",
    "cuts": "Shots in order.",
    "camera": "Camera of the shot.",
    "direction": "Outward normal of the tip plate in frame G, of any length; of a piece, at its end, absent to keep it.",
    "axis": "Direction of the axis in frame G, of any length.",
    "start": "Tool point at the beginning, in frame G.",
    "pieces": "Pieces in sequence.",
    "through": "Way-points in frame G; the spline ends at the last one.",
    "rows": "Number of rows.",
    "tube_standard": "Source of the tubes' sizes.",
    "material_standard": "Source of the materials' figures.",
    "tube_material": "Name of the material of all tubes.",
    "cylinder_material": "Name of the material of all cylinders.",
}


def write_schema(kind: str) -> str:
    """JSON schema of a kind of file, as text."""
    whole = FILES[kind].model_json_schema()
    tables = {FILES[kind].__name__: whole, **whole.get("$defs", {})}
    models = {model.__name__: model for model in find_models(FILES[kind])}
    for name, table in tables.items():
        if name in models:
            _describe(table, models[name])
    if kind in BASED:
        whole["properties"]["base"] = {"type": "string", "description": BASED[kind][0]}
        demand = _free(whole, tables)
        if kind == "tank":  # a table of the profile takes the place of some figures
            shell = demand["properties"]["shell"]
            shell["required"] = [key for key in shell["required"] if key not in _BY_TABLE]
            shell["anyOf"] = [{"required": ["profile"]}, {"required": list(_BY_TABLE)}]
        whole |= {"if": {"not": {"required": ["base"]}}, "then": demand}
    if kind == "study":
        _open_axes(tables)
    whole["$schema"] = "http://json-schema.org/draft-07/schema#"
    return json.dumps(whole, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def _open_axes(tables: dict[str, Any]) -> None:
    """Let the keys of a grid or sample be dotted, or tables in tables, as TOML has them without quotes."""
    values = {"type": "array", "minItems": 1}
    inner = {"anyOf": [values, {"$ref": "#/$defs/Span"}, {"$ref": "#/$defs/Axes"}]}
    for name, key in (("StudyFile", "grid"), ("Sample", "over")):
        old = tables[name]["properties"][key]
        tables[name]["properties"][key] = {"$ref": "#/$defs/Axes", "description": old["description"]}
    tables["StudyFile"]["$defs"]["Axes"] = {"type": "object", "additionalProperties": inner}


def _free(table: dict[str, Any], tables: dict[str, Any]) -> dict[str, Any]:
    """Let a table and those in it hold some of their keys alone, as a file's base has the others; returns what else is needed."""
    demand: dict[str, Any] = {"required": table.pop("required", []), "properties": {}}
    users = Counter(
        name for each in tables.values() for part in each.get("properties", {}).values() for name in _refer(part)
    )
    for key, part in table["properties"].items():
        names, words = _refer(part), {word for word, _ in _list_words(part)}
        # not those of lists and unions, which a file gives whole, nor those that stand in other tables too
        name = next(iter(names), "")
        if len(names) == users[name] == 1 and not words & {"items", "oneOf"} and "properties" in tables[name]:
            demand["properties"][key] = _free(tables[name], tables)
    return demand


def _refer(part: Any) -> set[str]:
    """Names of the tables that a part of a schema may be."""
    return {value.split("/")[-1] for word, value in _list_words(part) if word == "$ref"}


def _list_words(part: Any) -> Iterator[tuple[str, Any]]:
    """All words of a part of a schema with their values, those inside too."""
    for word, value in part.items() if isinstance(part, dict) else ():
        yield word, value
        yield from _list_words(value)
    for item in part if isinstance(part, list) else ():
        yield from _list_words(item)


def _describe(table: dict[str, Any], model: type[BaseModel]) -> None:
    """Give each key of a table its meaning and the form with a label; leave out the names that repeat the keys."""
    table.pop("title", None)
    table["description"] = summary(model)
    table["properties"].pop("provenance", None)
    for key, part in table["properties"].items():
        part.pop("title", None)
        meaning = {"description": find_meaning(model, key)}
        if "$ref" in part or (part.get("items", {}) and _has_reference(part["items"])) or "const" in part:
            table["properties"][key] = part | meaning
            continue
        default = {"default": part.pop("default")} if "default" in part else {}
        table["properties"][key] = _label(part) | meaning | default


def _label(part: dict[str, Any]) -> dict[str, Any]:
    """The schema of a value that may have a label beside it, as may each entry of a list."""
    for item in (part, *part.get("anyOf", ())):
        if entries := item.pop("prefixItems", None):  # all alike: points and directions
            item["items"] = entries[0]
        if "items" in item:
            item["items"] = _label(item["items"])
    label = {
        "label": {"enum": ["sourced", "derived", "assumed"]},
        "note": {"type": "string"},
        "range": {"type": "array"},
    }
    labelled = {"type": "object", "properties": {"value": part, **label}, "required": ["value", "label", "note"]}
    return {"anyOf": [part, labelled | {"additionalProperties": False}]}


def _has_reference(part: Any) -> bool:
    return "$ref" in json.dumps(part)


def walk(annotation: Any) -> Iterator[Any]:
    """Everything that an annotation is made of: types, literals and metadata."""
    yield annotation
    for item in (*get_args(annotation), *getattr(annotation, "__metadata__", ())):
        yield from walk(item)


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables that an annotation names, each once."""
    for item in dict.fromkeys(part for part in walk(annotation) if isinstance(part, type)):
        if issubclass(item, BaseModel):
            yield item


def find_models(root: type[BaseModel]) -> list[type[BaseModel]]:
    """The tables of a file, the file itself first, each once."""
    found = [root]
    for model in found:
        for field in model.model_fields.values():
            found += [item for item in models_in(field.annotation) if item not in found]
    return found


def summary(model: type[BaseModel]) -> str:
    """What a table is, from the text of its class."""
    text = inspect.cleandoc(model.__doc__ or "").split("Attributes:")[0]
    return " ".join(text.split())


def find_meaning(model: type[BaseModel], key: str) -> str:
    """What a key means: from the texts of the table's classes, or else of all such keys; empty where none says so."""
    for owner in model.__mro__:
        text = inspect.cleandoc(owner.__doc__ or "") if owner.__module__.startswith("vgtsim.") else ""
        _, _, attributes = text.partition("Attributes:")
        for names, meaning in re.findall(r"(?m)^    ([a-z_, ]+): (.*(?:\n {8}.*)*)", attributes):
            if key in names.split(", "):
                return " ".join(meaning.split())
        for sentence in re.split(r"(?<=[.;])\s+", " ".join(text.split())):
            if f"`{key}`" in sentence:
                return sentence
    return _COMMON.get(key, "")
