"""Blocks of the documents' pages, for the programs that run them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

FENCE = re.compile(r"^(?:<!-- (file|not run): (.*?) -->\n+)?```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A fenced block of a page: its language and text, the file that it goes to, and why it is not run."""

    language: str
    text: str
    file: str = ""
    left_out: str = ""


def read_blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page in their order."""
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    return [
        Block(language, text, file=told if mark == "file" else "", left_out=told if mark == "not run" else "")
        for mark, told, language, text in found
    ]
