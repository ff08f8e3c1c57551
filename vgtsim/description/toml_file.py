"""The text of a TOML file as tables, and everything that can be wrong with a file before its entries are looked at."""

from __future__ import annotations

import codecs
import os
import stat
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from vgtsim.errors import DescriptionError

_LARGEST = 1_000_000  # bytes; the largest shipped file has a thirtieth of it
_DEEPEST = 12  # tables in tables and lists in lists; shipped files have six
# bits of an integer: 4,300 digits, more of which Python does not write, nor read but as 0x, 0o and 0b
_LONGEST = 14_284
_MARKS = ((codecs.BOM_UTF32_LE, "UTF-32"), (codecs.BOM_UTF16_LE, "UTF-16"), (codecs.BOM_UTF16_BE, "UTF-16"))


def read_toml(file: Path) -> dict[str, Any]:
    """Read the tables of a TOML file in UTF-8, with or without a byte-order mark.

    Raises:
        DescriptionError: The file is missing, is no regular file, is too large, is in another encoding, is not TOML, or
            nests too deeply.
    """
    try:
        data = tomllib.loads(_decode(file, _read_bytes(file)))
    except RecursionError:
        raise DescriptionError(file, "", "deeper nesting", f"tables and lists {_DEEPEST} deep at most") from None
    except tomllib.TOMLDecodeError as error:
        raise DescriptionError(file, "", f"a TOML syntax error, {error}", "TOML 1.0") from None
    except ValueError as error:  # an integer of thousands of digits
        raise DescriptionError(file, "", str(error).split(";")[0], "TOML 1.0 with figures of sensible length") from None
    _require_plain(file, data)
    return data


def read_text(file: Path, largest: int = _LARGEST, what: str = "TOML file that a person wrote") -> str:
    """Read a text of so many bytes at most; errors are those of `read_toml` but for the contents."""
    return _decode(file, _read_bytes(file, largest, what))


def _read_bytes(file: Path, largest: int = _LARGEST, what: str = "TOML file that a person wrote") -> bytes:
    try:
        if not stat.S_ISREG(os.stat(file).st_mode):  # a pipe or a device would be read for ever
            raise DescriptionError(file, "", "a folder, a pipe or a device", f"a readable {what}")
        with file.open("rb") as stream:
            content = stream.read(largest + 1)
    except (OSError, ValueError) as error:  # a path with a zero byte is a ValueError
        found = getattr(error, "strerror", None) or str(error)
        raise DescriptionError(file, "", found, f"a readable {what}") from None
    if len(content) > largest:
        raise DescriptionError(file, "", f"more than {largest} bytes", f"a {what}")
    return content


def _decode(file: Path, content: bytes) -> str:
    for mark, name in _MARKS:
        if content.startswith(mark):
            raise DescriptionError(file, "", f"text in {name}", "text in UTF-8: save the file so in the editor")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = (
            f"byte {content[error.start]:#04x} in line {line}, which is not UTF-8 (Latin-1 or Windows-1252, perhaps)"
        )
        raise DescriptionError(file, "", found, "text in UTF-8: save the file so in the editor") from None


def _require_plain(file: Path, data: Any) -> None:
    """Refuse dotted keys that nest deeper than any description, as what reads the tables calls itself for each level.

    So are integers that no message could show.
    """
    level: list[tuple[str, Any]] = [("", data)]
    for _ in range(_DEEPEST):
        level = [(f"{key}.{name}".lstrip("."), entry) for key, node in level for name, entry in _list_entries(node)]
        if long := [key for key, entry in level if isinstance(entry, int) and entry.bit_length() > _LONGEST]:
            raise DescriptionError(file, long[0], "an integer of thousands of digits", "figures of sensible length")
        level = [(key, entry) for key, entry in level if isinstance(entry, dict | list)]
        if not level:
            return
    raise DescriptionError(file, "", "deeper nesting", f"tables and lists {_DEEPEST} deep at most")


def _list_entries(node: dict[str, Any] | list[Any]) -> Iterable[tuple[Any, Any]]:
    return node.items() if isinstance(node, dict) else enumerate(node)
