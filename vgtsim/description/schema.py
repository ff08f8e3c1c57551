"""The root of every description model: frozen, and strict about keys."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Description(BaseModel):
    """A frozen record read from TOML; a key it does not know is an error that names the nearest one it does."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    raise ValueError(f"unknown key {key!r}{closest(str(key), cls.model_fields)}")
        return data


def closest(name: str, allowed: Any) -> str:
    """Say which names are allowed, the nearest one first.

    Args:
        name: The name that was found.
        allowed: Iterable of the names that may stand there.

    Returns:
        Text to append to an error message.
    """
    names = [str(item) for item in allowed]
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"{hint} (known: {', '.join(sorted(names)) or 'none'})"


class Provenance(Description):
    """Where a figure comes from.

    Attributes:
        label: `sourced`, `derived` or `assumed`.
        note: The source, the derivation or the reason.
        range: For assumed figures, the least and greatest value that would be believed; a figure outside is refused.
    """

    label: Annotated[str, Field(pattern="^(sourced|derived|assumed)$")]
    note: str
    range: tuple[float | str, float | str] | None = None
