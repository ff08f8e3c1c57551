"""The root of every description model: frozen, and strict about keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

UNKNOWN_KEY = "unknown_key"  # kind of pydantic's error whose context lists the keys
_PRINTED = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$"  # no sign that steers a terminal or breaks a line

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
