"""The root of every description model: frozen, and strict about keys."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

UNKNOWN_KEY = "unknown_key"  # kind of pydantic's error whose context lists the keys
_PRINTED = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$"  # no sign that steers a terminal or breaks a line

NEEDED = "this key, which is needed"
_ALLOWED = {  # by pydantic's name of the error; other errors keep its words
    "missing": NEEDED,
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "less than {lt:g}",
    "less_than_equal": "{le:g} or less",
    "finite_number": "a finite number",
    "string_type": "a text",
    "string_too_short": "a text of length {min_length} or more",
    "string_too_long": "a text of length {max_length} or less",
    "string_pattern_mismatch": "a text like the pattern {pattern}",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "too_short": "a list of {min_length} or more",
    "too_long": "a list of {max_length} or fewer",
}

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]
Title = Annotated[str, StringConstraints(pattern=_PRINTED, max_length=200)]
Note = Annotated[str, StringConstraints(pattern=_PRINTED, max_length=2000)]


class Description(BaseModel):
    """A frozen record read from TOML. An unknown key is an error that gives the nearest known key.

    Figures are in SI, as the type of a field says: a `Length` in m, an `Angle` in rad, a `Force` in N, a `Pressure` in Pa.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        unknown = [str(key) for key in data if key not in cls.model_fields] if isinstance(data, Mapping) else []
        if unknown:
            hints = [f"unknown key {key!r}{near(key, cls.model_fields)}" for key in unknown]
            known = ", ".join(sorted(cls.model_fields))
            context = {"said": f"{'; '.join(hints)} (known: {known})", "keys": unknown}
            raise PydanticCustomError(UNKNOWN_KEY, "{said}", context)
        return data


def closest(name: str, allowed: Iterable[object]) -> str:
    """Make the end of an error message that gives the nearest allowed name, then all allowed names."""
    names = [str(item) for item in allowed]
    return f"{near(name, names)} (known: {', '.join(sorted(names)) or 'none'})"


def near(name: str, allowed: Iterable[object]) -> str:
    """Make a part of an error message that gives the nearest allowed name; empty where none is near."""
    found = get_close_matches(name, [str(item) for item in allowed], n=1)
    return f"; did you mean {found[0]!r}?" if found else ""


def say_allowed(complaint: ErrorDetails) -> str:
    """What is allowed where pydantic complains, with the nearest of the names that are."""
    kind, context = complaint["type"], complaint.get("ctx", {})
    if kind in ("literal_error", "enum"):
        names = re.findall(r"'([^']*)'", context["expected"])
        return f"{context['expected']}{near(str(complaint['input']), names)}"
    if kind in _ALLOWED:
        return _ALLOWED[kind].format(**context)
    return complaint["msg"].removeprefix("Value error, ")


def require_distinct(kind: str, items: Iterable[Any]) -> None:
    """Refuse items of a kind that share a `name`."""
    names = [item.name for item in items]
    if len(set(names)) != len(names):
        raise ValueError(f"{kind} names must differ: {names}")


class Provenance(Description):
    """The source of a figure, its derivation or the reason for it; a figure outside its `range` is refused."""

    label: Annotated[str, Field(pattern="^(sourced|derived|assumed)$")]
    note: Note
    range: tuple[float | str, float | str] | None = None
