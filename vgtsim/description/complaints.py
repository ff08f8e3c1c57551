"""Complaints of pydantic about a file, said in words of this project: key, found, allowed, nearest name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vgtsim.description.modules import KIND_NAMES
from vgtsim.description.motion import BENDS, POSTURE, WORD
from vgtsim.description.schema import NEEDED, UNKNOWN_KEY, near, say_allowed
from vgtsim.description.study import AXES, VERBS
from vgtsim.description.tool_path import SHAPES
from vgtsim.errors import DescriptionError

# a union adds the choice to the path of an error
_CHOICES = {*KIND_NAMES, *SHAPES, *VERBS, *AXES, BENDS, POSTURE, WORD}
_KINDS = {"union_tag_invalid", "union_tag_not_found"}  # names that pydantic has for a table of no known kind
_STEPS = ("mission",)  # the same, behind the index of a step: its name may also be a key


def translate(error: ValidationError, file: Path | None, prefix: str = "") -> DescriptionError:
    """Turn the first of pydantic's complaints into ours, counting the others."""
    first, *others = translate_all(error, file, prefix)
    if others:
        more = f" [and {len(others)} more: {', '.join(other.key for other in others[:4])}]"
        return DescriptionError(file, first.key, first.found, first.allowed + more)
    return first


def translate_all(error: ValidationError, file: Path | None, prefix: str = "") -> list[DescriptionError]:
    """Turn each of pydantic's complaints into ours."""
    found = []
    for item in error.errors(include_url=False):
        place = item["loc"]
        path = [
            str(part) for k, part in enumerate(place) if part not in _CHOICES and not (k > 1 and place[k - 2] in _STEPS)
        ]
        # those of a whole table say themselves what they found
        whole = item["type"] in ("value_error", UNKNOWN_KEY) and isinstance(item["input"], dict)
        there = "nothing" if item["type"] == "missing" else "" if whole else shorten(item["input"])
        allowed = say_allowed(item)
        if item["type"] in _KINDS and "ctx" in item:  # of several tables, told apart by one key
            path.append(item["ctx"]["discriminator"].strip("'"))
            there, allowed = _tell_kinds(item["ctx"])
        key = ".".join([prefix, *path] if prefix else path)
        found.append(DescriptionError(file, key, there, allowed))
    return found


def _tell_kinds(context: dict[str, str]) -> tuple[str, str]:
    """The kind of table that was read, and the known ones."""
    if "tag" not in context:
        return "nothing", NEEDED
    tag, names = context["tag"], [name.strip("'") for name in context["expected_tags"].split(", ")]
    return repr(tag), f"one of {', '.join(names)}{near(tag, names)}"


def shorten(value: Any) -> str:
    """Show a value from a file in at most 60 signs."""
    try:
        text = f"a table with {', '.join(map(repr, value))}" if isinstance(value, dict) else repr(value)
    except ValueError:  # Python writes no integer of thousands of digits
        text = "a figure of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
