"""The reference of keys and the schemas for editors: current, complete, and of one mind with the loaders."""

from __future__ import annotations

import json
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

from scripts.reference_page import write_reference
from vgtsim.description.reference import FILES, find_meaning, find_models, write_schema
from vgtsim.description.shipped import list_shipped

ROOT = Path(__file__).parents[2]
CATALOGUE = ROOT / "vgtsim/description/catalogue.toml"
SHIPPED = [(kind, file) for kind in FILES if kind != "catalogue" for file in list_shipped(kind).values()]
SHIPPED.append(("catalogue", CATALOGUE))


@cache
def read_schema(kind):
    """The schema of a kind of file, written once for all files of the kind."""
    return json.loads(write_schema(kind))


def test_the_generated_pages_are_current():
    """Where this fails, run `scripts/make_reference`."""
    assert (ROOT / "docs/reference.md").read_text(encoding="utf-8") == write_reference()
    for kind in FILES:
        assert (ROOT / f"docs/schema/{kind}.json").read_text(encoding="utf-8") == write_schema(kind)


@pytest.mark.parametrize("kind", FILES)
def test_every_key_has_a_meaning(kind):
    models = find_models(FILES[kind])
    keys = [(model, key) for model in models if model.__name__ != "Provenance" for key in model.model_fields]
    assert [
        f"{model.__name__}.{key}" for model, key in keys if key != "provenance" and not find_meaning(model, key)
    ] == []


def test_straight_is_explained_for_each_kind():
    models = [model for model in find_models(FILES["arm"]) if "straight" in model.model_fields]
    meanings = {find_meaning(model, "straight") for model in models}
    assert len(meanings) == len(models) >= 4


def test_a_scene_on_another_may_hold_some_keys_of_a_table_in_a_table():
    schema, file = read_schema("scene"), list_shipped("scene")["type_ii_mission"]
    whole = tomllib.loads(file.read_text(encoding="utf-8"))
    part = {"feed": {"stroke": "20 m"}}
    assert holds(schema, {"base": "type_ii_mission", "mast": part}, schema)
    assert not holds(schema, {"base": "type_ii_mission", "mast": {"feed": {"stork": "20 m"}}}, schema)
    assert not holds(schema, whole | {"mast": whole["mast"] | part}, schema)


@pytest.mark.parametrize(("kind", "file"), SHIPPED, ids=lambda item: getattr(item, "stem", item))
def test_each_shipped_file_opens_with_its_schema(kind, file):
    first = file.read_text(encoding="utf-8").splitlines()[0]
    found = re.fullmatch(r"#:schema (\S+)", first)
    assert found
    assert (file.parent / found[1]).resolve() == ROOT / f"docs/schema/{kind}.json"


KINDS = {
    "object": dict,
    "array": list,
    "string": str,
    "number": int | float,
    "integer": int,
    "boolean": bool,
    "null": type(None),
}


def holds(schema, value, root):
    """Whether a value keeps to a schema, by the few words of JSON schema that ours have."""
    if "$ref" in schema:
        return holds(root["$defs"][schema["$ref"].split("/")[-1]], value, root)
    if any(not any(holds(part, value, root) for part in schema[word]) for word in ("anyOf", "oneOf") if word in schema):
        return False
    kind = schema.get("type")
    if kind and (not isinstance(value, KINDS[kind]) or (isinstance(value, bool) and kind != "boolean")):
        return False
    if value not in schema.get("enum", [value]) or value != schema.get("const", value):
        return False
    if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
        return False
    if isinstance(value, int | float) and value <= schema.get("exclusiveMinimum", value - 1):
        return False
    if isinstance(value, dict) and not holds_table(schema, value, root):
        return False
    if "not" in schema and holds(schema["not"], value, root):
        return False
    if isinstance(value, list) and len(value) < schema.get("minItems", 0):
        return False
    return not isinstance(value, list) or all(holds(schema.get("items", {}), item, root) for item in value)


def holds_table(schema, value, root):
    known, other = schema.get("properties", {}), schema.get("additionalProperties", True)
    if set(schema.get("required", ())) - set(value):
        return False
    if "if" in schema and holds(schema["if"], value, root) and not holds(schema["then"], value, root):
        return False
    forms = {key: known.get(key, other) for key in value}
    return all(form if isinstance(form, bool) else holds(form, value[key], root) for key, form in forms.items())


def test_a_study_may_write_its_keys_dotted_or_as_tables():
    schema = read_schema("study")
    study = {"name": "x", "scene": "y", "work": {"verb": "plan"}}
    span, values = {"least": "1 kg", "greatest": 2.0, "count": 3}, ["1 kg", 2.0]
    for grid in (
        {"scene.payload.mass": span, "work.seed": values},
        {"scene": {"payload": {"mass": span, "radius": values}}},
    ):
        assert holds(schema, study | {"grid": grid}, schema)
        sample = {"method": "sobol", "count": 4, "seed": 0, "over": grid}
        assert holds(schema, study | {"sample": sample}, schema)
    for grid in ({"scene.payload.mass": "1 kg"}, {"scene": {"payload": {"mass": span | {"cuont": 3}}}}, {"arm.x": []}):
        assert not holds(schema, study | {"grid": grid}, schema)
    assert not holds(schema, study | {"work": {"verb": "walk"}}, schema)


@pytest.mark.parametrize(("kind", "file"), SHIPPED, ids=lambda item: getattr(item, "stem", item))
def test_schemas_accept_what_is_shipped_and_refuse_slips(kind, file):
    schema, data = read_schema(kind), tomllib.loads(file.read_text(encoding="utf-8"))
    assert holds(schema, data, schema)
    assert not holds(schema, data | {"nmae": "x"}, schema)
    if kind in ("arm", "tank") and "base" not in data:
        assert not holds(schema, {key: entry for key, entry in data.items() if key != "title"}, schema)
        assert not holds(schema, data | {"face_side" if kind == "arm" else "shell": "wide"}, schema)
    if kind == "scene" and "base" not in data:
        assert not holds(schema, data | {"payload": {}}, schema)
